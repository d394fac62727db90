"""A pool of worker processes: jobs in, results in the order of the jobs, whoever did them.

The standard library's pools either hang when a worker is killed, or cannot stop work that has begun when Ctrl-C comes;
and neither starts its workers before there is work. This one does all three, and nothing else.
"""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, TypeVar

from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.kernel import cache_folder

# Longest message of an error, in characters; a terminal shows it in two or three lines.
_LONGEST = 280
# `multiprocessing.connection.wait` takes no more there.
_MOST_ON_WINDOWS = 60

T = TypeVar("T")
R = TypeVar("R")


class JobError(RuntimeError):
    """Raised when a job fails; the message tells what went wrong."""


class _Worker(NamedTuple):
    process: BaseProcess
    pipe: Connection


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return min(os.cpu_count() or 1, _MOST_ON_WINDOWS if sys.platform == "win32" else sys.maxsize)


def check_workers(workers: int) -> int:
    """Return the number of workers if this machine can run as many.

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
            f"workers={shown}: must be at most {most} on this machine, and more than its cores make nothing faster; "
            f"give {cores()}, or leave it out"
        )
    return count


_tell: Callable[[str], None] = print


def tell(text: str) -> None:
    """Send a line from within a job to whoever watches the pool."""
    _tell(text)


class WorkerPool:
    """Workers that begin to start with the pool, side by side, and end with it.

    Parameters
    ----------
    workers : int
        Number of processes, at most what `check_workers` allows; 1 works in this process.
    imports : sequence of str
        Modules that each worker imports while it waits for its first job.
    told : callable
        Called with each line that a job tells.
    """

    def __init__(
        self, workers: int, imports: Sequence[str] = (), told: Callable[[str], None] = lambda text: None
    ) -> None:
        check_workers(workers)
        self._told = told
        context = multiprocessing.get_context("spawn")
        self._workers: list[_Worker] = []
        # Chosen once, so that what is said about it is said once, and all use the same folder.
        folder = cache_folder.cache_folder() if workers > 1 else None
        try:
            # Workers inherit the mask: Ctrl-C reaches this process alone, which then ends them. It may still reach
            # another thread of this process, which hands it to this one.
            with deferred(), _interrupts_held():
                for _ in range(workers if workers > 1 else 0):
                    here, there = context.Pipe()
                    process = context.Process(target=_serve, args=(there, tuple(imports), folder), daemon=True)
                    process.start()
                    there.close()
                    self._workers.append(_Worker(process, here))
        except BaseException:
            self._kill()
            raise

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: object, trace: TracebackType | None) -> None:
        if kind is not None:
            self._kill()
        for worker in self._workers:
            with contextlib.suppress(OSError):
                worker.pipe.send(None)
        for worker in self._workers:
            worker.process.join()
            worker.pipe.close()
        self._workers.clear()

    def _kill(self) -> None:
        with deferred():  # a second Ctrl-C leaves no worker behind
            for worker in self._workers:
                worker.process.kill()
            for worker in self._workers:
                worker.process.join()
                worker.pipe.close()
            self._workers.clear()

    def map(
        self,
        function: Callable[[T], R],
        jobs: Sequence[T],
        done: Callable[[int], None] = lambda index: None,
        describe: Callable[[T], str] = repr,
        keep: Callable[[int, R], None] = lambda index, result: None,
    ) -> list[R]:
        """Return ``[function(job) for job in jobs]``.

        Parameters
        ----------
        function : callable
            A function of a module, so that workers can find it.
        jobs : sequence
            What it is called with; begun in this order.
        done : callable
            Called with the index of each job when it is done.
        describe : callable
            Names a job whose worker died; a job that raises is expected to name itself.
        keep : callable
            Called with index and result of each job, before `done`: what shall outlast an interruption is kept here.

        Raises
        ------
        JobError
            If a job raises or its worker dies. Leave the pool then: its other workers may still be at work.
        """
        results: list[Any] = [None] * len(jobs)
        for index, kind, value in self._outcomes(function, jobs):
            if kind == "died":
                cure = "; if memory ran out, use fewer workers" if value and value < 0 else ""
                job = _shortened(describe(jobs[index]), _LONGEST - 100)
                raise JobError(f"a worker ended with exit code {value} in {job}{cure}")
            if kind == "failed":
                raise JobError(_shortened(value, _LONGEST))
            results[index] = value
            keep(index, value)
            done(index)
        return results

    def _outcomes(self, function: Callable[[T], R], jobs: Sequence[T]) -> Iterator[tuple[int, str, Any]]:
        if not self._workers:
            for index, job in enumerate(jobs):
                with _telling(self._told):
                    yield index, *_attempt(function, job)
            return
        waiting, idle, busy = deque(range(len(jobs))), deque(self._workers), dict[Connection, int]()
        while waiting or busy:
            while waiting and idle:
                worker = idle.popleft()
                index = waiting.popleft()
                busy[worker.pipe] = index
                with contextlib.suppress(OSError):  # a dead worker is noticed below
                    worker.pipe.send((function, jobs[index]))
            for worker in [worker for worker in self._workers if worker.pipe in wait(list(busy))]:
                try:
                    kind, value = worker.pipe.recv()
                except (EOFError, OSError):
                    worker.process.join()
                    yield busy.pop(worker.pipe), "died", worker.process.exitcode
                    return
                if kind == "told":
                    self._told(value)
                    continue
                idle.append(worker)
                yield busy.pop(worker.pipe), kind, value


def _attempt(function: Callable[[T], R], job: T) -> tuple[str, Any]:
    try:
        return "done", function(job)
    except Exception as error:
        return "failed", str(error) or type(error).__name__


def _shortened(text: str, longest: int) -> str:
    """Return a text on one line; the middle of a long one is left out, as errors begin and end with what matters."""
    line = " ".join(text.split())
    return line if len(line) <= longest else f"{line[: longest * 2 // 3]} … {line[-(longest // 3) + 3 :]}"


def _serve(pipe: Connection, imports: tuple[str, ...], folder: Path | None) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if folder:
        os.environ[cache_folder.VARIABLE] = str(folder)
    for name in imports:
        # One that fails will fail again within a job, where it can be reported.
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    with contextlib.suppress(EOFError, OSError), _telling(lambda text: pipe.send(("told", text))):
        while (message := pipe.recv()) is not None:
            pipe.send(_attempt(*message))


def _end_with_parent() -> None:
    """End this process as soon as its parent has ended, whatever it is doing.

    A parent that is killed cannot end its workers, and a worker reads its pipe between two jobs only.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


@contextlib.contextmanager
def _telling(told: Callable[[str], None]) -> Iterator[None]:
    global _tell
    before, _tell = _tell, told
    try:
        yield
    finally:
        _tell = before


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        # The first start of a process starts this one, too, and lets the signal through again when it has done so.
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
