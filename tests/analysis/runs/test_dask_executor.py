"""Jobs on a Dask cluster end as in a pool of processes, also if workers die or the scheduler is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from teamsight.analysis.runs import dask as module
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.dask import DaskExecutor
from teamsight.analysis.runs.executor import ExecutorError, JobError, Outcome
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.study import Study
from teamsight.analysis.studies.sweep import sweep

pytest.importorskip("distributed")
sys.path.insert(0, str(Path(__file__).parent))
import dask_cluster
import jobs
from faults import runs_of
from time_limit import time_limit as time_limit

linux = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="looks at sockets as Linux shows them")


@pytest.fixture(scope="module")
def executor(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskExecutor]:
    """An executor on a scheduler and two worker processes, with TLS where openssl is there."""
    with (
        dask_cluster.cluster(tmp_path_factory.mktemp("cluster"), tls=True) as cluster,
        DaskExecutor(cluster.scheduler, **cluster.tls) as executor,
    ):
        executor._client.wait_for_workers(2, timeout=dask_cluster.PATIENCE)
        yield executor


@pytest.fixture(scope="module")
def local() -> Iterator[DaskExecutor]:
    """An executor with a cluster of its own."""
    with DaskExecutor(workers=2) as executor:
        yield executor


def values(outcomes: Iterator[Outcome]) -> list[Any]:
    """Return the results in the order of the jobs; all must be done."""
    found = sorted(outcomes, key=lambda outcome: outcome.index)
    assert [outcome.status for outcome in found] == ["done"] * len(found)
    return [outcome.value for outcome in found]


def test_the_cluster_uses_tls(executor: DaskExecutor) -> None:
    if dask_cluster.shutil.which("openssl"):
        assert executor._client.scheduler.address.startswith("tls://")


def test_jobs_are_made_by_two_other_processes(executor: DaskExecutor) -> None:
    executor._client.wait_for_workers(2, timeout=dask_cluster.PATIENCE)
    found = set(values(executor.outcomes(jobs.process_of, range(24))))
    assert len(found) == 2
    assert os.getpid() not in found


@pytest.mark.rare
def test_a_worker_killed_in_the_middle_changes_no_result(executor: DaskExecutor) -> None:
    processes = set(values(executor.outcomes(jobs.process_of, range(12))))
    found = []
    for outcome in executor.outcomes(jobs.slow, range(12)):
        found.append(outcome)
        if len(found) == 2:
            os.kill(processes.pop(), signal.SIGKILL)
    assert values(iter(found)) == [2 * number for number in range(12)]


@pytest.mark.rare
def test_a_job_that_ends_every_worker_has_died_and_all_others_are_done(local: DaskExecutor) -> None:
    found = sorted(local.outcomes(jobs.end, ["a", "b", "kill", "c", "d", "e"]))
    assert [(outcome.index, outcome.status) for outcome in found] == [
        (number, "died" if number == 2 else "done") for number in range(6)
    ]
    assert found[2].value == "3 workers of the cluster ended"


def test_a_job_that_fails_says_so_and_the_others_are_done(executor: DaskExecutor) -> None:
    found = sorted(executor.outcomes(jobs.fail_at_three, range(5)))
    assert [outcome.status for outcome in found] == ["done", "done", "done", "failed", "done"]
    text, trace = found[3].value
    assert text == "delta=0: a ring needs at least 1 sector"
    assert "in fail_at_three" in trace


@pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt])
def test_a_job_that_wants_to_end_its_process_fails(executor: DaskExecutor, error: type[BaseException]) -> None:
    ((index, status, (text, _)),) = executor.outcomes(jobs.leave, [error])
    assert (index, status, text) == (0, "failed", "away")


@pytest.mark.parametrize("kind", ["lambda", "odd"])
def test_a_result_that_cannot_be_sent_is_named(executor: DaskExecutor, kind: str) -> None:
    found = sorted(executor.outcomes(jobs.return_odd, ["plain", kind, "plain"]))
    assert [outcome.status for outcome in found] == ["done", "unsent", "done"]
    assert {"lambda": "lambda", "odd": "this is no odd thing"}[kind] in found[1].value


def test_a_job_that_cannot_be_sent_is_named(executor: DaskExecutor) -> None:
    found = sorted(executor.outcomes(jobs.echo, [b"a", lambda: b"b", b"c"]))  # type: ignore[list-item]
    assert [outcome.status for outcome in found] == ["done", "unsent", "done"]


def test_jobs_are_taken_only_when_workers_will_soon_need_them_and_cancelled_on_leaving(executor: DaskExecutor) -> None:
    taken: list[int] = []

    def endless() -> Iterator[int]:
        while True:
            taken.append(len(taken))
            yield taken[-1]

    outcomes = executor.outcomes(jobs.square, endless())
    for made in range(1, 10):
        next(outcomes)
        assert len(taken) <= made + 2 * executor.size
    outcomes.close()
    assert executor._client.futures == {}
    assert values(executor.outcomes(jobs.square, [3])) == [9]


def test_run_all_returns_the_same_on_a_cluster(executor: DaskExecutor) -> None:
    runs = [Run({"robots": robots, "targets": 3, "radius": 2.0}, seed, 20) for robots in (2, 3) for seed in range(3)]
    assert run_all(runs, executor) == run_all(runs)


@linux
def test_a_cluster_on_this_machine_listens_on_loopback_only(local: DaskExecutor) -> None:
    psutil = pytest.importorskip("psutil")
    # Workers that other tests have killed are replaced.
    local._client.wait_for_workers(2, timeout=dask_cluster.PATIENCE)
    workers = set(local._client.run(os.getpid).values())
    assert len(workers) == 2
    # The scheduler and what watches over the workers are in this process.
    sockets = [
        (process, connection.laddr.ip)
        for process in (os.getpid(), *workers)
        for connection in psutil.Process(process).net_connections("inet")
        if connection.status == "LISTEN"
    ]
    assert {process for process, _ in sockets} == {os.getpid(), *workers}
    assert {address for _, address in sockets} == {"127.0.0.1"}
    assert local.dashboard.startswith("http://127.0.0.1:")


@pytest.mark.rare
def test_a_lost_scheduler_is_one_clear_error(tmp_path: Path) -> None:
    with dask_cluster.cluster(tmp_path, workers=1) as cluster, DaskExecutor(cluster.scheduler) as executor:
        outcomes = executor.outcomes(jobs.slow, range(100))
        next(outcomes)
        cluster.processes[0].kill()
        with pytest.raises(
            ExecutorError, match=rf"^scheduler={cluster.scheduler}: the connection is lost; start"
        ) as caught:
            list(outcomes)
        assert "\n" not in str(caught.value)
        with pytest.raises(ExecutorError, match="the connection is lost"):
            next(executor.outcomes(jobs.slow, [1]))


def test_where_no_scheduler_is_the_address_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_ANSWER", 0.5)
    with pytest.raises(
        ExecutorError, match=r"^scheduler=tcp://127.0.0.1:9: cannot be reached .*dask scheduler"
    ) as caught:
        DaskExecutor("tcp://127.0.0.1:9")
    assert "\n" not in str(caught.value)


def test_a_scheduler_without_workers_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WORKER", 0.5)
    with (
        dask_cluster.cluster(tmp_path, workers=0) as cluster,
        pytest.raises(ExecutorError, match=r"no workers for 0.5 seconds; start some: dask worker tcp://127"),
    ):
        DaskExecutor(cluster.scheduler)


@pytest.mark.short
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"scheduler": "localhost"}, "^scheduler='localhost': must be an address such as tcp://"),
        ({"scheduler": "tls://localhost:1"}, "^tls_ca=None: is needed .* tls_ca, tls_cert and tls_key"),
        ({"scheduler": "tls://localhost:1", "tls_ca": "a", "tls_key": "b"}, "^tls_cert=None: is needed"),
        ({"scheduler": "tcp://localhost:1", "tls_ca": "a"}, "^tls_ca=a: is for a scheduler with TLS only"),
        ({"tls_key": "a"}, "^tls_key=a: .*not for the cluster on this machine; give scheduler=tls"),
        (
            {"scheduler": "tls://localhost:1", "tls_ca": "none.pem", "tls_cert": "b", "tls_key": "c"},
            "^tls_ca=none.pem: is not a file",
        ),
        ({"workers": 0}, "^workers=0: must be at least 1"),
    ],
)
def test_wrong_arguments_are_refused_before_anything_is_started(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        DaskExecutor(**given)


@pytest.mark.short
def test_without_the_package_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'teamsight\[dask\]'") as caught:
        DaskExecutor()
    assert caught.value.name is None


SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
import jobs
from faults import runs_of
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.dask import DaskExecutor
if __name__ == "__main__":
    try:
        with DaskExecutor(workers=1) as executor:
            for outcome in executor.outcomes(jobs.slow, range(1000)):
                print(outcome.index, flush=True)
    except KeyboardInterrupt:
        sys.exit(130)
"""


def test_ctrl_c_ends_a_cluster_on_this_machine_without_a_word(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(tests=str(Path(__file__).parent)))
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=dict(os.environ, PYTHONPATH=str(Path(__file__).parents[3])),
        start_new_session=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "0\n"
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate()
    assert (process.returncode, errors) == (130, "")
    # The group becomes empty: no worker was left, and the tracker of resources of multiprocessing ends last.
    for _ in range(36_000):
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            break
        time.sleep(0.05)
    else:
        os.killpg(process.pid, signal.SIGKILL)
        pytest.fail("processes were left")


@pytest.mark.rare
def test_a_sweep_on_a_cluster_whose_worker_is_killed_gives_the_same_rows(
    executor: DaskExecutor, tmp_path: Path
) -> None:
    study = Study(fixed={"targets": 2, "radius": 2.0}, axes={"robots": [2, 3]}, replicates=300, steps=100, seed=3)
    processes = values(executor.outcomes(jobs.process_of, range(12)))

    def kill(done: int, total: int, seconds_left: float | None) -> None:
        if 0 < done < total and processes:
            os.kill(processes[0], signal.SIGKILL)
            processes.clear()

    summary = sweep(study, tmp_path / "cluster", executor=executor, progress=kill)
    assert not processes, "all was done before a worker was killed"
    assert (summary.done, summary.failed) == (600, 0)
    sweep(study, tmp_path / "here")
    frames = [
        StudyFolder(tmp_path / name).read("runs").to_pandas().sort_values(["setting", "replicate"], ignore_index=True)
        for name in ("cluster", "here")
    ]
    pd.testing.assert_frame_equal(*frames)


def test_run_all_goes_on_after_a_failure_on_a_cluster(executor: DaskExecutor, tmp_path: Path) -> None:
    (tmp_path / "raise-3").touch()
    runs = runs_of(tmp_path, 2, seeds=22) + runs_of(tmp_path, 3, seeds=1) + runs_of(tmp_path, 4, seeds=20)
    checkpoint = Checkpoint(tmp_path / "checkpoint")
    with pytest.raises(JobError, match=r"^1 of 43 jobs failed, the first: .*robots=3, .* makes only these again$"):
        run_all(runs, executor, checkpoint=checkpoint)
    assert checkpoint.count(run.key for run in runs) == 42
    (tmp_path / "raise-3").unlink()
    assert run_all(runs, executor, checkpoint=checkpoint) == run_all(runs)
