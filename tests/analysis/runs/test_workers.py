"""A pool returns results in order, survives nothing silently, and leaves no process behind."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import tempfile
from collections.abc import Hashable
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import pytest

from teamsight.analysis.runs import processes as workers_module
from teamsight.analysis.runs.executor import JobError, advancing, results_of
from teamsight.analysis.runs.processes import WorkerPool, check_workers
from teamsight.core.kernel.cache import cache_folder

sys.path.insert(0, str(Path(__file__).parent))
import jobs


@pytest.mark.parametrize("workers", [1, 3])
def test_results_come_in_the_order_of_the_jobs(workers: int) -> None:
    done: list[int] = []
    with WorkerPool(workers) as pool:
        assert results_of(pool, jobs.square, range(20), done.append) == [number**2 for number in range(20)]
        assert sorted(done) == list(range(20))
        assert results_of(pool, jobs.square, [5]) == [25]
        assert results_of(pool, jobs.square, []) == []


def test_all_workers_take_part() -> None:
    with WorkerPool(2) as pool:
        assert len(set(results_of(pool, jobs.process_of, range(20))) - {os.getpid()}) == 2


@pytest.mark.parametrize("workers", [1, 2])
def test_a_failing_job_is_reported_with_its_own_words(workers: int) -> None:
    with pytest.raises(JobError, match=r"^delta=0: a ring needs at least 1 sector$"), WorkerPool(workers) as pool:
        results_of(pool, jobs.fail_at_three, range(6))


def test_a_killed_worker_is_reported_with_its_job() -> None:
    with pytest.raises(JobError, match=r"exit code -9 in job <7>"), WorkerPool(2) as pool:
        results_of(pool, jobs.die, [7], describe=lambda job: f"job <{job}>")


@pytest.mark.parametrize("workers", [1, 2])
def test_messages_of_a_job_arrive(workers: int) -> None:
    lines: list[str] = []
    with WorkerPool(workers, on_message=lines.append) as pool:
        results_of(pool, jobs.talk, range(4))
    assert sorted(lines) == [f"line {number}" for number in range(4)]


@pytest.mark.parametrize("workers", [1, 2])
def test_jobs_report_how_much_of_them_is_done(workers: int) -> None:
    reports: list[tuple[Hashable, int]] = []
    with WorkerPool(workers) as pool:
        results_of(pool, jobs.make_in_steps, [2])
        with advancing(lambda part, done: reports.append((part, done))):
            results_of(pool, jobs.make_in_steps, [2, 3])
        results_of(pool, jobs.make_in_steps, [2])
    assert sorted(reports) == [(2, 1), (2, 2), (3, 1), (3, 2), (3, 3)]


_LONG = """
import sys
sys.path.insert(0, {tests!r})
import jobs
from teamsight.analysis.runs.executor import results_of
from teamsight.analysis.runs.processes import WorkerPool
if __name__ == "__main__":
    try:
        with WorkerPool(2, on_message=lambda text: print(text, flush=True)) as pool:
            pool._start(2)
            print(*(worker.process.pid for worker in pool._workers), flush=True)
            results_of(pool, jobs.{job}, range(4))
    except KeyboardInterrupt:
        sys.exit(130)
"""


def start(folder: Path, job: str) -> tuple[subprocess.Popen[str], list[int]]:
    """Start a program with two workers in a group of processes of its own; return it and their ids."""
    script = folder / "long.py"
    script.write_text(_LONG.format(tests=str(Path(__file__).parent), job=job))
    environment = dict(os.environ, PYTHONPATH=str(Path(__file__).parents[3]))
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
        start_new_session=True,
        text=True,
        # A shell lets jobs in the background not hear Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout is not None
    return process, [int(word) for word in process.stdout.readline().split()]


def is_gone(process: int) -> bool:
    """Say whether a process has ended, be it that nobody has collected its status yet."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at processes as Linux shows them")


@linux
def test_ctrl_c_ends_the_workers_at_once_and_without_a_word(tmp_path: Path) -> None:
    process, workers = start(tmp_path, "wait_for_ever")
    # As a terminal does: to every process of the group, whether it has come up yet or not.
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate()
    assert (process.returncode, errors) == (130, "")
    assert all(is_gone(worker) for worker in workers)


@linux
def test_workers_do_not_hear_ctrl_c_while_they_start(tmp_path: Path) -> None:
    # In a process of its own, since the first start of a process is unlike the others.
    script = tmp_path / "masks.py"
    script.write_text(
        "import signal\nfrom pathlib import Path\nfrom teamsight.analysis.runs.processes import WorkerPool\n"
        "if __name__ == '__main__':\n"
        "    with WorkerPool(2) as pool:\n"
        "        pool._start(2)\n"
        "        for worker in pool._workers:\n"
        "            status = Path(f'/proc/{worker.process.pid}/status').read_text()\n"
        "            print(*(line for line in status.splitlines() if line.startswith('SigBlk')))\n"
        "    print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))\n"
    )
    environment = dict(os.environ, PYTHONPATH=str(Path(__file__).parents[3]))
    found = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, env=environment, check=True
    )
    *masks, after = found.stdout.splitlines()
    assert [int(mask.split()[1], 16) >> (signal.SIGINT - 1) & 1 for mask in masks] == [1, 1]
    assert after == "False"


def test_workers_have_the_environment_of_their_pool_and_random_numbers_of_their_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for value in ("a", "b"):
        monkeypatch.setenv("TEAMSIGHT_TEST", value)
        with WorkerPool(2) as pool:
            found = results_of(pool, jobs.environment_and_draws, range(20))
        for environment, _ in found:
            assert environment == {**os.environ, "TEAMSIGHT_CACHE_DIR": str(cache_folder())}
        for number in range(2):
            assert len({draws[number] for _, draws in found}) == 20


@linux
@pytest.mark.parametrize("job", ["wait_for_ever", "spin"])
def test_workers_end_when_their_parent_is_killed_in_the_middle_of_a_long_job(tmp_path: Path, job: str) -> None:
    process, workers = start(tmp_path, job)
    assert process.stdout is not None
    assert [process.stdout.readline() for _ in workers] == ["begun\n"] * 2
    watched = [os.pidfd_open(worker) for worker in workers]
    process.kill()
    process.communicate()
    # The jobs never end by themselves.
    ended = [bool(select.select([one], [], [], 20)[0]) for one in watched]
    for one, worker, has_ended in zip(watched, workers, ended, strict=True):
        if not has_ended:
            signal.pidfd_send_signal(one, signal.SIGKILL)
        os.close(one)
        assert has_ended, f"worker {worker} outlived its parent by 20 seconds"


def test_a_killed_worker_with_a_long_job_is_reported_in_one_line_with_a_cure() -> None:
    with pytest.raises(JobError, match=r"exit code -9 in .*fewer workers$") as caught, WorkerPool(2) as pool:
        results_of(pool, jobs.die_of, [np.arange(5000.0)] * 2, describe=lambda job: f"job\n{job.tolist()}")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("workers", [1, 2])
def test_a_long_error_keeps_its_beginning_and_its_end(workers: int) -> None:
    with (
        pytest.raises(JobError, match=r"^number=3: is wrong for .* … .*\(in the run rng=7\)$") as caught,
        WorkerPool(workers) as pool,
    ):
        results_of(pool, jobs.fail_at_length, [3])
    assert len(str(caught.value)) < 300


def test_too_many_workers_are_refused_before_any_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers_module, "cores", lambda: 3)
    monkeypatch.setattr(workers_module.multiprocessing, "get_context", None)
    assert [check_workers(count) for count in (1, 8, 12)] == [1, 8, 12]
    for count in (13, 200, 10**400):
        with pytest.raises(ValueError, match="at most 12.*give 3") as caught:
            check_workers(count)
        assert len(str(caught.value)) < 300
    with pytest.raises(ValueError, match="^workers=200: must be at most 12"):
        WorkerPool(200)
    for wrong in (0, -1):
        with pytest.raises(ValueError, match=f"workers={wrong}: must be at least 1"):
            WorkerPool(wrong)
    for kind in (2.5, "4", None, True):
        with pytest.raises(TypeError, match="workers="):
            WorkerPool(kind)  # type: ignore[arg-type]


def test_workers_keep_kernels_in_the_folder_that_was_chosen_once(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    unsafe = tmp_path / "unsafe"
    unsafe.mkdir()
    unsafe.chmod(0o777)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(unsafe))
    with WorkerPool(2) as pool:
        folders = set(results_of(pool, jobs.cache_folder_of, range(6)))
    assert folders == {str(cache_folder())}
    assert capfd.readouterr().err.count("\n") == 1


def test_workers_that_were_started_are_ended_when_one_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[BaseProcess] = []
    kind = workers_module._context().Process
    start_one = kind.start

    def start(process: BaseProcess) -> None:
        if len(started) == 2:
            raise OSError(11, "Resource temporarily unavailable")
        started.append(process)
        start_one(process)

    monkeypatch.setattr(kind, "start", start)
    with pytest.raises(OSError, match="temporarily unavailable"), WorkerPool(3) as pool:
        results_of(pool, str, range(3))
    assert [process.exitcode for process in started] == [-signal.SIGKILL, -signal.SIGKILL]


def test_an_interrupt_while_workers_start_ends_them(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[BaseProcess] = []
    kind = workers_module._context().Process
    start_one = kind.start

    def start(process: BaseProcess) -> None:
        started.append(process)
        start_one(process)
        # As by another thread, whose signals are not held.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(kind, "start", start)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), WorkerPool(2) as pool:
            results_of(pool, str, range(2))
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(started) == 2
    assert all(process.exitcode == -signal.SIGKILL for process in started)
