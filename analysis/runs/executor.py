"""What runs jobs: the contract of executors, and the results of jobs in their order.

An executor calls a function with each of many jobs, in this process, in a pool of processes or on a cluster, and yields
what became of each. `teamsight.analysis.runs.workers.WorkerPool` is one.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Iterable, Sequence
from types import TracebackType
from typing import Any, Literal, NamedTuple, Protocol, TypeVar

#: Workers that a job may end before it is given up.
MOST_DEATHS = 3
# Characters of the longest error, two or three lines of a terminal.
_LONGEST = 280

T = TypeVar("T")
R = TypeVar("R")


class JobError(RuntimeError):
    """Raised when a job fails; the message says why."""


class ExecutorError(JobError):
    """Raised when no job can be made any more: workers cannot start, or the connection to a cluster is lost."""


class _TracebackError(Exception):
    """The traceback of a job that failed, perhaps in another process."""


class Outcome(NamedTuple):
    """What became of a job.

    Attributes
    ----------
    index : int
        Number of the job, from 0 in the order of the jobs.
    status : {"done", "failed", "died", "unsent"}
        "failed" if it raised; "died" if `MOST_DEATHS` workers ended in it; "unsent" if the function, the job or its
        result cannot be sent between processes.
    value : object
        Of a job that is done, its result; that failed, its error and its traceback as two texts; that died, the exit
        code of the last worker, or a text; that is unsent, the error as a text.
    """

    index: int  # type: ignore[assignment]  # hides the method of tuples
    status: Literal["done", "failed", "died", "unsent"]
    value: Any


class Executor(Protocol):
    """Runs jobs; a context manager whose end stops all workers."""

    @property
    def size(self) -> int:
        """Number of jobs that run at the same time."""

    def outcomes(self, function: Callable[[T], R], jobs: Iterable[T]) -> Generator[Outcome, None, None]:
        """Yield the outcome of ``function(job)`` of each job, as they end.

        Jobs are taken from the iterable only when workers will soon need them. Closing the generator cancels the jobs
        that are not done.

        Parameters
        ----------
        function : callable
            A function of a module, so that workers can import it.
        jobs : iterable
            Its arguments; jobs are started in this order.

        Raises
        ------
        ExecutorError
            If no further job can be made.
        """

    def __enter__(self) -> Executor: ...

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def results_of(
    executor: Executor,
    function: Callable[[T], R],
    jobs: Sequence[T],
    done: Callable[[int], None] = lambda index: None,
    describe: Callable[[T], str] = repr,
    keep: Callable[[int, R], None] = lambda index, result: None,
) -> list[R]:
    """Return ``[function(job) for job in jobs]``.

    Parameters
    ----------
    executor : Executor
        What runs the jobs.
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
        If a job raises, workers die in it, or it cannot be sent; all others are cancelled.
    """
    found: list[Any] = [None] * len(jobs)
    with contextlib.closing(executor.outcomes(function, jobs)) as outcomes:
        for index, status, value in outcomes:
            if status == "died":
                job = shortened(describe(jobs[index]), _LONGEST - 110)
                raise JobError(f"{_death(value)} in {job}{_cure(value)}")
            if status == "failed":
                text, trace = value
                raise JobError(shortened(text, _LONGEST)) from _TracebackError(trace)
            if status == "unsent":
                job = shortened(describe(jobs[index]), _LONGEST // 2)
                raise JobError(f"{shortened(value, _LONGEST // 2)} (in {job}); {_IMPORTABLE}")
            found[index] = value
            keep(index, value)
            done(index)
    return found


# Pickling has its own errors, which name what cannot be sent and not what to do.
_IMPORTABLE = "what workers get and return must be picklable: define functions in a module, or give workers=1"


def _death(value: object) -> str:
    """Return what happened to the workers of a job."""
    return f"{MOST_DEATHS} workers ended with exit code {value}" if isinstance(value, int) else str(value)


def _cure(code: object) -> str:
    """Return what to do about workers that a signal ended."""
    return "; if memory ran out, use fewer workers" if isinstance(code, int) and code < 0 else ""


def start_cure(code: int | None) -> str:
    """Return what to do about a worker that ended before its first job."""
    # A worker imports the script of its parent first.
    script = 'a script that starts workers must be a file and do so under if __name__ == "__main__":'
    return f"; {script}" if code == 1 else _cure(code)


def shortened(text: str, longest: int) -> str:
    """Return a text on one line, without the middle of a long one."""
    return without_middle(" ".join(text.split()), longest)


def without_middle(text: str, longest: int) -> str:
    """Return a text without the middle of a long one: errors begin and end with what matters."""
    return text if len(text) <= longest else f"{text[: longest * 2 // 3]} … {text[-(longest // 3) + 3 :]}"
