"""Figures hold every run with its seed, and show the numbers of their tables."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from teamsight.analysis.paper.experiments import DELTAS
from teamsight.analysis.paper.figures import FIGURES, Conditions, Job, Tables, make
from teamsight.analysis.runs.experiment import Grid

CONDITIONS = Conditions("defaults", {}, 1, 3, 20)
SMALL = Grid((1, 2, 30), (1.0, 5.0))


def runs(gain: float = 0.0, delta: tuple[int, ...] = (), replicates: int = 3) -> pd.DataFrame:
    rows = [
        {"robots": n, "targets": 15, "radius": r, **({"delta": d} if d else {}), "replicate": k, "seed": 100 * n + k}
        | {"observed_fraction": 0.3 + gain * (n == 30) + 0.01 * k, "max_neighbours": n - 1 - (k == 0 and n > 1)}
        for n, r in SMALL.cells
        for d in (delta or (0,))
        for k in range(replicates)
    ]
    return pd.DataFrame(rows)


def tables_for(name: str, replicates: int = 3) -> Tables:
    gains = {"a-cmommt": 0.4, "delta-pairwise": 0.4, "lazy-cooperative": 0.4}
    return {
        need: runs(gains.get(need, 0.0), DELTAS if need == "delta-ring" else (), replicates)
        for need in FIGURES[name].needs
    }


def test_all_figures_of_the_paper_are_there() -> None:
    numbers = [int(name) for name in FIGURES if name.isdigit()]
    assert numbers == sorted(numbers)
    assert {*range(2, 12)} <= {*numbers}
    assert all(figure.name == name for name, figure in FIGURES.items())


@pytest.mark.parametrize("replicates", [1, 3])
@pytest.mark.parametrize("name", ["2", "4", "6", "8", "10", "11", "delta"])
def test_a_figure_is_a_table_and_a_picture(name: str, replicates: int) -> None:
    drawn = make(Job(name, tables_for(name, replicates), CONDITIONS))
    picture = imread(io.BytesIO(drawn.png))
    assert picture.shape[1] > 800
    assert np.ptp(picture[..., :3]) > 0.5
    if name != "2":
        assert {"robots", "radius", "replicate", "seed"} <= set(drawn.tables[""].columns)
        assert len(drawn.tables[""]) >= len(SMALL.cells) * replicates


@pytest.mark.parametrize(("name", "contrasts"), [("8", 1), ("10", 2), ("11", 2)])
def test_differences_are_paired_and_carry_intervals(name: str, contrasts: int) -> None:
    drawn = make(Job(name, tables_for(name), CONDITIONS))
    cells = drawn.tables["cells"]
    assert len(cells) == contrasts * len(SMALL.cells)
    assert cells["mean"].to_numpy() == pytest.approx(np.where(cells["robots"] == 30, 0.4, 0.0))
    # The noise is common to both, so that nothing of it is left in the difference.
    assert (cells["high"] - cells["low"]).to_numpy() == pytest.approx(0, abs=1e-12)


def test_the_learned_gain_is_summarised_in_one_line() -> None:
    cells = make(Job("11", tables_for("11"), CONDITIONS)).tables["cells"]
    summarise = FIGURES["11"].summarise
    assert summarise is not None
    learned = cells["variant"] == "learned"
    # Cells: N = 1, 2, 30, each at R = 1 and 5.
    for name, values in (("mean", (-2, 1, 4, 0, 3, 9)), ("low", (-3, -1, 1, 0, 0, 8)), ("high", (-1, 3, 7, 0, 6, 10))):
        cells.loc[learned, name] = np.array(values) / 100
    line = summarise(cells)
    for part in (
        "+2.5 pp on average over 6 cells",
        "at most +9.0 at N = 30, R = 5",
        "positive in 2 cells, negative in 1",
    ):
        assert part in line
    assert "one run per cell" in summarise(make(Job("11", tables_for("11", 1), CONDITIONS)).tables["cells"])


def test_both_surfaces_of_figure_11_have_one_height_and_their_own_colours() -> None:
    tables = dict(tables_for("11")) | {"lazy-cooperative": runs(-0.03)}
    figure = FIGURES["11"].draw(FIGURES["11"].tabulate(tables, CONDITIONS), CONDITIONS)
    solids = [axes for axes in figure.axes if axes.name == "3d"]
    assert [axes.get_zlim() for axes in solids] == [(-10, 50)] * 2
    assert [axes.images[0].norm.vmax for axes in figure.axes if axes.images] == [10, 50]


def test_figures_4_and_5_can_be_compared() -> None:
    tables = {"4": {"random-walk": runs()}, "5": {"a-cmommt": runs().assign(max_neighbours=1)}}
    drawn = [FIGURES[name].draw(FIGURES[name].tabulate(tables[name], CONDITIONS), CONDITIONS) for name in ("4", "5")]
    for figure in drawn:
        solid, flat, _ = figure.axes
        assert solid.get_zlim() == (flat.images[0].norm.vmin, flat.images[0].norm.vmax) == (0, 29)


def test_no_text_of_a_figure_leaves_it_or_runs_into_a_heat_map() -> None:
    for name in ("8", "10", "11"):
        figure = FIGURES[name].draw(FIGURES[name].tabulate(tables_for(name), CONDITIONS), CONDITIONS)
        FigureCanvasAgg(figure).draw()
        flat = [axes.get_window_extent() for axes in figure.axes if axes.images]
        for text in figure.texts:
            box = text.get_window_extent()
            assert box.x1 < figure.bbox.x1
            assert not any(box.overlaps(other) for other in flat), text.get_text()


def test_the_delta_figure_has_both_limits_and_every_delta() -> None:
    found = make(Job("delta", tables_for("delta"), CONDITIONS)).tables[""]
    assert set(found["awareness"]) == {"none", "ring", "pairwise"}
    assert set(found.loc[found["awareness"] == "ring", "delta"]) == set(DELTAS)
