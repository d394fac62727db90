"""A pool replaces dead workers, makes their jobs again, takes jobs lazily and can be left at any time."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from multiprocessing import forkserver
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pytest

from teamsight.analysis.runs import processes as processes_module
from teamsight.analysis.runs.executor import ExecutorError, JobError, Outcome, results_of
from teamsight.analysis.runs.processes import WorkerPool

sys.path.insert(0, str(Path(__file__).parent))
import jobs
from time_limit import time_limit as time_limit


@pytest.fixture(scope="module")
def pool() -> Iterator[WorkerPool]:
    """A pool for all tests of this module: what a test does to it must not be seen by the next."""
    with WorkerPool(2) as started:
        yield started


def values(outcomes: Iterator[Outcome]) -> list[Any]:
    """Return the results in the order of the jobs; all must be done."""
    found = sorted(outcomes, key=lambda outcome: outcome.index)
    assert [outcome.status for outcome in found] == ["done"] * len(found)
    assert [outcome.index for outcome in found] == list(range(len(found)))
    return [outcome.value for outcome in found]


def processes(pool: WorkerPool) -> set[int]:
    return {worker.process.pid for worker in pool._workers if worker.process.pid}


def ended(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False


def test_jobs_whose_workers_were_killed_are_made_again(pool: WorkerPool, tmp_path: Path) -> None:
    given = [(str(tmp_path), number) for number in range(4)]
    assert values(pool.outcomes(jobs.die_once, given)) == [0, 1, 4, 9]
    assert len(list(tmp_path.iterdir())) == 4


def test_workers_killed_in_the_middle_change_no_result(pool: WorkerPool) -> None:
    found = []
    for outcome in pool.outcomes(jobs.square, range(40)):
        found.append(outcome)
        if len(found) in (5, 20):
            # All at once, some in the middle of a job and some perhaps idle.
            for process in processes(pool):
                os.kill(process, signal.SIGKILL)
    assert values(iter(found)) == [number**2 for number in range(40)]


@pytest.mark.parametrize(
    ("how", "code"), [("kill", -signal.SIGKILL), ("crash", -signal.SIGSEGV), ("exit 0", 0), ("exit 1", 1)]
)
def test_a_job_that_ends_every_worker_has_died_and_all_others_are_done(pool: WorkerPool, how: str, code: int) -> None:
    found = sorted(pool.outcomes(jobs.end, ["a", how, "b", "c"]))
    assert found == [(0, "done", "a"), (1, "died", code), (2, "done", "b"), (3, "done", "c")]


def test_a_job_is_given_up_after_three_workers(pool: WorkerPool, monkeypatch: pytest.MonkeyPatch) -> None:
    deaths = []
    noticed = WorkerPool._death
    monkeypatch.setattr(WorkerPool, "_death", lambda self, *rest: (deaths.append(rest), noticed(self, *rest))[1])
    assert [outcome.status for outcome in pool.outcomes(jobs.end, ["exit 1"])] == ["died"]
    assert len(deaths) == 3


def test_workers_killed_while_idle_are_replaced_and_blame_no_job(pool: WorkerPool) -> None:
    assert values(pool.outcomes(jobs.square, range(4))) == [0, 1, 4, 9]
    # More often than a job may lose its worker.
    for _ in range(4):
        before = processes(pool)
        for process in before:
            os.kill(process, signal.SIGKILL)
        assert results_of(pool, jobs.square, [7]) == [49]
        assert not before & processes(pool)


def test_jobs_are_taken_only_when_workers_will_soon_need_them(pool: WorkerPool) -> None:
    taken: list[int] = []

    def endless() -> Iterator[int]:
        number = 0
        while True:
            taken.append(number)
            yield number
            number += 1

    outcomes = pool.outcomes(jobs.square, endless())
    for made in range(1, 20):
        next(outcomes)
        # Those that are made and those that are in the workers' hands, and as many again that wait.
        assert len(taken) <= made + 2 * pool.size
    outcomes.close()


def test_leaving_early_ends_the_jobs_and_the_pool_can_be_used_again(pool: WorkerPool) -> None:
    outcomes = pool.outcomes(jobs.wait_unless, [0, 1, 1])
    assert next(outcomes) == (0, "done", 0)
    busy = processes(pool)
    outcomes.close()
    assert processes(pool) < busy
    assert all(ended(process) for process in busy - processes(pool))
    assert results_of(pool, jobs.square, range(4)) == [0, 1, 4, 9]
    assert len(processes(pool)) == pool.size


def test_leaving_the_pool_ends_workers_with_jobs() -> None:
    with WorkerPool(2) as pool:
        outcomes = pool.outcomes(jobs.wait_unless, [0, 1, 1])
        next(outcomes)
        busy = processes(pool)
    assert all(ended(process) for process in busy)
    outcomes.close()


def test_two_iterations_at_once_are_refused(pool: WorkerPool) -> None:
    first = pool.outcomes(jobs.square, range(9))
    next(first)
    with pytest.raises(RuntimeError, match="jobs: .*end the iteration over those first"):
        next(pool.outcomes(jobs.square, range(9)))
    first.close()


@pytest.mark.parametrize("size", [0, 5_000_000])
def test_many_and_large_jobs(pool: WorkerPool, size: int) -> None:
    # Larger than what a pipe holds, in both directions.
    given = [bytes([number % 256]) * size for number in range(1000 if size == 0 else 6)]
    assert values(pool.outcomes(jobs.echo, given)) == given


@pytest.mark.parametrize(("kind", "message"), [("lambda", "lambda"), ("odd", "^this is no odd thing$")])
def test_a_result_that_cannot_be_sent_is_named_and_the_others_are_done(
    pool: WorkerPool, kind: str, message: str
) -> None:
    found = {outcome.index: outcome for outcome in pool.outcomes(jobs.return_odd, ["plain", kind, "plain"])}
    assert [found[index].status for index in range(3)] == ["done", "unsent", "done"]
    with pytest.raises(JobError, match=rf"{message.strip('^$')}.*in 'job'.*define functions in a module"):
        results_of(pool, jobs.return_odd, [kind], describe=lambda job: "'job'")


def test_a_job_that_cannot_be_sent_is_named_and_the_others_are_done(pool: WorkerPool) -> None:
    found = sorted(pool.outcomes(jobs.echo, [b"a", lambda: b"b", b"c"]))  # type: ignore[list-item]
    assert [(outcome.index, outcome.status) for outcome in found] == [(0, "done"), (1, "unsent"), (2, "done")]
    assert "lambda" in found[1].value


@pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt, MemoryError])
def test_a_job_that_wants_to_end_its_process_fails(pool: WorkerPool, error: type[BaseException]) -> None:
    before = processes(pool)
    ((index, status, (text, trace)),) = pool.outcomes(jobs.leave, [error])
    assert (index, status, text) == (0, "failed", "away")
    assert f"{error.__name__}: away" in trace
    assert processes(pool) == before


def test_an_error_in_the_jobs_themselves_leaves_no_worker_busy(pool: WorkerPool) -> None:
    def wrong() -> Iterator[int]:
        yield 1
        raise ValueError("no more")

    with pytest.raises(ValueError, match="no more"):
        list(pool.outcomes(jobs.square, wrong()))
    assert results_of(pool, jobs.square, [3]) == [9]


def test_workers_that_are_killed_while_they_start_are_replaced_a_few_times(monkeypatch: pytest.MonkeyPatch) -> None:
    with WorkerPool(2) as pool:
        for process in processes(pool):
            os.kill(process, signal.SIGKILL)
        assert results_of(pool, jobs.square, range(3)) == [0, 1, 4]

    with pytest.raises(ExecutorError, match=r"exit code -9 before its first job; if memory ran out") as caught:
        starting(monkeypatch)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("error", [EOFError, ConnectionRefusedError, BrokenPipeError])
def test_the_end_of_the_process_that_starts_workers_is_no_end_of_the_work(
    monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    kind = processes_module._context().Process
    start, failures = kind.start, [2]

    def fail(process: BaseProcess) -> None:
        if failures[0]:
            failures[0] -= 1
            raise error("unexpected EOF")
        start(process)

    monkeypatch.setattr(kind, "start", fail)
    with WorkerPool(2) as pool:
        assert results_of(pool, jobs.square, range(3)) == [0, 1, 4]
    failures[0] = 1000
    with pytest.raises(ExecutorError, match="^workers cannot start: .*; if memory ran out"), WorkerPool(2) as pool:
        results_of(pool, jobs.square, range(3))
    assert failures[0] == 1000 - 6


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere each worker begins anew")
def test_a_killed_fork_server_is_started_again(pool: WorkerPool) -> None:
    for _ in range(2):
        with WorkerPool(2) as other:
            os.kill(forkserver._forkserver._forkserver_pid, signal.SIGKILL)  # type: ignore[attr-defined]
            assert results_of(other, jobs.square, range(3)) == [0, 1, 4]


def starting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use a pool whose workers are killed as soon as they start."""
    start = WorkerPool._start

    def start_and_kill(pool: WorkerPool, count: int) -> None:
        start(pool, count)
        for worker in pool._workers:
            worker.process.kill()

    monkeypatch.setattr(WorkerPool, "_start", start_and_kill)
    with WorkerPool(2) as pool:
        results_of(pool, jobs.square, range(3))


@pytest.mark.short
def test_one_worker_is_this_process_and_takes_one_job_at_a_time() -> None:
    taken: list[int] = []
    with WorkerPool(1) as pool:
        outcomes = pool.outcomes(jobs.fail_at_three, (taken.append(number) or number for number in range(9)))
        assert next(outcomes) == (0, "done", 0)
        assert taken == [0]
        assert [outcome.status for outcome in outcomes] == ["done", "done", "failed", *["done"] * 5]


def test_a_slow_reader_does_not_keep_workers_waiting(pool: WorkerPool) -> None:
    """Each worker has its next job before the caller sees the outcome of the last."""
    for outcome in pool.outcomes(jobs.process_of, range(8)):
        if outcome.index < 4:
            assert [worker.job is not None for worker in pool._workers if worker.process.pid == outcome.value] == [True]


def test_jobs_none_of_which_can_be_sent_are_not_gathered(pool: WorkerPool) -> None:
    taken: list[int] = []
    outcomes = pool.outcomes(jobs.echo, ((taken.append(number), lambda: b"")[1] for number in range(100)))  # type: ignore[misc]
    next(outcomes)
    assert len(taken) <= 2 * pool.size
    assert {outcome.status for outcome in outcomes} == {"unsent"}
    assert len(taken) == 100
