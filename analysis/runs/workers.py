"""A supervised pool of worker processes.

The pools of the standard library hang when a worker is killed, or cannot stop a running job on Ctrl-C, and they start
no worker before there is work. This pool has none of these limits: a worker that ends in a job is replaced, and the job
is made again.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Generator, Iterable, Sequence
from multiprocessing.connection import wait
from types import TracebackType
from typing import TypeVar

from teamsight.analysis.runs.attempt import advance, attempt, emitting, receiver
from teamsight.analysis.runs.attempt import emit as emit
from teamsight.analysis.runs.executor import MOST_DEATHS, ExecutorError, Outcome, results_of, start_cure
from teamsight.analysis.runs.executor import JobError as JobError
from teamsight.analysis.runs.job_queue import JobQueue
from teamsight.analysis.runs.worker_process import WorkerProcess, interrupts_held
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.kernel import cache as cache_folder

# The most handles that `multiprocessing.connection.wait` accepts on Windows.
_MOST_ON_WINDOWS = 60

T = TypeVar("T")
R = TypeVar("R")


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return min(os.cpu_count() or 1, _MOST_ON_WINDOWS if sys.platform == "win32" else sys.maxsize)


def check_workers(workers: int) -> int:
    """Return a number of workers that this machine can run.

    Raises
    ------
    TypeError
        If it is not a whole number.
    ValueError
        If it is less than 1, or more than four for each core; eight are allowed everywhere.
    """
    count = checks.count("workers", workers)
    most = max(4 * cores(), 8)
    if sys.platform == "win32":
        most = min(most, _MOST_ON_WINDOWS)
    if count > most:
        shown = count if count < 10**12 else "more than 10^12"
        raise ValueError(
            f"workers={shown}: must be at most {most} on this machine, and more than its cores are not faster; give "
            f"{cores()}, or leave it out"
        )
    return count


class WorkerPool:
    """A supervised pool of worker processes, started by the constructor and stopped on exit.

    It is an `Executor`. A worker that ends by itself or is killed is replaced, and its job is made again; a job in
    which `MOST_DEATHS` workers ended has died.

    Parameters
    ----------
    workers : int
        Number of processes, at most what `check_workers` allows; with 1 all jobs run in this process.
    imports : sequence of str
        Modules that each worker imports before its first job.
    on_message : callable
        Called with each message that a job emits. By default the messages of a pool within a job go where those of the
        job go, and others are dropped.

    Attributes
    ----------
    size : int
        Number of processes.
    """

    def __init__(
        self, workers: int, imports: Sequence[str] = (), on_message: Callable[[str], None] | None = None
    ) -> None:
        self.size = check_workers(workers)
        self._imports = tuple(imports)
        self._on_message = receiver() if on_message is None else on_message
        self._context = multiprocessing.get_context("spawn")
        self._workers: list[WorkerProcess] = []
        # Workers in a row that a signal ended before they were ready.
        self._failed_starts = 0
        # Chosen once, so that all workers use the same folder and a notice about it appears once.
        self._folder = cache_folder.cache_folder() if workers > 1 else None
        try:
            self._start(workers if workers > 1 else 0)
        except BaseException:
            self._kill(self._workers)
            raise

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        # The result of a job in a worker's hands is not wanted any more, and the worker could not send it.
        self._kill([worker for worker in self._workers if kind is not None or worker.job is not None])
        for worker in self._workers:
            worker.dismiss()
        for worker in self._workers:
            worker.join()
        self._workers.clear()

    def _start(self, count: int) -> None:
        """Start workers, so that there are `count`."""
        if len(self._workers) >= count:
            return
        with deferred(), interrupts_held():
            while len(self._workers) < count:
                self._workers.append(WorkerProcess(self._context, self._imports, self._folder))

    def _kill(self, workers: Iterable[WorkerProcess]) -> None:
        with deferred():  # a second Ctrl-C must not leave a worker behind
            ended = list(workers)
            for worker in ended:
                worker.process.kill()
            for worker in ended:
                worker.join()
                self._workers.remove(worker)

    def map(
        self,
        function: Callable[[T], R],
        jobs: Sequence[T],
        done: Callable[[int], None] = lambda index: None,
        describe: Callable[[T], str] = repr,
        keep: Callable[[int, R], None] = lambda index, result: None,
    ) -> list[R]:
        """Return ``[function(job) for job in jobs]``; see `teamsight.analysis.runs.executor.results_of`."""
        return results_of(self, function, jobs, done, describe, keep)

    def outcomes(self, function: Callable[[T], R], jobs: Iterable[T]) -> Generator[Outcome, None, None]:
        """Yield the outcome of each job as they end; see `teamsight.analysis.runs.executor.Executor`.

        Raises
        ------
        ExecutorError
            If workers cannot start.
        RuntimeError
            If the outcomes of other jobs are still awaited.
        """
        if self.size == 1:
            for index, job in enumerate(jobs):
                with emitting(self._on_message):
                    status, value = attempt(function, job)
                yield Outcome(index, status, value)
            return
        if any(worker.job is not None for worker in self._workers):
            raise RuntimeError("jobs: the workers of this pool have others; end the iteration over those first")
        queue = JobQueue(function, jobs)
        try:
            while not queue.is_empty:
                self._hand_out(queue)
                yield from queue.unsent()
                for worker in self._answering() if queue.open_jobs else ():
                    outcome = self._outcome(worker, queue)
                    if outcome is not None:
                        # Before the caller works on the outcome, so that no worker waits for that.
                        self._hand_out(queue)
                        yield outcome
        finally:
            self._kill([worker for worker in self._workers if worker.job is not None])

    def _hand_out(self, queue: JobQueue) -> None:
        """Give each idle worker a job, and let as many wait; start workers that are missing for the jobs there are."""
        queue.take(self.size)
        self._start(min(self.size, queue.open_jobs))
        for worker in self._workers:
            if worker.is_ready and worker.job is None and (first := queue.first()):
                index, message = first
                if not worker.give(index, message):
                    queue.put_back(index)  # the death of the worker is noticed where its answer is awaited
        queue.take(self.size)

    def _answering(self) -> list[WorkerProcess]:
        """Wait until workers answer or are dead, also idle ones, and return them."""
        ready = wait([worker.pipe for worker in self._workers])
        return [worker for worker in self._workers if worker.pipe in ready]

    def _outcome(self, worker: WorkerProcess, queue: JobQueue) -> Outcome | None:
        """Receive what a worker sends; return the outcome of its job if it is that."""
        answer = worker.answer()
        if answer is None:
            return self._death(worker, queue)
        kind, value = answer
        if kind == "ready":
            worker.is_ready, self._failed_starts = True, 0
            return None
        if kind == "message":
            self._on_message(value)
            return None
        if kind == "advance":
            advance(*value)
            return None
        assert worker.job is not None  # a worker that has none sends nothing else
        index, worker.job = worker.job, None
        return queue.end(index, kind, value)

    def _death(self, worker: WorkerProcess, queue: JobQueue) -> Outcome | None:
        """Remove a dead worker; return the outcome of its job if it was the last that may end in it."""
        self._workers.remove(worker)
        worker.join()
        code = worker.process.exitcode
        if not worker.is_ready:
            self._failed_starts += 1
            # A signal may have come from anywhere, to all workers at once; who ends by itself would do so again.
            if code is None or code >= 0 or self._failed_starts >= MOST_DEATHS * self.size:
                raise ExecutorError(f"a worker ended with exit code {code} before its first job{start_cure(code)}")
        return None if worker.job is None else queue.death(worker.job, code)
