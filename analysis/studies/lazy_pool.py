"""A worker pool that starts when there is work: a study that is complete needs none."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from types import TracebackType
from typing import TYPE_CHECKING, TypeVar

from teamsight.analysis.runs.simulate import IMPORTS
from teamsight.analysis.runs.workers import WorkerPool, check_workers, cores

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Outcome

# Work of one process that others would not shorten, since they import everything anew [s].
_SHORT = 5.0

T = TypeVar("T")
R = TypeVar("R")


def workers_for(seconds: float | None) -> int:
    """Return the number of workers for work that takes one of them so long [s]; None if that is not known."""
    return 1 if seconds is not None and seconds < _SHORT else cores()


class LazyPool:
    """An `Executor` of worker processes on this machine, which start with the first jobs.

    Parameters
    ----------
    workers : int
        Number of processes; with 1 all jobs run in this one.
    emit : callable
        Called with each message of a job.

    Attributes
    ----------
    size : int
        Number of processes.
    """

    def __init__(self, workers: int, emit: Callable[[str], object]) -> None:
        self.size = check_workers(workers)
        self._emit = emit
        self._pool: WorkerPool | None = None

    def __enter__(self) -> LazyPool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.__exit__(kind, value, trace)

    def outcomes(self, function: Callable[[T], R], jobs: Iterable[T]) -> Generator[Outcome, None, None]:
        """Return the outcomes of jobs as they end; see `Executor`."""
        if self._pool is None:
            self._pool = WorkerPool(self.size, (*IMPORTS, "teamsight.analysis.studies.shard"), self._message)
        return self._pool.outcomes(function, jobs)

    def _message(self, text: str) -> None:
        self._emit(text)
