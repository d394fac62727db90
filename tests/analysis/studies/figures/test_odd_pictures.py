"""Pictures of names, values and gaps that are seldom: none is empty, mistaken or unreadable without saying so."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import pytest
from made_up_results import results
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.text import Text

from teamsight.analysis.studies.figures.cells import Quantity
from teamsight.analysis.studies.figures.difference import pair
from teamsight.analysis.studies.results import StudyResults
from teamsight.analysis.studies.study import Study

POLICIES = [r"$\frac$", "costs $1 or $2", "_hidden", ""]


def words(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.texts)


def holed(study: Study) -> StudyResults:
    """Return results in which runs of four robots have no value."""

    def value(parameters: Mapping[str, Any], rng: np.random.Generator) -> float:
        return np.nan if parameters["robots"] == 4 else float(rng.random())

    return results(study, value)


@pytest.mark.parametrize("kind", ["heat-map", "lines", "scatter"])
def test_dollars_and_backslashes_are_no_formulas(kind: str) -> None:
    study = Study(axes={"policy": POLICIES, "awareness": POLICIES}, replicates=2, name=r"$\nope$")
    figure = results(study).plot(kind=kind)
    FigureCanvasAgg(figure).draw()
    found = figure.findobj(Text)
    assert {r"$\frac$", "costs $1 or $2"} <= {text.get_text() for text in found}
    assert not any(text.get_parse_math() for text in found if "$" in text.get_text())


def test_numbers_of_logarithmic_axes_are_no_formulas() -> None:
    values = np.geomspace(1, 1000, 40).tolist()
    points = {"radius": values, "mean_time": values[::-1]}
    figure = results(Study(points=points, replicates=2)).plot(kind="scatter", x="radius", y="mean_time")
    FigureCanvasAgg(figure).draw()
    texts = [text.get_text() for axis in (figure.axes[0].xaxis, figure.axes[0].yaxis) for text in axis.get_ticklabels()]
    assert {"1", "10", "100", "1000"} <= set(texts)
    assert not any("$" in text.get_text() for text in figure.axes[0].yaxis.get_ticklabels(minor=True))


def test_each_line_has_its_name_in_the_legend() -> None:
    figure = results(Study(axes={"robots": [2, 4, 8], "policy": POLICIES}, replicates=2)).plot(kind="lines")
    names = [text.get_text().strip() for text in figure.legends[0].get_texts()]
    assert names == POLICIES


def test_points_between_gaps_have_intervals() -> None:
    found = holed(Study(axes={"robots": [2, 4, 8]}, replicates=3))
    figure = found.plot(kind="lines")
    bars = [one for one in figure.axes[0].collections if isinstance(one, LineCollection)]
    ends = [segment[:, 1].tolist() for one in bars for segment in one.get_segments()]
    summary = found.summary()
    wanted = [[100 * row["low"], 100 * row["high"]] for row in summary[summary["n"] > 0].to_dict("records")]
    assert ends == [pytest.approx(one) for one in wanted]


def test_runs_without_a_value_are_not_called_missing() -> None:
    study = Study(axes={"robots": [2, 3, 5], "radius": [1.0, 2.0, 3.0]}, replicates=2)
    text = words(results(study, lambda parameters, rng: np.nan).plot())
    assert "no run has a value" in text
    assert "grey: no values" in text


def test_a_difference_without_values_blames_the_measure() -> None:
    keys = {"robots": [1, 2], "replicate": 0, "seed": [3, 4]}
    known, unknown = (pd.DataFrame({**keys, "loss": value}) for value in (1.0, np.nan))
    with pytest.raises(ValueError, match="none of the 2 runs .* no value in any run of that which is subtracted"):
        pair(known, unknown, ["robots"], "loss")
    with pytest.raises(ValueError, match="no value in any run of the study;"):
        pair(unknown, known, ["robots"], "loss")


def test_points_of_one_run_are_not_said_to_have_bars() -> None:
    assert "intervals need two runs" in words(results(Study(axes={"robots": [1, 2, 3]})).plot(kind="scatter"))
    twice = results(Study(axes={"robots": [1, 2, 3]}, replicates=2)).plot(kind="scatter")
    assert "bars are 95 % intervals" in words(twice)


@pytest.mark.short
def test_rounding_errors_of_half_widths_justify_no_decimals() -> None:
    assert Quantity("loss", True).fitted(np.array([-0.4, -0.4]), np.array([1e-16, 2e-16])).decimals == 3


@pytest.mark.parametrize("kind", ["heat-map", "scatter"])
def test_numbers_at_ticks_stay_apart(kind: str) -> None:
    axes = {"robots": list(range(1, 61)), "radius": list(range(1, 61))}
    logs = np.geomspace(1, 1000, 10).tolist()
    study = Study(axes=axes if kind == "heat-map" else {"radius": logs, "mean_time": logs})
    figure = results(study, share=0.01 if kind == "heat-map" else 1.0).plot(kind=kind)
    FigureCanvasAgg(figure).draw()
    for place in figure.axes[:2]:
        labels = [text for text in place.get_xticklabels() if text.get_text()]
        boxes = [text.get_window_extent() for text in labels]
        assert len(boxes) >= 4
        for one, other in itertools.pairwise(boxes):
            # At least the width of half a digit, or they read as one number.
            assert other.x0 - one.x1 > 3


def test_several_values_of_one_axis_are_refused() -> None:
    with pytest.raises(TypeError, match="where=robots=.*one value"):
        results(Study(axes={"robots": [1, 2, 3]})).plot(where={"robots": [1, 2]})


def test_the_value_that_an_error_suggests_can_be_chosen() -> None:
    policies = ["with a space that makes it long", *(f"policy {number}" for number in range(10))]
    found = results(Study(axes={"robots": list(range(11)), "policy": policies}, zip=[["robots", "policy"]]))
    with pytest.raises(ValueError, match="as in --where robots=0$"):
        found.plot(kind="distribution")
    long = results(Study(axes={"policy": policies}))
    with pytest.raises(ValueError, match="as in --where 'policy=with a space that makes it long'$"):
        long.plot(kind="distribution")
    assert long.plot(kind="distribution", where={"policy": "with a space that makes it long"})
