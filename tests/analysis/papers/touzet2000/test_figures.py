"""Figures hold every run with its seed, and show the numbers of their tables."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from teamsight.analysis.papers.touzet2000 import Touzet
from teamsight.analysis.papers.touzet2000.experiments import DELTAS
from teamsight.analysis.papers.touzet2000.figures import FIGURES, pictures
from teamsight.analysis.runs.experiment import Tables
from teamsight.analysis.runs.grid import Grid

PLAN = Touzet(runs=3, steps=20, seed=1, preset="defaults")
SMALL = Grid((1, 2, 30), (1.0, 5.0))


def runs(gain: float = 0.0, delta: tuple[int, ...] = (), replicates: int = 3) -> pd.DataFrame:
    rows = [
        {"robots": n, "targets": 15, "radius": r, **({"delta": d} if d else {}), "replicate": k, "seed": 100 * n + k}
        | {"exploration": 1000 + k}
        | {"observed_fraction": 0.3 + gain * (n == 30) + 0.01 * k, "max_neighbours": n - 1 - (k == 0 and n > 1)}
        for n, r in SMALL.cells
        for d in (delta or (0,))
        for k in range(replicates)
    ]
    return pd.DataFrame(rows)


def tables_for(name: str, replicates: int = 3) -> Tables:
    gains = {"a-cmommt": 0.4, "delta-pairwise": 0.4, "slopes-cooperative": 0.4}
    return {
        need: runs(gains.get(need, 0.0), DELTAS if need == "delta-ring" else (), replicates)
        for need in FIGURES[name].needs
    }


def test_all_figures_of_the_paper_are_there() -> None:
    numbers = [int(name) for name in FIGURES if name.isdigit()]
    assert numbers == sorted(numbers)
    assert {*range(2, 12)} <= {*numbers}


@pytest.mark.parametrize("replicates", [1, 3])
@pytest.mark.parametrize("name", ["2", "4", "6", "8", "10", "11", "delta"])
def test_a_figure_is_a_table_and_a_picture(name: str, replicates: int) -> None:
    tables = FIGURES[name].tabulate(tables_for(name, replicates), PLAN)
    picture = imread(io.BytesIO(pictures((name, tables, PLAN, ("png",)))["png"]))
    assert picture.shape[1] > 800
    assert np.ptp(picture[..., :3]) > 0.5
    if name != "2":
        assert {"robots", "radius", "replicate", "seed"} <= set(tables[""].columns)
        assert len(tables[""]) >= len(SMALL.cells) * replicates


@pytest.mark.parametrize(("name", "contrasts"), [("8", 1), ("10", 2)])
def test_differences_are_paired_and_carry_intervals(name: str, contrasts: int) -> None:
    cells = FIGURES[name].tabulate(tables_for(name), PLAN)["cells"]
    assert len(cells) == contrasts * len(SMALL.cells)
    assert cells["mean"].to_numpy() == pytest.approx(np.where(cells["robots"] == 30, 0.4, 0.0))
    # The noise is common to both, so that nothing of it is left in the difference.
    assert (cells["high"] - cells["low"]).to_numpy() == pytest.approx(0, abs=1e-12)


def learned(gain: float, of_first: float = 0.0) -> pd.DataFrame:
    """Runs of a learned team, each of another exploration, of which the first gains more."""
    found = runs(gain)
    more = np.where(found["replicate"] == 0, of_first, 0.0)
    return found.assign(observed_fraction=found["observed_fraction"] + more)


def figure_11() -> tuple[Tables, Tables]:
    """Tables that figure 11 reads and makes; only the team with slopes gains, 40 points for 30 robots."""
    given = dict.fromkeys(FIGURES["11"].needs, learned(0.0)) | {"slopes-cooperative": learned(0.4, of_first=0.03)}
    return given, FIGURES["11"].tabulate(given, PLAN)


def test_figure_11_has_one_row_a_run_with_the_seed_of_its_exploration() -> None:
    _, made = figure_11()
    assert len(made[""]) == 2 * 3 * len(SMALL.cells)
    assert (made[""]["exploration"] == 1000 + made[""]["replicate"]).all()
    slopes = made["explorations"].query("variant == 'slopes'")
    # A third of the cells, those of 30 robots, gain.
    assert slopes["difference"].to_numpy() == pytest.approx([0.4 / 3 + 0.03, 0.4 / 3, 0.4 / 3])
    assert slopes["exploration"].tolist() == [1000, 1001, 1002]


def test_figure_11_is_summarised_with_its_interval_and_range() -> None:
    _, made = figure_11()
    summarise = FIGURES["11"].summarise
    assert summarise is not None
    line = summarise(made)
    # 13.3, 13.3 and 16.3 points: 14.3 ± 4.303 × 1.
    for part in (
        "over 3 explorations",
        "+0.0 pp on average over all cells",
        "+14.3 pp on average over all cells (95 % interval +10.0 to +18.6), single explorations +13.3 to +16.3",
        "largest +41.0 pp at N = 30, R = 1",
    ):
        assert part in line


def test_both_surfaces_of_figure_11_are_drawn_on_one_scale_like_their_maps() -> None:
    figure = FIGURES["11"].draw(figure_11()[1], PLAN)
    solids = [axes for axes in figure.axes if axes.name == "3d"]
    maps = [axes.images[0].norm for axes in figure.axes if axes.images]
    assert [axes.get_zlim() for axes in solids] == [(0, 45), (0, 45)]
    assert [(norm.vmin, norm.vmax) for norm in maps] == [(-45, 45), (-45, 45)]
    # Of the colours, those that the cells have; the first have that of 0 alone.
    bars = [axes.get_ylim() for axes in figure.axes if axes.name != "3d" and axes.get_ylabel().startswith("gain")]
    assert bars == [pytest.approx((0, 45)), pytest.approx((0, 41))]
    text = " ".join(" ".join(text.get_text().split()) for text in figure.texts)
    for part in (
        "a) lazy Q-learning",
        "reward own",
        "b) slopes",
        "reward team",
        "standard error of a cell up to 1.0 pp",
    ):
        assert part in text


@pytest.mark.parametrize("name", ["6", "7"])
def test_observed_targets_carry_intervals(name: str) -> None:
    noise = {1.0: 0.01, 5.0: 0.03}
    table = runs().assign(observed_fraction=lambda rows: 0.3 + rows["radius"].map(noise) * (rows["replicate"] - 1))
    tables = FIGURES[name].tabulate({FIGURES[name].needs[0]: table}, PLAN)
    # Three runs at −1, 0 and 1 times the noise: its standard error is noise / √3, and Student's factor 4.303.
    half = tables["cells"].groupby("radius")["high"].max() - 0.3
    assert half.to_dict() == pytest.approx({radius: 4.3027 * one / 3**0.5 for radius, one in noise.items()}, rel=1e-4)
    figure = FIGURES[name].draw(tables, PLAN)
    assert [line.get_label() for line in figure.axes[-1].lines] == ["R = 1", "R = 5"]


def test_figures_4_and_5_can_be_compared() -> None:
    tables = {"4": {"random-walk": runs()}, "5": {"a-cmommt": runs().assign(max_neighbours=1)}}
    drawn = [FIGURES[name].draw(FIGURES[name].tabulate(tables[name], PLAN), PLAN) for name in ("4", "5")]
    for figure in drawn:
        solid, flat, _, curves = figure.axes
        assert solid.get_zlim() == (flat.images[0].norm.vmin, flat.images[0].norm.vmax) == (0, 29)
        assert f"of each cell the maximum over {PLAN.runs} runs" in figure.texts[1].get_text()
        assert "95 % confidence interval of the mean" in curves.get_title(loc="left")
    table = FIGURES["4"].tabulate({"random-walk": runs()}, PLAN)["cells"]
    most = runs().groupby(["robots", "radius"])["max_neighbours"].mean()
    assert table.set_index(["robots", "radius"])["mean"].to_dict() == most.to_dict()


def test_no_text_of_a_figure_leaves_it_or_runs_into_a_heat_map() -> None:
    for name in ("8", "10", "11"):
        figure = FIGURES[name].draw(FIGURES[name].tabulate(tables_for(name), PLAN), PLAN)
        FigureCanvasAgg(figure).draw()
        flat = [axes.get_window_extent() for axes in figure.axes if axes.images]
        for text in figure.texts:
            box = text.get_window_extent()
            assert box.x1 < figure.bbox.x1
            assert not any(box.overlaps(other) for other in flat), text.get_text()


def test_the_delta_figure_has_one_range_and_the_smallest_sufficient_delta_in_its_title() -> None:
    cells = [(10, 2.0), (20, 5.0)]
    ring = {1: (0.5, 0.6), 2: (0.795, 0.9), 3: (0.7, 0.9), 4: (0.79, 0.895), 8: (0.8, 0.9)}
    values = {"delta-none": {0: (0.3, 0.2)}, "delta-ring": ring, "delta-pairwise": {0: (0.8, 0.9)}}
    tables = {
        name: pd.DataFrame(
            {"robots": n, "radius": r, "targets": 15, "delta": delta, "replicate": k, "seed": k, "max_neighbours": 3}
            | {"observed_fraction": mean + 0.01 * (k - 1)}
            for delta, means in of.items()
            for (n, r), mean in zip(cells, means, strict=True)
            for k in range(3)
        )
        for name, of in values.items()
    }
    figure = FIGURES["delta"].draw(FIGURES["delta"].tabulate(tables, PLAN), PLAN)
    # 2 sectors are enough but 3 are not: from 4 on all are.
    assert figure.get_label().endswith(": 4 sectors are as good as Θ(N), to 1 point on average")
    low, high = figure.axes[0].get_ylim()
    assert (low, high) == figure.axes[1].get_ylim()
    assert low < 20 < 90 < high
    tables["delta-ring"]["observed_fraction"] -= 0.1
    worse = FIGURES["delta"].draw(FIGURES["delta"].tabulate(tables, PLAN), PLAN)
    assert worse.get_label().endswith("no ring of up to 8 sectors is as good as Θ(N)")


def test_the_delta_figure_has_both_limits_and_every_delta() -> None:
    found = FIGURES["delta"].tabulate(tables_for("delta"), PLAN)[""]
    assert set(found["awareness"]) == {"none", "ring", "pairwise"}
    assert set(found.loc[found["awareness"] == "ring", "delta"]) == set(DELTAS)
