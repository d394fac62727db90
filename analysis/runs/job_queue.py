"""Jobs on their way to worker processes: which wait, and in which how many workers have ended."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from typing import Any

from teamsight.analysis.runs.executor import MOST_DEATHS, Outcome
from teamsight.analysis.runs.taken_jobs import TakenJobs
from teamsight.analysis.runs.worker_process import packed


class JobQueue(TakenJobs):
    """Jobs for worker processes, of which those wait that are sent next; the parameters are those of `TakenJobs`."""

    def __init__(self, function: Callable[[Any], Any], jobs: Iterable[Any]) -> None:
        super().__init__(function, jobs, packed)
        self._waiting: deque[int] = deque()
        self._deaths: Counter[int] = Counter()

    def take(self, count: int) -> None:
        """Take jobs until `count` wait."""
        while len(self._waiting) + len(self._unsent) < count and not self._is_exhausted:
            if (index := self._next()) is not None:
                self._waiting.append(index)

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
