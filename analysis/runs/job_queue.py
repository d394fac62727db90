"""Jobs on their way to worker processes: which wait, and in which how many workers have ended."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from typing import Any

from teamsight.analysis.runs.executor import MOST_DEATHS, Outcome
from teamsight.analysis.runs.worker_process import packed, said


class JobQueue:
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
        self._waiting: deque[int] = deque()
        # The messages of jobs without an outcome, for another worker if one dies.
        self._messages: dict[int, bytes] = {}
        self._deaths: Counter[int] = Counter()
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

    def take(self, count: int) -> None:
        """Take jobs until `count` wait."""
        while len(self._waiting) + len(self._unsent) < count and not self._is_exhausted:
            index, job = next(self._jobs, (None, None))
            if index is None:
                self._is_exhausted = True
                return
            try:
                self._messages[index] = packed(self._function, job)
            except Exception as error:
                self._unsent.append(Outcome(index, "unsent", said(error)))
            else:
                self._waiting.append(index)

    def unsent(self) -> list[Outcome]:
        """Remove and return the outcomes of jobs that were taken and cannot be sent."""
        found, self._unsent = self._unsent, []
        return found

    def first(self) -> tuple[int, bytes] | None:
        """Remove and return the first job that waits, and its message."""
        if not self._waiting:
            return None
        index = self._waiting.popleft()
        return index, self._messages[index]

    def put_back(self, index: int) -> None:
        """Let a job wait again, before all others."""
        self._waiting.appendleft(index)

    def end(self, index: int, status: Any, value: Any) -> Outcome:
        """Return the outcome of a job, which is not made again."""
        del self._messages[index]
        del self._deaths[index]
        return Outcome(index, status, value)

    def death(self, index: int, code: int | None) -> Outcome | None:
        """Let a job in which a worker ended be made again; return its outcome if too many have ended in it."""
        self._deaths[index] += 1
        if self._deaths[index] >= MOST_DEATHS:
            return self.end(index, "died", code)
        self.put_back(index)
        return None
