"""The same study through Dask gives the same table, also if a worker is killed in the middle."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from teamsight.analysis.runs.dask import DaskExecutor
from teamsight.analysis.studies import sweep as sweeping
from teamsight.analysis.studies.study import Record
from teamsight.analysis.studies.sweep import sweep
from tests.analysis.runs.time_limit import time_limit as time_limit
from tests.analysis.studies.folders import same_rows, small

pytest.importorskip("distributed")
sys.path.insert(0, str(Path(__file__).parents[1] / "runs"))
import dask_cluster


@pytest.mark.rare
def test_a_sweep_on_a_cluster_of_which_a_worker_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeping, "_MOST_RUNS", 3)
    study = small(replicates=10, record=Record(steps=True))
    killed: list[int] = []
    with dask_cluster.cluster(tmp_path) as cluster, DaskExecutor(cluster.scheduler) as executor:
        executor._client.wait_for_workers(2, timeout=dask_cluster.PATIENCE)
        processes = list(executor._client.run(os.getpid).values())

        def kill(done: int, total: int, seconds_left: float | None) -> None:
            if done >= 6 and not killed:
                killed.append(processes[0])
                os.kill(processes[0], signal.SIGKILL)

        summary = sweep(study, tmp_path / "out", executor=executor, progress=kill)
    assert killed
    assert (summary.made, summary.done, summary.missing) == (40, 40, 0)
    sweep(study, tmp_path / "whole")
    for kind in ("runs", "steps"):
        same_rows(tmp_path / "out", tmp_path / "whole", kind)
    assert '"engine": "dask"' in (tmp_path / "out" / "sweeps.jsonl").read_text()
