"""Executors: what runs jobs, and the results of jobs in their order.

An executor calls a function with each of many jobs, in this process, in a pool of processes or on a cluster, and yields
what became of each. `teamsight.analysis.runs.processes.WorkerPool` is one.
"""

from __future__ import annotations

import contextlib
import pickle
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from multiprocessing.reduction import ForkingPickler
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

    Raises
    ------
    JobError
        If a job raises, workers die in it, or it cannot be sent; all others are cancelled.
    """
    found: list[Any] = [None] * len(jobs)
    with contextlib.closing(executor.outcomes(function, jobs)) as outcomes:
        for outcome in outcomes:
            index = outcome.index
            if outcome.status != "done":
                raise error_of(outcome, describe(jobs[index]))
            found[index] = outcome.value
            done(index)
    return found


def error_of(outcome: Outcome, job: str) -> JobError:
    """Return the error for a job that is not done; `job` describes it."""
    if outcome.status == "died":
        return JobError(death(outcome.value, f" in {shortened(job, _LONGEST - 110)}"))
    if outcome.status == "failed":
        text, trace = outcome.value
        error = JobError(shortened(text, _LONGEST))
        error.__cause__ = _TracebackError(trace)
        return error
    # Pickling has its own errors, which name what cannot be sent and not what to do.
    return JobError(
        f"{shortened(outcome.value, _LONGEST // 2)} (in {shortened(job, _LONGEST // 2)}); what workers get and return "
        "must be picklable: define functions in a module, or give workers=1"
    )


def death(value: object, job: str = "", workers: str = f"{MOST_DEATHS} workers") -> str:
    """Return what happened to the workers of a job, and what to do about it."""
    if not isinstance(value, int):
        return f"{value}{job}"
    cure = "; if memory ran out, use fewer workers" if value < 0 else ""
    return f"{workers} ended with exit code {value}{job}{cure}"


def error_text(error: BaseException) -> str:
    """Return what an error says. Errors that are not meant to be read alone, such as a KeyError, are named."""
    name = type(error).__name__
    try:
        text = str(error)
    except Exception:
        text = "(its message cannot be shown)"
    if isinstance(error, (ValueError, TypeError, OSError, JobError)) and text:
        return text
    return f"{name}: {text}" if text else name


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


def packed(function: Callable[[Any], Any], job: Any) -> bytes:
    """Return the message that gives a job to a worker; raise an error of pickling if there is none."""
    return bytes(ForkingPickler.dumps((function, job)))


def made(message: bytes) -> tuple[str, Any]:
    """Make the job of a message, in a worker: return its status and its value; see `Outcome`."""
    try:
        function, job = pickle.loads(message)
    except Exception as error:
        # A function that this process cannot import, such as one of a notebook.
        return "unsent", error_text(error)
    return attempt(function, job, BaseException)


class _Channel:
    """What jobs send to the process that owns the executor."""

    def __init__(self) -> None:
        self.receive: Callable[..., object] = lambda *values: None

    def send(self, *values: Any) -> None:
        self.receive(*values)

    @contextlib.contextmanager
    def passed_to(self, receive: Callable[..., object]) -> Iterator[None]:
        before, self.receive = self.receive, receive
        try:
            yield
        finally:
            self.receive = before


#: Messages of jobs, as ``emit(text)`` sends them, and what receives them within ``with emitting(receive):``.
messages = _Channel()
emit, emitting = messages.send, messages.passed_to
_reports = _Channel()
#: Report from within a job, as ``advance(part, done)``, how much of it is done; what is made, `part`, can be pickled,
#: and a later report about the same replaces this one. They are received within ``with advancing(receive):``; jobs on
#: a cluster report nothing.
advance, advancing = _reports.send, _reports.passed_to


class TakenJobs:
    """The jobs of one call, each from where it is taken until its outcome.

    Parameters
    ----------
    function : callable
        What each job is an argument of.
    jobs : iterable
        The jobs, from which one is taken only when it will soon be needed.
    """

    def __init__(self, function: Callable[[Any], Any], jobs: Iterable[Any]) -> None:
        self._function = function
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
            self._messages[index] = packed(self._function, job)
        except Exception as error:
            self._unsent.append(Outcome(index, "unsent", error_text(error)))
            return None
        return index

    def end(self, index: int, status: Any, value: Any) -> Outcome:
        """Return the outcome of a job, which is not made again."""
        del self._messages[index]
        return Outcome(index, status, value)
