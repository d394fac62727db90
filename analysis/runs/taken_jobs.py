"""Jobs that are taken one by one, on their way to workers of any kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from teamsight.analysis.runs.executor import Outcome
from teamsight.analysis.runs.worker_process import said


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
