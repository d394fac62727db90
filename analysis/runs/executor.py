"""Executors: what runs jobs, and the results of jobs in their order.

An executor calls a function with each of many jobs, in this process, in a pool of processes or on a cluster, and yields
what became of each. `teamsight.analysis.runs.processes.WorkerPool` is one.
"""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Sequence
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
    """Runs jobs; a context manager whose end stops all workers.

    Attributes
    ----------
    shard : (int, int) or None
        Of jobs whose results are kept, `teamsight.analysis.runs.simulate.run_all` makes part i of n only.
    """

    shard: tuple[int, int] | None

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


Attempted = tuple[Literal["done", "failed"], Any]


def attempt(function: Callable[[Any], Any], job: Any, errors: type[BaseException] = Exception) -> Attempted:
    """Make a job: return "done" with its result, or "failed" with an error and its traceback.

    Parameters
    ----------
    function, job : callable, object
        What to call, and with what.
    errors : type
        Which exceptions are failures of the job. Where a job must not end the process, that is every one.
    """
    try:
        return "done", function(job)
    except errors as error:
        return "failed", (str(error) or type(error).__name__, f"\n{traceback.format_exc()}")


def _drop(text: str) -> None:
    pass


_emit: Callable[[str], object] = _drop


def emit(text: str) -> None:
    """Send a message from within a job to the process that owns the executor."""
    _emit(text)


def _forget(part: object, done: int) -> None:
    pass


_advance: Callable[[Hashable, int], None] = _forget


def advance(part: Hashable, done: int) -> None:
    """Report from within a job how much of it is done, to the process that owns the executor.

    Parameters
    ----------
    part : hashable
        What is being made; a later report about the same replaces this one. It can be pickled.
    done : int
        How much of it is done.
    """
    _advance(part, done)


@contextlib.contextmanager
def advancing(on_advance: Callable[[Hashable, int], None]) -> Iterator[None]:
    """Pass what jobs report within the block to a function; jobs on a cluster report nothing."""
    global _advance
    before, _advance = _advance, on_advance
    try:
        yield
    finally:
        _advance = before


def receiver() -> Callable[[str], object]:
    """Return what receives the messages that are emitted now."""
    return _emit


@contextlib.contextmanager
def emitting(on_message: Callable[[str], object]) -> Iterator[None]:
    """Pass messages that are emitted within the block to a function."""
    global _emit
    before, _emit = _emit, on_message
    try:
        yield
    finally:
        _emit = before


class TakenJobs:
    """The jobs of one call, each from where it is taken until its outcome.

    Parameters
    ----------
    function : callable
        What each job is an argument of.
    jobs : iterable
        The jobs, from which one is taken only when it will soon be needed.
    pack : callable
        Returns the message of a function and a job.
    """

    def __init__(
        self,
        function: Callable[[Any], Any],
        jobs: Iterable[Any],
        pack: Callable[[Callable[[Any], Any], Any], bytes],
    ) -> None:
        self._function, self._pack = function, pack
        self._jobs = iter(enumerate(jobs))
        # The messages of jobs without an outcome, for another worker if one dies.
        self._messages: dict[int, bytes] = {}
        self._unsent: list[Outcome] = []
        self._is_exhausted = False

    @property
    def open_jobs(self) -> int:
        """Number of jobs that were taken and have no outcome."""
        return len(self._messages)

    @property
    def is_empty(self) -> bool:
        """Whether all jobs were taken and have their outcome."""
        return self._is_exhausted and not self._messages

    def unsent(self) -> list[Outcome]:
        """Remove and return the outcomes of jobs that were taken and cannot be sent."""
        found, self._unsent = self._unsent, []
        return found

    def _next(self) -> int | None:
        """Take a job and return its index; None if there are no more, or it cannot be sent."""
        index, job = next(self._jobs, (None, None))
        if index is None:
            self._is_exhausted = True
            return None
        try:
            self._messages[index] = self._pack(self._function, job)
        except Exception as error:
            self._unsent.append(Outcome(index, "unsent", said(error)))
            return None
        return index


def said(error: Exception) -> str:
    """Return what an error says, or its name."""
    return str(error) or type(error).__name__
