"""Sweeps on worker processes: the same rows, also if workers are killed, or runs end them."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from teamsight.analysis.studies import sweep as sweeping
from teamsight.analysis.studies.sweep import sweep
from tests.analysis.runs.time_limit import time_limit as time_limit
from tests.analysis.studies.folders import odd, rows, same_rows


@pytest.fixture(autouse=True)
def _path_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))


def test_a_killed_worker_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One worker is killed from outside, and two runs end their process once."""
    monkeypatch.setattr(sweeping, "_MOST_RUNS", 4)
    marks = tmp_path / "marks"
    marks.mkdir()
    study = odd("dying_once", axes={"robots": [2, 4, 5, 6, 7, 8, 9, 3]}, replicates=2, fixed={"folder": str(marks)})
    killed: list[int] = []

    def kill(done: int, total: int, seconds_left: float | None) -> None:
        from multiprocessing import active_children

        if done >= 4 and not killed:
            killed.extend(child.pid for child in active_children()[:1] if child.pid)
            os.kill(killed[0], signal.SIGKILL)

    summary = sweep(study, tmp_path / "out", workers=2, progress=kill)
    assert len(killed) == 1
    assert len(list(marks.iterdir())) == 2
    assert (summary.done, summary.failed, summary.missing) == (16, 0, 0)
    sweep(study, tmp_path / "whole")
    same_rows(tmp_path / "out", tmp_path / "whole")


def test_a_run_that_leaves_the_program_fails_on_workers_as_in_this_process(tmp_path: Path) -> None:
    study = odd("leaving", axes={"robots": [3, 2]})
    summary = sweep(study, tmp_path / "workers", workers=2)
    assert (summary.done, summary.failed) == (1, 1)
    sweep(study, tmp_path / "alone")
    for kind in ("runs", "failed"):
        same_rows(tmp_path / "workers", tmp_path / "alone", kind)


@pytest.mark.rare
def test_one_run_of_fifty_always_ends_its_process(tmp_path: Path) -> None:
    study = odd("crashing", points={"robots": [9, *([2, 3, 4, 5, 6, 7, 8] * 7)], "radius": [4.0 + k / 100 for k in range(50)]})
    summary = sweep(study, tmp_path / "out", workers=2)
    assert (summary.done, summary.failed, summary.missing) == (49, 1, 0)
    failed = rows(tmp_path / "out", "failed").iloc[0]
    assert (failed["robots"], failed["error"]) == (9, "3 workers ended with exit code 7")
    assert 9 not in set(rows(tmp_path / "out")["robots"])
