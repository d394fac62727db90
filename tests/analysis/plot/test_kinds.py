"""The kinds of panels: curves with bands or bars, distributions, maps on one scale."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import LineCollection

from teamsight.agents.awareness import AWARENESS
from teamsight.analysis.plot.kinds import draw_curves, draw_distribution, draw_means, panels
from teamsight.analysis.plot.style import DEGREE, POLICY, TARGETS, canvas, colours_of
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies import POLICIES


def cells(radii: int, half: float = 1.0) -> pd.DataFrame:
    table = pd.DataFrame([(n, float(r), 10.0 * n + r) for n in (1, 2, 5) for r in range(1, radii + 1)])
    table.columns = ["robots", "radius", "mean"]
    return table.assign(low=table["mean"] - half, high=table["mean"] + half)


@pytest.mark.parametrize(("radii", "shown"), [(1, [1]), (2, [1, 2]), (3, [1, 2, 3]), (9, [1, 2, 4, 9])])
def test_a_curve_for_each_of_a_few_radii(radii: int, shown: list[int]) -> None:
    axes = canvas(8, 4).add_subplot()
    draw_curves(axes, cells(radii), "observed targets  [%]")
    assert [line.get_label() for line in axes.lines] == [f"R = {radius}" for radius in shown]
    for line, radius in zip(axes.lines, shown, strict=True):
        assert np.asarray(line.get_ydata()).tolist() == [10 + radius, 20 + radius, 50 + radius]
    for band, radius in zip(axes.collections, shown, strict=True):
        heights = band.get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == (9 + radius, 51 + radius)


def test_an_unknown_interval_is_not_drawn() -> None:
    axes = canvas(8, 4).add_subplot()
    draw_curves(axes, cells(2, np.inf), "observed targets  [%]")
    assert all(
        len(path.vertices) == 0 or np.isfinite(path.vertices).all()
        for band in axes.collections
        for path in band.get_paths()
    )
    assert len(axes.lines) == 2


def test_means_have_bands_or_bars_that_end_where_the_intervals_end() -> None:
    found = [interval_of(np.array(values)) for values in ([1.0, 3.0], [2.0, 2.5, 4.0], [5.0])]
    figure, (left, right) = panels("finding", "about", ["bands", "bars"], x="robots N", y="steps")
    draw_means(left, [1, 2, 3], found, "red", "team")
    draw_means(right, [1, 2, 3], found, "red", as_bars=True)
    assert left.lines[0].get_ydata().tolist() == [one.mean for one in found]
    heights = left.collections[0].get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == (found[0].low, found[0].high)
    (bars,) = (one for one in right.collections if isinstance(one, LineCollection))
    ends = [segment[:, 1].tolist() for segment in bars.get_segments()[:2]]
    assert ends == [pytest.approx([one.low, one.high]) for one in found[:2]]
    assert [axes.get_ylabel() for axes in (left, right)] == ["steps", ""]
    assert {text.get_text() for text in figure.texts} == {"finding", "about"}


def test_a_distribution_shows_the_share_up_to_each_value() -> None:
    axes = canvas(4, 3).add_subplot()
    draw_distribution(axes, [3.0, 1.0, np.nan, 2.0, 2.0], "red", "team")
    steps, mean = axes.lines
    assert dict(zip(*map(np.ndarray.tolist, steps.get_data()), strict=True)) == {1.0: 0.25, 2.0: 0.75, 3.0: 1.0}
    assert mean.get_xdata()[0] == 2.0


def test_each_degree_and_each_policy_has_its_colour_everywhere() -> None:
    assert set(DEGREE) == set(AWARENESS)
    assert set(POLICY) == set(POLICIES) - {"evasive"}
    assert len({TARGETS, *DEGREE.values(), *POLICY.values()}) == 1 + len(DEGREE) + len(POLICY)
    assert colours_of(["evolved", "centroid"]) == [POLICY["evolved"], POLICY["centroid"]]
    assert len(set(colours_of(["none", "centroid", "c"]))) == 3
