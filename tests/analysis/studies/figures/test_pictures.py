"""Pictures of studies of many shapes: nothing overlaps, cells show their numbers, what is missing is marked."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute
import pytest
from made_up_results import results
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from teamsight.analysis.plot.kinds import outline
from teamsight.analysis.studies.figures.cells import Quantity
from teamsight.analysis.studies.study import Study

POLICIES = ["a-cmommt", "random-walk", "centroid", "evolved"]
LONG = [f"my_package.policies:Follow_the_nearest_of_{n}_targets_with_care" for n in (1, 2, 30)]
MANY = list(range(1, 31))

SHAPES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "one setting": ({}, {}),
    "numbers": ({"robots": [1, 2, 5, 10]}, {}),
    "two numbers": ({"robots": [5, 10]}, {}),
    "many numbers": ({"robots": MANY}, {}),
    "logarithmic": ({"radius": np.geomspace(0.001, 1000, 12).tolist()}, {}),
    "texts": ({"policy": POLICIES}, {}),
    "many texts": ({"policy": [f"policy-number-{n}" for n in MANY]}, {}),
    "long texts": ({"policy": LONG, "radius": [2.0, 3.0]}, {"x": "policy"}),
    "small map": ({"robots": [1, 2, 3], "radius": [1.0, 2.0, 3.0]}, {}),
    "tall map": ({"radius": [1.0, 2.0], "robots": MANY}, {"kind": "heat-map", "x": "radius"}),
    "wide map": ({"robots": MANY, "radius": [1.0, 2.0]}, {"kind": "heat-map", "x": "robots"}),
    "large map": ({"robots": MANY, "radius": np.linspace(1, 9, 30).tolist()}, {}),
    "huge map": ({"robots": list(range(80)), "radius": np.linspace(1, 9, 70).tolist()}, {}),
    "map of texts": ({"policy": POLICIES, "awareness": ["none", "ring"]}, {}),
    "long texts below": ({"policy": LONG, "awareness": ["none", "ring"]}, {}),
    "panels": ({"robots": [2, 4, 8, 16], "radius": [1.0, 2.5, 4.0], "policy": POLICIES}, {}),
    "panels of lines": ({"robots": [2, 4, 8, 16], "radius": [1.0, 2.5], "policy": POLICIES}, {"y": "policy"}),
    "distributions": ({"policy": POLICIES, "awareness": ["none", "ring"]}, {"kind": "distribution"}),
    "scatter": ({"robots": MANY, "radius": [1.0, 2.0]}, {"kind": "scatter"}),
    "plane": ({"robots": MANY, "radius": [1.0, 2.0]}, {"kind": "scatter", "x": "robots", "y": "radius"}),
}


@cache
def drawn(shape: str) -> Figure:
    axes, how = SHAPES[shape]
    figure = results(Study(axes=axes, replicates=2), share=0.9).plot(**how)
    FigureCanvasAgg(figure).draw()
    return figure


def box_of(text: Text) -> Bbox:
    """Return the place of a text, a little smaller, since neighbours may touch."""
    box = text.get_window_extent()
    return Bbox.from_extents(box.x0 + 0.5, box.y0 + 0.5, box.x1 - 0.5, box.y1 - 0.5)


def ticks_of(figure: Figure) -> Iterator[list[Text]]:
    """Return the texts at the ticks of each flat axis that are not oblique: boxes of oblique ones overlap."""
    for axes in figure.axes:
        if axes.name != "3d" and axes.axison:
            for axis in (axes.xaxis, axes.yaxis):
                low, high = sorted(axis.get_view_interval())
                pairs = zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=False)
                texts = [text for place, text in pairs if low <= place <= high and text.get_text()]
                yield [text for text in texts if text.get_visible() and text.get_rotation() in (0, 90)]


def words(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.texts)


@pytest.mark.parametrize("shape", SHAPES)
def test_no_texts_overlap(shape: str) -> None:
    figure = drawn(shape)
    for texts in ticks_of(figure):
        for one, other in itertools.pairwise(texts):
            assert not box_of(one).overlaps(box_of(other)), (one.get_text(), other.get_text())
    head = figure.texts
    lowest = min(box_of(text).y0 for text in head)
    panels = [place for place in figure.axes if place.name != "3d" and place.axison]
    assert all(place.get_tightbbox().y1 <= lowest for place in panels)
    for one, other in itertools.combinations([*head, *(place.title for place in panels)], 2):
        assert not box_of(one).overlaps(box_of(other)), (one.get_text(), other.get_text())


@pytest.mark.parametrize("shape", SHAPES)
def test_everything_is_inside_the_picture(shape: str) -> None:
    figure = drawn(shape)
    texts = [*figure.texts, *(text for found in ticks_of(figure) for text in found)]
    texts += [text for place in figure.axes for text in (place.xaxis.label, place.yaxis.label, place.title)]
    for text in texts:
        if text.get_text() and text.axes is not None and text.axes.name == "3d":
            continue
        box = text.get_window_extent()
        # One point for rounding.
        assert box.width == 0 or (box.x0 >= -1 and box.x1 <= figure.bbox.x1 + 1), text.get_text()
        assert box.height == 0 or (box.y0 >= -1 and box.y1 <= figure.bbox.y1 + 1), text.get_text()


@pytest.mark.parametrize("shape", [shape for shape in SHAPES if "map" in shape or shape == "panels"])
def test_numbers_fit_into_their_cells(shape: str) -> None:
    figure = drawn(shape)
    check_numbers_fit(figure)


def check_numbers_fit(figure: Figure) -> None:
    for place in figure.axes:
        for numbers in place.collections:
            if isinstance(numbers, PathCollection):
                cell = place.transData.transform((1, 1)) - place.transData.transform((0, 0))
                widest = max(np.ptp(path.vertices[:, 0]) for path in numbers.get_paths())
                assert widest * figure.dpi / 72 < 0.98 * cell[0]


def written(figure: Figure) -> dict[tuple[int, int], list[bytes]]:
    """Return the outlines of the texts in each cell of the only map."""
    (place,) = (axes for axes in figure.axes if axes.images)
    found: dict[tuple[int, int], list[bytes]] = {}
    for collection in place.collections:
        assert isinstance(collection, PathCollection)
        for (x, y), path in zip(np.asarray(collection.get_offsets()), collection.get_paths(), strict=True):
            found.setdefault((round(x), round(y)), []).append(path.vertices.tobytes())
    return found


def outlines(*texts: str) -> list[bytes]:
    """Return how mean, half width and number of runs are written in a small map."""
    return [outline(text, size).vertices.tobytes() for text, size in zip(texts, (11.0, 8.8, 7.4), strict=False) if text]


@pytest.mark.short
def test_a_cell_shows_mean_half_width_and_runs() -> None:
    study = Study(axes={"robots": [2, 4, 8], "radius": [1.0, 2.0, 3.0]}, replicates=6)
    found = results(study, share=0.6)
    cells = written(found.plot(kind="heat-map"))
    summary = found.summary()
    assert summary["n"].nunique() > 1
    for row in summary.to_dict("records"):
        place = [2, 4, 8].index(row["robots"]), [1.0, 2.0, 3.0].index(row["radius"])
        wide = f"±{50 * (row['high'] - row['low']):.0f}" if row["n"] > 1 else ""
        wanted = outlines(f"{100 * row['mean']:.0f}", wide, f"n {row['n']}") if row["n"] else []
        assert cells.get(place, []) == wanted


@pytest.mark.short
def test_cells_whose_interval_includes_0_are_in_brackets() -> None:
    axes = {"robots": [2, 4, 8], "radius": [1.0, 2.0, 3.0]}
    found, base = (
        results(Study(fixed={"policy": policy}, axes=axes, replicates=5), lambda p, r: r.random() / 2 + gain(p, r))
        for policy in ("evolved", "centroid")
    )
    figure = found.plot(minus=base, kind="heat-map")
    cells = written(figure)
    differences = 100 * (found.frame["observed_fraction"].to_numpy() - base.frame["observed_fraction"].to_numpy())
    table = found.frame.assign(difference=differences)
    open_cells = 0
    for (robots, radius), values in table.groupby(["robots", "radius"])["difference"]:
        # Student's quantile for five runs.
        is_open = abs(values.mean()) <= 2.7764451 * values.sem()
        open_cells += is_open
        place = [2, 4, 8].index(robots), [1.0, 2.0, 3.0].index(radius)
        text = f"{values.mean():+.0f}".replace("-", "−")
        assert cells[place][0] == outlines(f"({text})" if is_open else text)[0]
    assert 0 < open_cells < 9
    assert f"{open_cells} of 9 intervals include 0 (in brackets)" in words(figure)


def gain(parameters: Any, rng: np.random.Generator) -> float:
    """Return a gain of the policy 'evolved' that noise hides in all but large teams."""
    extra = rng.normal(0, 0.05)
    return float(extra + 0.03 * parameters["robots"]) if parameters["policy"] == "evolved" else 0.0


@pytest.mark.short
@pytest.mark.parametrize("shape", ["one setting", "numbers", "small map", "distributions", "scatter", "panels"])
def test_a_partial_study_is_marked(shape: str) -> None:
    axes, how = SHAPES[shape]
    study = Study(axes=axes, replicates=8)
    found = results(study, share=0.5)
    warning = f"partial: {found.done} of {found.planned:,} runs"
    assert 0 < found.done < found.planned
    assert warning in words(found.plot(**how))
    assert "partial" not in words(results(study).plot(**how))


def test_settings_without_runs_are_gaps() -> None:
    found = results(Study(axes={"robots": [1, 2, 3, 4, 5, 6]}, replicates=2), share=0.4, seed=2)
    absent = found.summary()["n"].to_numpy() == 0
    assert 0 < absent.sum() < 6
    (line,) = found.plot().axes[0].lines
    assert np.array_equal(np.isnan(np.asarray(line.get_ydata(), float)), absent)


def test_lines_show_means_and_bands_of_each_level() -> None:
    found = results(Study(axes={"robots": [1, 2, 5], "policy": POLICIES}, replicates=4))
    axes = found.plot().axes[0]
    summary = found.summary().set_index(["policy", "robots"])
    assert [line.get_label() for line in axes.lines] == POLICIES
    for line, band in zip(axes.lines, axes.collections, strict=True):
        rows = summary.loc[str(line.get_label())]
        assert np.asarray(line.get_ydata(), float) == pytest.approx(100 * rows["mean"].to_numpy())
        corners = {(float(x), round(float(y), 6)) for x, y in band.get_paths()[0].vertices}
        for robots, row in rows.iterrows():
            assert {(robots, round(100 * row["low"], 6)), (robots, round(100 * row["high"], 6))} <= corners


def test_a_line_has_a_gap_where_a_grid_has_no_setting() -> None:
    points = {"robots": [2, 4, 8, 2, 8], "radius": [1.0, 1.0, 1.0, 3.0, 3.0]}
    figure = results(Study(points=points, replicates=2)).plot(kind="lines", x="robots", y="radius")
    whole, broken = (np.isnan(np.asarray(line.get_ydata(), float)).tolist() for line in figure.axes[0].lines)
    assert whole == [False] * 3
    assert broken == [False, True, False]


def test_a_few_wide_intervals_do_not_flatten_the_rest() -> None:
    far = itertools.cycle([0.2, 0.8])
    study = Study(axes={"robots": list(range(1, 9))}, replicates=2)
    found = results(
        study, lambda p, r: next(far) if p["robots"] == 3 else 0.5 + 0.01 * p["robots"] + r.uniform(0, 1e-3)
    )
    for kind in ("lines", "scatter"):
        figure = found.plot(kind=kind)
        low, high = figure.axes[0].get_ylim()
        means = 100 * found.summary()["mean"]
        assert low < means.min() <= means.max() < high < low + 40
        assert "1 of 8 intervals cut off at the edge" in words(figure)
    assert "cut off" not in words(results(Study(axes={"robots": [1, 2, 3]}, replicates=30)).plot())


def test_bars_of_rates_end_where_the_intervals_end() -> None:
    study = Study(axes={"policy": POLICIES}, replicates=8)
    made = results(study, lambda p, r: 1.0 if p["policy"] == "a-cmommt" else float(r.random() < 0.6))
    table = made._folder.read("runs")
    hit = pa.compute.greater(table["observed_fraction"], 0.5)
    found = type(made)(made._folder, study, table.append_column("hit", hit), pa.table({}))
    figure = found.plot(measure="hit")
    (bars,) = (one for one in figure.axes[0].collections if isinstance(one, LineCollection))
    ends = [sorted(segment[:, 1].tolist()) for segment in bars.get_segments()]
    summary = found.summary("hit")
    assert ends == [pytest.approx([row["low"], row["high"]]) for row in summary.to_dict("records")]
    assert summary["mean"].iloc[0] == summary["high"].iloc[0] == 1.0
    assert 0 < summary["low"].iloc[0] < 1
    low, high = figure.axes[0].get_ylim()
    assert low < summary["low"].min() <= summary["high"].max() < high


@pytest.mark.short
@pytest.mark.parametrize(
    ("wide", "decimals", "text"),
    [(0.19, 0, "0.2"), (0.04, 0, "<0.1"), (1.2, 0, "1"), (0.006, 1, "0.01"), (0.0, 0, "0"), (1e-15, 1, "0.0")],
)  # fmt: skip
def test_a_half_width_that_is_not_0_is_not_written_as_0(wide: float, decimals: int, text: str) -> None:
    quantity = Quantity("loss", decimals=decimals)
    assert quantity.write_width(wide, 99.0) == text
    # The mean has the decimals of its half width.
    decimals_of = len(text.partition(".")[2])
    assert quantity.finer(wide, 99.87).write(99.87) == f"{99.87:.{decimals_of}f}"
    assert quantity.finer(np.inf, 1.0) == quantity.finer(np.nan, 1.0) == quantity


def test_long_numbers_fit_into_their_cells() -> None:
    study = Study(axes={"robots": MANY, "radius": [1.0, 2.0, 3.0]}, replicates=3)
    figure = results(study, lambda p, r: 1234 + r.uniform(0, 1e-3)).plot()
    check_numbers_fit(figure)


def test_a_long_head_is_wrapped() -> None:
    fixed = {
        "policy": "my_package.policies:Follow_the_nearest_target_with_care",
        "targets": 15,
        "awareness": "pairwise",
    }
    study = Study(
        fixed=fixed, axes={"robots": [1, 2, 3]}, replicates=2, name="a study with a name that is rather long " * 3
    )
    figure = results(study).plot(minus=results(study))
    FigureCanvasAgg(figure).draw()
    boxes = [text.get_window_extent() for text in figure.texts]
    assert len(boxes) > 4
    assert all(box.x1 < figure.bbox.x1 for box in boxes)


def test_logarithmic_axes_have_a_logarithmic_scale() -> None:
    assert drawn("logarithmic").axes[0].get_xscale() == "log"


def test_a_huge_map_shows_half_widths_beside_means() -> None:
    figure = drawn("huge map")
    means, wide = (axes for axes in figure.axes if axes.images)
    assert not [c for c in means.collections if isinstance(c, PathCollection)]
    assert means.images[0].get_array().shape == wide.images[0].get_array().shape == (70, 80)
    assert "median" in words(figure)


@pytest.mark.short
@pytest.mark.parametrize(
    ("mean", "wide", "decimals"),
    [([42.0], [13.0], 0), ([42.0], [1.3], 1), ([42.0], [0.05], 2), ([3.0, 4.0], [np.inf] * 2, 0), ([28.81], [np.inf], 1),
     ([0.0123], [np.inf], 4), ([5.0], [0.0], 0), ([], [], 0)],
)  # fmt: skip
def test_decimals_are_those_that_intervals_justify(mean: list[float], wide: list[float], decimals: int) -> None:
    assert Quantity("loss").fitted(np.array(mean), np.array(wide)).decimals == decimals


@pytest.mark.short
def test_fractions_are_in_percent_and_differences_in_points() -> None:
    assert Quantity("observed_fraction").label == "observed fraction  [%]"
    assert Quantity("observed_fraction", True).label == "difference  [percentage points]"
    assert Quantity("max_neighbours").label == "max neighbours"
    assert [Quantity("x", True, 1).write(value) for value in (1.25, -1.25, 0.01, -0.01)] == [
        "+1.2",
        "−1.2",
        "0.0",
        "0.0",
    ]


def test_frames_are_not_changed() -> None:
    found = results(Study(axes={"robots": [1, 2], "policy": POLICIES}, replicates=2))
    before = found.frame.copy()
    found.plot()
    pd.testing.assert_frame_equal(found.frame, before)
