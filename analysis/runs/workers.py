"""A pool of worker processes that returns results in the order of the jobs.

The pools of the standard library hang when a worker is killed, or cannot stop a running job on Ctrl-C, and they start
no worker before there is work. This pool has none of these limits.
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

from teamsight.analysis.runs.attempt import answer, attempt, end_with_parent
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.kernel import cache_folder

# Characters of the longest error, two or three lines of a terminal.
_LONGEST = 280
# The most handles that `multiprocessing.connection.wait` accepts on Windows.
_MOST_ON_WINDOWS = 60

T = TypeVar("T")
R = TypeVar("R")


class JobError(RuntimeError):
    """Raised when a job fails; the message says why."""


class _TracebackError(Exception):
    """The traceback of a job that failed, perhaps in another process."""


class _Worker(NamedTuple):
    process: BaseProcess
    pipe: Connection


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


def _drop(text: str) -> None:
    pass


_emit: Callable[[str], None] = _drop


def emit(text: str) -> None:
    """Send a message from within a job to the process that owns the pool."""
    _emit(text)


class WorkerPool:
    """A pool of worker processes, started by the constructor and stopped on exit.

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
        self._on_message = _emit if on_message is None else on_message
        context = multiprocessing.get_context("spawn")
        self._workers: list[_Worker] = []
        # Chosen once, so that all workers use the same folder and a notice about it appears once.
        folder = cache_folder.cache_folder() if workers > 1 else None
        try:
            # Workers inherit the signal mask, so that only this process receives Ctrl-C; it then ends them.
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
        with deferred():  # a second Ctrl-C must not leave a worker behind
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
            A function of a module, so that workers can import it.
        jobs : sequence
            Its arguments; jobs are started in this order.
        done : callable
            Called with the index of each job when it is done.
        describe : callable
            Returns the text for a job whose worker died. A job that raises describes itself in its error.
        keep : callable
            Called with index and result of each job, before `done`.

        Raises
        ------
        JobError
            If a job raises or its worker dies. Other workers may still be busy: leave the pool.
        """
        results: list[Any] = [None] * len(jobs)
        for index, kind, value in self._outcomes(function, jobs):
            if kind == "died":
                job = _shortened(describe(jobs[index]), _LONGEST - 100)
                raise JobError(f"a worker ended with exit code {value} in {job}{_cure(value)}")
            if kind == "failed":
                text, trace = value
                raise JobError(_shortened(text, _LONGEST)) from _TracebackError(trace)
            if kind == "unsent":
                job = _shortened(describe(jobs[index]), _LONGEST // 2)
                raise JobError(f"{_shortened(value, _LONGEST // 2)} (in {job}); {_IMPORTABLE}")
            results[index] = value
            keep(index, value)
            done(index)
        return results

    def _outcomes(self, function: Callable[[T], R], jobs: Sequence[T]) -> Iterator[tuple[int, str, Any]]:
        if not self._workers:
            for index, job in enumerate(jobs):
                with _emitting(self._on_message):
                    yield index, *attempt(function, job)
            return
        waiting, idle, busy = deque(range(len(jobs))), deque(self._workers), dict[Connection, int]()
        while waiting or busy:
            while waiting and idle:
                worker = idle.popleft()
                index = waiting.popleft()
                busy[worker.pipe] = index
                try:
                    worker.pipe.send((function, jobs[index]))
                except OSError:
                    pass  # a dead worker is noticed below
                except Exception as error:
                    yield index, "unsent", str(error)
                    return
            for worker in [worker for worker in self._workers if worker.pipe in wait(list(busy))]:
                try:
                    kind, value = worker.pipe.recv()
                except (EOFError, OSError):
                    worker.process.join()
                    yield busy.pop(worker.pipe), "died", worker.process.exitcode
                    return
                if kind == "message":
                    self._on_message(value)
                    continue
                idle.append(worker)
                yield busy.pop(worker.pipe), kind, value


# Pickling has its own errors, which name what cannot be sent and not what to do.
_IMPORTABLE = "what workers get and return must be picklable: define functions in a module, or give workers=1"


def _cure(code: int | None) -> str:
    """Return what to do about a worker that ended by itself."""
    if code and code < 0:
        return "; if memory ran out, use fewer workers"
    # Errors in jobs are reported, so it was the start that failed: a worker imports the script of its parent.
    script = 'a script that starts workers must be a file and do so under if __name__ == "__main__":'
    return f"; {script}" if code == 1 else ""


def _shortened(text: str, longest: int) -> str:
    """Return a text on one line, without the middle of a long one: errors begin and end with what matters."""
    line = " ".join(text.split())
    return line if len(line) <= longest else f"{line[: longest * 2 // 3]} … {line[-(longest // 3) + 3 :]}"


def _serve(pipe: Connection, imports: tuple[str, ...], folder: Path | None) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    if folder:
        os.environ[cache_folder.VARIABLE] = str(folder)
    for name in imports:
        # A failing import fails again within a job, where the error is reported.
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    with contextlib.suppress(EOFError, OSError), _emitting(lambda text: pipe.send(("message", text))):
        while (outcome := answer(pipe)) is not None:
            try:
                pipe.send(outcome)
            except OSError:
                raise
            except Exception as error:
                pipe.send(("unsent", str(error)))


@contextlib.contextmanager
def _emitting(on_message: Callable[[str], None]) -> Iterator[None]:
    global _emit
    before, _emit = _emit, on_message
    try:
        yield
    finally:
        _emit = before


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
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
