"""The score of a candidate, the rows that are made of it, and the files that a search leaves."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.calibration import calibrate, model, model_page
from teamsight.analysis.calibration.search import Candidate, Phase, Simulator, assess, ranking, score
from teamsight.analysis.paper.claims import CLAIMS, Verdict
from teamsight.analysis.paper.experiments import chosen
from teamsight.analysis.runs.experiment import Grid, Request
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run

SMALL = Grid((2, 30), (1.0, 2.0))
PHASE = Phase("try", SMALL, (-7, -8), {"neighbours-random": CLAIMS["neighbours-random"]}, runs=1, steps=3)


def prepare(speed: float, phase: Phase) -> Candidate:
    setting = {"robot_speed": speed}
    return Candidate(setting, Request(setting, chosen(["random-walk"], phase.grid, setting)))


def test_one_claim_that_is_far_off_does_not_outweigh_all_others() -> None:
    near, far = Verdict(False, "", 2.0), Verdict(False, "", 1e9)
    holds = Verdict(True, "", 0.5)
    assert score({"a": holds, "b": far})[1] < score({"a": near, "b": far})[1] < 5
    assert score({"a": holds, "b": near}) == (1, 1.25)


def test_every_candidate_is_judged_on_every_root_whoever_does_it() -> None:
    speeds = [0.1, 0.2, 0.3]
    seen: list[tuple[str, float, float]] = []
    rows = assess(PHASE, speeds, prepare, Simulator(watch=lambda *done: seen.append(done)))
    assert [(row["robot_speed"], row["root"]) for row in rows] == [
        (speed, root) for speed in speeds for root in (-7, -8)
    ]
    assert {row["phase"] for row in rows} == {"try"}
    assert seen[-1] == ("try", 3, 3)
    assert [done for _, done, _ in seen] == sorted(done for _, done, _ in seen)
    with WorkerPool(2) as pool:
        assert assess(PHASE, speeds, prepare, Simulator(pool)) == rows
    # No candidate depends on those beside it.
    assert assess(PHASE, speeds[1:2], prepare) == rows[2:4]


def test_an_interrupted_search_continues_with_the_runs_that_it_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[pd.DataFrame] = []

    def search(simulator: Simulator) -> pd.DataFrame:
        made.append(pd.DataFrame(assess(PHASE, [0.1, 0.2], prepare, simulator)))
        if len(made) == 1:
            raise KeyboardInterrupt
        return made[-1]

    monkeypatch.setattr(model, "search", search)
    monkeypatch.setattr(model_page, "page", lambda table: "a page")
    with pytest.raises(KeyboardInterrupt):
        calibrate.calibrate(tmp_path)
    kept = calibrate.checkpoint_in(tmp_path)
    assert kept.count() == 2 * len(PHASE.roots) * len(SMALL.cells)
    monkeypatch.setattr(Run, "make", lambda *given: pytest.fail("made again"))
    files = calibrate.calibrate(tmp_path)
    pd.testing.assert_frame_equal(made[0], made[1], check_exact=True)
    assert sorted(tmp_path.iterdir()) == sorted(files)


def test_a_file_in_the_place_of_the_checkpoint_is_refused_before_the_search(tmp_path: Path) -> None:
    (tmp_path / "calibration.checkpoint").write_text("mine")
    with pytest.raises(ValueError, match=r"calibration\.checkpoint: holds something else; move it away"):
        calibrate.calibrate(tmp_path)


def test_of_equals_the_first_wins() -> None:
    table = pd.DataFrame({"name": ["b", "a", "c"], "holding": [1, 1, 2], "distance_from_paper": [0.5, 0.5, 3.0]})
    assert ranking(table, ["name"])["name"].tolist() == ["c", "b", "a"]


def test_no_root_seed_of_a_search_is_one_that_a_command_accepts() -> None:
    assert max(*model.SCREEN.roots, *model.FINAL.roots) < 0
