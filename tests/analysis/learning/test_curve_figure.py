"""The drawing of learning curves: nothing leaves it or lies over something else, and nothing is joined or claimed idly."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from teamsight.analysis.learning.curve_figure import LEAST_FOR_INTERVAL, draw_on_canvas
from teamsight.analysis.learning.curve_points import curve_points
from teamsight.analysis.learning.curves import SAMPLES, Curves
from teamsight.analysis.learning.evaluation import DESIGNED, RANDOM

pytestmark = pytest.mark.short

WIDTHS = {"none": 16, "ring": 32, "pairwise": 24, "shared": 80}


def table_of(curves: Curves) -> pd.DataFrame:
    """Made-up shares; no table of states where all teammates are known."""
    rng = np.random.default_rng(1)
    place = {"replicate": 0, "seed": 0}
    rows = [
        {
            "learner": learner,
            "degree": degree,
            "transitions": pairs,
            "inputs": inputs,
            "log10_size": inputs * np.log10(2),
        }
        | {"memory": memory, **place, "observed_fraction": rng.uniform(0.3, 0.5)}
        for learner in curves.learners
        for degree, inputs in WIDTHS.items()
        for pairs in curves.samples
        for memory in range(curves.memories)
    ]
    rows += [
        {"learner": name, "degree": "", "transitions": 0, "inputs": 0, "log10_size": 0.0}
        | {"memory": memory, **place, "observed_fraction": share}
        for name, share in ((RANDOM, 0.4), (DESIGNED, 0.7))
        for memory in range(curves.memories)
    ]
    table = pd.DataFrame(rows)
    refused = (table["learner"] == "tabular") & (table["degree"] == "shared")
    return table.assign(observed_fraction=table["observed_fraction"].mask(refused))


def drawn(curves: Curves):  # type: ignore[no-untyped-def]
    table = table_of(curves)
    figure = draw_on_canvas(curve_points(table), table, curves)
    FigureCanvasAgg(figure).draw()
    return figure


@pytest.mark.parametrize("learners", [("lazy",), ("tabular",), ("lazy", "pessimistic"), ("lazy", "tabular", "linear")])
@pytest.mark.parametrize("memories", [1, 10])
def test_everything_is_inside_and_nothing_lies_over_something_else(learners: tuple[str, ...], memories: int) -> None:
    figure = drawn(Curves(learners=learners, memories=memories))
    boxes = [text.get_window_extent() for text in figure.texts]
    boxes += [axes.get_tightbbox() for axes in figure.axes]
    boxes += [legend.get_window_extent() for legend in figure.legends]
    for box in boxes:
        assert box.x0 > 0
        assert box.y0 >= 0
        assert box.x1 < figure.bbox.x1
        assert box.y1 < figure.bbox.y1
    for one, other in combinations(boxes, 2):
        # Labels of ticks at the ends of neighbouring panels come near to each other; touching is no overlap.
        assert not one.padded(-3).overlaps(other)
    for axes in figure.axes:
        legend = axes.get_legend()
        assert legend is None or not legend.get_window_extent().padded(-2).overlaps(axes.bbox)


@pytest.mark.parametrize(
    ("samples", "shown"), [((150, 600), (150, 600)), (SAMPLES, SAMPLES[::2]), (SAMPLES[:8], SAMPLES[1:8:2])]
)
def test_samples_are_labelled(samples: tuple[int, ...], shown: tuple[int, ...]) -> None:
    figure = drawn(Curves(learners=("lazy",), samples=samples, memories=1))
    assert [text.get_text() for text in figure.axes[0].get_xticklabels()] == [f"{mark:,}" for mark in shown]


def test_degrees_are_named_and_not_joined() -> None:
    lower = drawn(Curves(learners=("lazy",), memories=3)).axes[1]
    assert [text.get_text().split("\n")[0] for text in lower.get_xticklabels()] == ["Θ(0)", "Θ(N)", "Θ(1)", "o(N)"]
    markers = [line for line in lower.lines if len(line.get_xdata()) == 4]
    assert [line.get_linestyle() for line in markers] == ["None"] * 3


@pytest.mark.parametrize("memories", [LEAST_FOR_INTERVAL - 1, LEAST_FOR_INTERVAL])
def test_too_few_explorations_have_no_interval(memories: int) -> None:
    figure = drawn(Curves(learners=("lazy",), memories=memories))
    assert len(figure.axes[0].collections) == (4 if memories == LEAST_FOR_INTERVAL else 0)
    message = " ".join(text.get_text() for text in figure.texts)
    assert ("too few for an interval" in message) == (memories < LEAST_FOR_INTERVAL)


def test_what_had_no_table_is_reported_beside_the_title() -> None:
    figure = drawn(Curves(learners=("lazy", "tabular"), memories=1))
    assert [axes.get_title("right") for axes in figure.axes] == ["", "", "o(N): too many states", ""]
