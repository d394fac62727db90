"""The drawing of learning curves: nothing leaves it or lies over something else, and nothing is claimed idly."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from teamsight.analysis.learning.curve_figure import draw
from teamsight.analysis.learning.curves import awareness_gains, crossings
from teamsight.analysis.learning.evaluation import BY_HAND, DESIGNED, RANDOM
from teamsight.analysis.learning.plans import LEAST_FOR_INTERVAL, Curves

pytestmark = pytest.mark.short

SIZES = {"lazy": 9.6, "pessimistic": 9.6, "tabular": 5.0, "linear": 3.2, "regression": 1.8}


def gains_of(curves: Curves) -> pd.DataFrame:
    """Return the gains of made-up shares: the regression gains from awareness, the others do not."""
    rng = np.random.default_rng(1)
    by_hand = {name: [degree.name] for name, (_, degree) in BY_HAND.items()}
    designed = {RANDOM: ["none"], DESIGNED: ["pairwise"], **by_hand}
    points = [*product(curves.learners, curves.samples), *((name, 0) for name in designed)]
    rows = [
        {"learner": learner, "transitions": transitions, "degree": degree, "memory": memory, "robots": robots}
        | {"radius": radius, "log10_size": SIZES.get(learner, np.nan)}
        | {"observed_fraction": rng.uniform(0.3, 0.31) + 0.2 * (learner == "regression" and degree == "ring")}
        for learner, transitions in points
        for degree in designed.get(learner, ["none", "ring"])
        for memory in range(curves.memories)
        for robots, radius in curves.scenarios
    ]
    return awareness_gains(pd.DataFrame(rows))


def drawn(curves: Curves):  # type: ignore[no-untyped-def]
    gains = gains_of(curves)
    figure = draw(gains, crossings(gains), curves)
    FigureCanvasAgg(figure).draw()
    return figure


@pytest.mark.parametrize(
    ("learners", "memories", "robots"),
    [
        (("tabular",), 1, (5,)),
        (("tabular",), 10, (1, 5, 10, 20, 30)),
        (("lazy", "pessimistic"), 10, (5,)),
        (("lazy", "pessimistic"), 1, (5, 10, 20)),
        (("lazy", "tabular", "linear", "regression"), 10, (5, 10, 20)),
        (("lazy", "tabular", "linear", "regression"), 1, (1, 5, 10, 20, 30)),
    ],
)
def test_everything_is_inside_and_nothing_lies_over_something_else(
    learners: tuple[str, ...], memories: int, robots: tuple[int, ...]
) -> None:
    figure = drawn(Curves(learners=learners, memories=memories, robots=robots))
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


@pytest.mark.parametrize(
    ("samples", "shown"), [((150, 600), (150, 600)), (Curves.samples, Curves.samples[::2]), (Curves.samples[:8], Curves.samples[1:8:2])]
)
def test_samples_are_labelled(samples: tuple[int, ...], shown: tuple[int, ...]) -> None:
    figure = drawn(Curves(learners=("lazy",), samples=samples, memories=1))
    assert [text.get_text() for text in figure.axes[0].get_xticklabels()] == [f"{mark:,}" for mark in shown]


def test_there_is_a_panel_for_each_scenario() -> None:
    figure = drawn(Curves(learners=("linear",), samples=(150, 600), robots=(5, 10), radius=(3.0, 5.5), memories=1))
    titles = [axes.get_title("left") for axes in figure.axes]
    assert titles[:4] == ["N = 5, R = 3", "N = 10, R = 3", "N = 5, R = 5.5", "N = 10, R = 5.5"]
    assert len(titles) == 6


@pytest.mark.parametrize("memories", [LEAST_FOR_INTERVAL - 1, LEAST_FOR_INTERVAL])
def test_too_few_explorations_have_no_interval(memories: int) -> None:
    figure = drawn(Curves(learners=("lazy",), memories=memories))
    bands = [band for band in figure.axes[0].collections if band.get_paths() and len(band.get_paths()[0].vertices)]
    assert len(bands) == (1 if memories == LEAST_FOR_INTERVAL else 0)
    message = " ".join(text.get_text() for text in figure.texts)
    assert ("too few for an interval" in message) == (memories < LEAST_FOR_INTERVAL)


def test_crossings_are_drawn_where_they_are_and_learners_without_one_above_all_samples() -> None:
    last = drawn(Curves(learners=("lazy", "pessimistic", "regression"), robots=(5,), samples=(150, 600))).axes[-1]
    labels = dict(zip((text.get_text() for text in last.get_yticklabels()), last.get_yticks(), strict=True))
    never = labels["not within\n600"]
    assert never > 600
    places = np.vstack([points.get_offsets() for points in last.collections if len(points.get_offsets())])
    # Of three learners in two scenarios, only the regression gains; no point hides another one.
    assert sorted(places[:, 1]) == [150, 150, never, never, never, never]
    assert len(np.unique(places, axis=0)) == 6
    assert [text.get_text() for text in last.get_xticklabels()] == ["regression\n1.8", "lazy,\npessimistic\n9.6"]


def test_each_team_that_learns_nothing_is_a_horizontal_line_and_is_named() -> None:
    curves = Curves(learners=("regression",), memories=3)
    gains = gains_of(curves)
    (axes,) = (axes for axes in drawn(curves).axes if axes.get_title("left").startswith("Observed"))
    means = gains[gains["robots"].isna()].set_index("learner")
    drawn_at = [line.get_ydata()[0] for line in axes.lines if line.get_ydata()[0] == line.get_ydata()[-1]]
    notes = " ".join(text.get_text() for text in axes.texts)
    for name, (_, degree) in BY_HAND.items():
        height = 100 * means.loc[name, "collective" if degree.name == "none" else "cooperative"]
        assert any(height == pytest.approx(one) for one in drawn_at), name
        assert name.rpartition(", ")[2] in notes


def test_the_title_says_from_when_awareness_pays() -> None:
    figure = drawn(Curves(learners=("lazy", "regression"), samples=(150, 600), memories=10, robots=(5,)))
    assert figure.get_label() == "Awareness pays from 150 (regression) transitions; is not shown to pay for lazy"
