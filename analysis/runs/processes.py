"""Jobs in worker processes of this machine."""

from __future__ import annotations

import contextlib
import gc
import importlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np

from teamsight.analysis.runs.executor import (
    MOST_DEATHS,
    ExecutorError,
    Outcome,
    TakenJobs,
    advance,
    advancing,
    attempt,
    death,
    emitting,
    error_text,
    made,
    messages,
)
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.kernel import cache as cache_folder

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerContext, SpawnContext

    Context: TypeAlias = SpawnContext | ForkServerContext


class WorkerProcess:
    """A worker process that makes one job after the other.

    Parameters
    ----------
    context : SpawnContext or ForkServerContext
        How the process is started.
    environment : mapping
        Environment variables of the process; see `os.environ`.

    Attributes
    ----------
    process : BaseProcess
        The process.
    pipe : Connection
        Where its answers arrive; closed at the other end when it is dead.
    is_ready : bool
        Whether it has started.
    job : int or None
        Number of the job in its hands.
    """

    def __init__(self, context: Context, environment: Mapping[str, str]) -> None:
        self.is_ready = False
        self.job: int | None = None
        self.pipe, there = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(there, environment), daemon=True)
        try:
            self.process.start()
        except BaseException:
            self.pipe.close()
            raise
        finally:
            there.close()

    def give(self, job: int, message: bytes) -> bool:
        """Send a job; return whether the worker was there to receive it."""
        # First, so that after an interrupt while it is sent the worker is known to be busy.
        self.job = job
        try:
            self.pipe.send_bytes(message)
        except OSError:
            self.job = None
        return self.job is not None

    def answer(self) -> tuple[str, Any] | None:
        """Receive "ready", a message, a report or the outcome of the job; None if the worker is dead."""
        try:
            message = self.pipe.recv_bytes()
        except (EOFError, OSError):
            return None
        try:
            kind, value = pickle.loads(message)
        except Exception as error:
            # A result that can be pickled, but not unpickled here.
            return "unsent", error_text(error)
        return kind, value

    def dismiss(self) -> None:
        """Let the process end when it is idle, without waiting for it."""
        with contextlib.suppress(OSError):
            self.pipe.send_bytes(_END)

    def join(self) -> None:
        """Wait until the process has ended."""
        self.process.join()
        self.pipe.close()


# What a worker imports before its first job, so that the time of that job does not contain it.
_IMPORTS = ("teamsight.agents.reused_worlds", "teamsight.analysis.runs.simulate")
# Time until a worker is started again that could not be [s].
_PAUSE = 0.1
# The message after the last job; those of jobs begin as a pickle does.
_END = b"end"


def _serve(pipe: Connection, environment: Mapping[str, str]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if environment != os.environ:
        # A fork has that of the time when the first worker of its parent was started.
        os.environ.clear()
        os.environ.update(environment)
    for name in _IMPORTS:
        # A failing import fails again within a job, where the error is reported.
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    # Else cycles are looked for among all that was imported, again and again, and when the interpreter ends.
    gc.freeze()
    np.random.seed()  # noqa: NPY002 (forks would all draw the same numbers of the global generator)
    with (
        contextlib.suppress(EOFError, OSError),
        emitting(lambda text: pipe.send(("message", text))),
        advancing(lambda part, done: pipe.send(("advance", (part, done)))),
    ):
        pipe.send(("ready", None))
        while (message := pipe.recv_bytes()) != _END:
            outcome = made(message)
            try:
                pipe.send(outcome)
            except OSError:
                raise
            except Exception as error:
                pipe.send(("unsent", error_text(error)))


def _end_with_parent() -> None:
    """End this process as soon as its parent has ended, also in the middle of a job.

    A parent that is killed cannot end its workers, and a worker reads its pipe only between two jobs.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _context() -> Context:
    """Return how workers are started.

    On Linux they are forks of one process that has made their imports, runs no code of users and lives as long as this
    one. Elsewhere libraries of the system do not survive a fork, so that each worker begins anew.
    """
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([*_IMPORTS])
    return context


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Start processes within the block with Ctrl-C blocked: only this process receives it, and then ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        # The first start of a process also starts the resource tracker, which unblocks the signal.
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class JobQueue(TakenJobs):
    """Jobs for worker processes, of which those wait that are sent next; the parameters are those of `TakenJobs`."""

    def __init__(self, function: Callable[[Any], Any], jobs: Iterable[Any]) -> None:
        super().__init__(function, jobs)
        self._waiting: deque[int] = deque()
        self._deaths: Counter[int] = Counter()

    def take(self, count: int) -> None:
        """Take jobs until `count` wait."""
        while len(self._waiting) + len(self._unsent) < count and not self._is_exhausted:
            if (index := self._next()) is not None:
                self._waiting.append(index)

    def give(self, worker: WorkerProcess) -> None:
        """Give a worker the first job that waits, if there is one."""
        if self._waiting:
            index = self._waiting.popleft()
            if not worker.give(index, self._messages[index]):
                self._waiting.appendleft(index)  # the death of the worker is noticed where its answer is awaited

    def death(self, index: int, code: int | None) -> Outcome | None:
        """Let a job in which a worker ended be made again, first; return its outcome if too many have ended in it."""
        self._deaths[index] += 1
        if self._deaths[index] >= MOST_DEATHS:
            return self.end(index, "died", code)
        self._waiting.appendleft(index)
        return None


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
    """A supervised pool of worker processes, which start with the first jobs and stop on exit.

    It is an `Executor`. A worker that ends by itself or is killed is replaced, and its job is made again; a job in
    which `MOST_DEATHS` workers ended has died.

    Parameters
    ----------
    workers : int
        Number of processes, at most what `check_workers` allows; with 1 all jobs run in this process.
    on_message : callable
        Called with each message that a job emits. By default the messages of a pool within a job go where those of the
        job go, and others are dropped.

    Attributes
    ----------
    size : int
        Number of processes.
    """

    shard: tuple[int, int] | None = None

    def __init__(self, workers: int, on_message: Callable[[str], object] | None = None) -> None:
        self.size = check_workers(workers)
        self._on_message = messages.receive if on_message is None else on_message
        self._context = _context()
        self._workers: list[WorkerProcess] = []
        # Workers in a row that a signal ended before they were ready.
        self._failed_starts = 0
        self._environment = {**os.environ}
        # Chosen once, so that all workers use the same folder and a notice about it appears once.
        if workers > 1 and (folder := cache_folder.cache_folder()):
            self._environment[cache_folder.VARIABLE] = str(folder)

    def __enter__(self) -> WorkerPool:
        if self.size > 1 and self._context.get_start_method() == "forkserver":
            # It makes its imports while this process plans the jobs.
            with interrupts_held():
                forkserver.ensure_running()
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
                try:
                    self._workers.append(WorkerProcess(self._context, self._environment))
                except (EOFError, ConnectionError) as error:  # the process whose fork it would be has ended
                    self._failed_starts += 1
                    if self._failed_starts >= MOST_DEATHS * self.size:
                        text = f"workers cannot start: {error_text(error)}; if memory ran out, use fewer workers"
                        raise ExecutorError(text) from error
                    time.sleep(_PAUSE)  # until the system knows of its end

    def _kill(self, workers: Iterable[WorkerProcess]) -> None:
        with deferred():  # a second Ctrl-C must not leave a worker behind
            ended = list(workers)
            for worker in ended:
                worker.process.kill()
            for worker in ended:
                worker.join()
                self._workers.remove(worker)

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
                # Until workers answer or are dead, also idle ones.
                ready = wait([worker.pipe for worker in self._workers]) if queue.open_jobs else []
                for worker in [worker for worker in self._workers if worker.pipe in ready]:
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
            if worker.is_ready and worker.job is None:
                queue.give(worker)
        queue.take(self.size)

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
                text = death(code, " before its first job", workers="a worker")
                if code == 1:  # a worker imports the script of its parent first
                    text += '; a script that starts workers must be a file and do so under if __name__ == "__main__":'
                raise ExecutorError(text)
        return None if worker.job is None else queue.death(worker.job, code)


# Work of one process that others would not shorten, since their imports take more than a second [s].
_SHORT = 5.0


def workers_for(seconds: float | None) -> int:
    """Return the number of workers for work that takes one of them so long [s]; None if that is not known."""
    return 1 if seconds is not None and seconds < _SHORT else cores()
