"""Choosing δ by simulation, on a model whose exceedance is known."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.delta import choose
from teamsight.analysis.delta.choose import DeltaReport

sys.path.insert(0, str(Path(__file__).parent))  # the suite is imported by file, so helpers are found by path
from snapshots import Snapshots


@pytest.fixture(scope="module")
def report() -> DeltaReport:
    return choose.choose_delta(Snapshots, runs=300, steps=12, risk=0.05)


def test_delta_is_read_from_the_maxima(report: DeltaReport) -> None:
    maxima = report.maxima["max_neighbours"]
    assert report.largest == maxima.max()
    assert report.trials == len(maxima) == 300
    assert (maxima > report.delta).mean() <= 0.05 < (maxima > report.delta - 1).mean()
    assert report.delta_low <= report.delta <= report.delta_safe <= report.largest
    assert report.supported
    assert report.trials_needed == 59


def test_simulation_and_closed_form_agree_where_the_form_is_exact(report: DeltaReport) -> None:
    assert report.predicted_delta is not None
    assert report.prediction is not None
    # The form counts the robots of a snapshot as independent, which raises it: never more than one apart.
    assert abs(report.predicted_delta - report.delta) <= 1
    assert report.predicted_maximum == pytest.approx(report.maxima["max_neighbours"].mean(), abs=0.6)


def test_a_ring_shows_what_the_occupancy_formula_says(report: DeltaReport) -> None:
    met = report.ring[report.ring["samples"] > 300]
    assert len(met)
    # Thrown anew each step with headings at random: six standard errors of 300 samples.
    assert met["shown"].to_numpy() == pytest.approx(met["expected"].to_numpy(), abs=6 * 0.8 / np.sqrt(300))
    assert set(report.ring["sectors"]) == {report.delta, report.delta_safe, 16}


def test_cost_compares_the_degrees(report: DeltaReport) -> None:
    cost = report.cost.set_index(["degree", "delta"])
    assert cost.loc[("pairwise", pd.NA), "inputs"].item() == 16 + 2 * 8
    assert cost.loc[("pairwise", pd.NA), "added_here"].item() == 2 * 7
    assert cost.loc[("ring", report.delta), "inputs"] == 16 + report.delta
    assert cost.loc[("shared", pd.NA), "added_here"].item() == 16 * 7


def test_every_run_can_be_repeated_from_its_seed() -> None:
    found = choose.choose_delta(Snapshots, runs=3, steps=5, rng=7)
    again = choose.choose_delta(Snapshots, runs=5, steps=5, rng=7)
    pd.testing.assert_frame_equal(found.maxima, again.maxima.head(3))
    world = Snapshots(int(found.maxima["seed"][2]))
    world.run(5)
    assert world.max_neighbours == found.maxima["max_neighbours"][2]
    assert found.maxima["seed"].is_unique


def test_without_a_seed_results_differ() -> None:
    one, other = (choose.choose_delta(Snapshots, runs=1, steps=1).maxima["seed"][0] for _ in range(2))
    assert one != other


def test_progress_and_closing() -> None:
    Snapshots.opened = Snapshots.closed = 0
    seen: list[tuple[int, int]] = []
    choose.choose_delta(Snapshots, runs=3, steps=2, progress=lambda done, total: seen.append((done, total)))
    assert (seen, seen[0], seen[-1]) == (sorted(seen), (1, 3), (3, 3))
    assert Snapshots.opened == Snapshots.closed == 3


def test_too_few_runs_are_said_plainly() -> None:
    few = choose.choose_delta(Snapshots, runs=20, steps=3, risk=0.01, rng=1)
    assert not few.supported
    assert few.delta_safe == 7
    text = str(few)
    assert "cannot support a risk of 0.01" in text.replace("\n", " ")
    assert "299" in text
    first, *others = few.sentences()
    assert first.startswith(f"δ = {few.supported_delta} for a risk of 0.14, the smallest that so few runs support with 95%")
    # Once: neither for the other risk nor in other words.
    assert not [said for said in others if "δ = " in said and not said.startswith("Closed form")]
    single = choose.choose_delta(Snapshots, runs=1, steps=3, rng=1).sentences()[0]
    assert single.startswith("This simulation is one observation, 1 run: its largest number of neighbours is ")
    enough = choose.choose_delta(Snapshots, runs=30, steps=3, risk=0.2, rng=1)
    assert enough.sentences()[0].startswith(f"δ = {enough.delta_safe} with 95% confidence: exceeded in at most 20 % of")


def test_a_lone_robot_needs_no_ring() -> None:
    alone = choose.choose_delta(partial(Snapshots, robots=1), runs=5, steps=2, risk=0.5)
    assert alone.delta == alone.delta_safe == alone.predicted_delta == 0
    assert "NoAwareness()" in str(alone)
    assert alone.to_markdown()
    assert alone.to_png().startswith(b"\x89PNG")


def test_saved_files_are_what_the_report_holds(report: DeltaReport, tmp_path: Path) -> None:
    files = {path.name for path in report.save(tmp_path / "new")}
    assert files == {path.name for path in (tmp_path / "new").iterdir()}
    saved = pd.read_parquet(tmp_path / "new" / "delta_exceedance.parquet")
    pd.testing.assert_frame_equal(saved, report.exceedance)
    assert saved.attrs["risk"] == 0.05
    mark, _, page = (tmp_path / "new" / "delta.md").read_text().partition("\n")
    assert (mark.startswith("<!-- written by teamsight"), page) == (True, report.to_markdown())
    assert (tmp_path / "new" / "delta_exceedance.png").read_bytes().startswith(b"\x89PNG")


def test_markdown_tables_are_rectangular(report: DeltaReport) -> None:
    blocks = [block.splitlines() for block in report.to_markdown().split("\n\n") if block.startswith("|")]
    assert len(blocks) == 3
    for block in blocks:
        assert len({line.count("|") for line in block}) == 1


def test_an_unwritable_folder_is_named(report: DeltaReport, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"file.*cannot be written"):
        report.save(tmp_path / "file")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"risk": 0.0}, "risk=0"),
        ({"risk": 1.5}, "risk=1.5"),
        ({"runs": 0}, "runs=0"),
        ({"steps": 0}, "steps=0"),
        ({"confidence": 1.0}, "confidence=1"),
        ({"rng": -1}, "rng=-1"),
    ],
)
def test_bad_numbers_are_named(given: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        choose.choose_delta(Snapshots, **given)


def test_a_model_that_is_none_is_refused() -> None:
    with pytest.raises(TypeError, match="model=3"):
        choose.choose_delta(3, runs=1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"runs": 10**12}, "runs=1000000000000: must be at most 1000000; give fewer"),
        ({"steps": 10**12}, "steps=1000000000000: must be at most 10000000; make more runs"),
        ({"risk": 1e-300}, r"risk=1e-300: needs 1.0e.301 runs, at most 1000000; give a risk of at least 1e-05, or"),
    ],
)
def test_what_would_run_for_ever_is_refused(given: dict[str, Any], message: str) -> None:
    def never(seed: int) -> Any:
        raise AssertionError("a world was made")

    with pytest.raises(ValueError, match=message):
        choose.choose_delta(never, **given)
