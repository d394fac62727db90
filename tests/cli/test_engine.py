"""Commands that make runs make them on a Dask cluster too, with the same results."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from teamsight.cli.delta import DeltaSettings
from teamsight.cli.main import main

LocalCluster = pytest.importorskip("distributed").LocalCluster


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    return int(left.value.code or 0)


@pytest.fixture
def scheduler() -> Iterator[str]:
    """The address of a cluster in this process: tests/analysis/runs has one of processes."""
    with LocalCluster(processes=False, protocol="tcp://", n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster.scheduler_address


def test_a_cluster_gives_the_same_results_as_this_machine(tmp_path: Path, scheduler: str) -> None:
    found = []
    for engine in (("--workers", "1"), ("--engine", "dask", "--scheduler", scheduler)):
        out = tmp_path / engine[1]
        line = ("--robots", "4", "--targets", "3", "--runs", "12", "--steps", "20", "--out", str(out))
        assert call("delta", *line, *engine) == 0
        found.append({file.name: pd.read_parquet(file) for file in sorted(out.glob("*.parquet"))})
    local, dask = found
    assert len(local) > 2
    assert local.keys() == dask.keys()
    for name, table in local.items():
        pd.testing.assert_frame_equal(table, dask[name])
        assert table.attrs == dask[name].attrs


def test_without_a_scheduler_the_cluster_is_on_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("teamsight.analysis.runs.dask.DaskExecutor", lambda *given: contextlib.nullcontext(given))
    with DeltaSettings.read({"engine": "dask", "workers": "3"}, {}).executor() as executor:
        assert executor == (None, 3)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (("delta", "--scheduler", "tcp://127.0.0.1:1"), "scheduler=tcp://127.0.0.1:1: is for Dask; give --engine dask"),
        (
            ("reproduce", "tan1993", "--engine", "dask", "--scheduler", "tcp://127.0.0.1:1", "--workers", "2"),
            "workers=2: the scheduler has its own workers",
        ),
        (("learn", "figure", "--engine", "dask", "--scheduler", "here"), "scheduler='here': must be an address such as"),
    ],
)
def test_options_of_a_cluster_that_do_not_fit_are_refused(
    capsys: pytest.CaptureFixture[str], line: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call(*line) == 2
    assert message in capsys.readouterr().err


def test_machines_that_share_a_folder_share_the_runs_of_a_paper(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    line = ("reproduce", "2", "8", "--quick", "--runs", "1", "--steps", "2", "--workers", "1", "--out")
    assert call(*line, str(tmp_path / "whole")) == 0
    capsys.readouterr()
    shared = tmp_path / "shared"
    assert call(*line, str(shared), "--shard", "2/2") == 0
    assert capsys.readouterr().out.startswith("shard 2/2 is made; ")
    assert not list(shared.glob("*.parquet"))
    # The last shard finds what the others have kept, and writes the results.
    assert call(*line, str(shared), "--shard", "1/2") == 0
    whole = {file.name: file.read_bytes() for file in (tmp_path / "whole").iterdir()}
    assert {file.name: file.read_bytes() for file in shared.iterdir()} == whole
