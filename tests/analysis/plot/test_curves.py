"""Curves against team size, with bands where an interval is known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.plot.curves import draw_curves
from teamsight.analysis.plot.style import canvas


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
