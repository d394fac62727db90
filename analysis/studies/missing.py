"""The runs of a study that are still to be made."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from teamsight.analysis.studies.folder.run_set import RunSet
    from teamsight.analysis.studies.plan import Plan

# Settings whose runs are listed at a time.
_BLOCK = 1024
# Replicates that all settings get before any gets more, and how much more each time.
_FIRST, _GROWTH = 2, 4


class Selection:
    """Runs of a plan: one bit for each setting, in the order in which settings are run, and replicate.

    Parameters
    ----------
    plan : Plan
        The plan.
    needed : ndarray, shape (S,), int64
        Number of replicates of each setting.
    shard : (int, int), optional
        Only shard i of n, from 1. A study whose settings need different numbers of replicates is divided by settings.
    by_setting : bool
        Divide by settings.
    """

    def __init__(
        self, plan: Plan, needed: NDArray[np.int64], shard: tuple[int, int] | None = None, *, by_setting: bool = False
    ) -> None:
        self._plan, self._needed, self._shard, self._by_setting = plan, needed, shard, by_setting
        self._position = np.empty(plan.settings, np.int64)
        self._position[plan.order] = np.arange(plan.settings)
        most = int(needed.max(initial=0))
        self._is_selected: NDArray[np.bool_] = np.greater.outer(needed[plan.order], np.arange(most))
        if shard is not None:
            replicates = np.arange(most)
            for first in range(min(shard[1], plan.settings)):
                self._is_selected[first :: shard[1]] &= self._is_own(np.array(first), replicates)

    def _is_own(self, row: NDArray[np.int64], replicate: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether runs are in the shard: each has some replicates of each setting, so that all take about as long."""
        if self._shard is None:
            return np.ones(len(replicate), bool)
        part, parts = self._shard
        found: NDArray[np.bool_] = (row + replicate * (not self._by_setting)) % parts == part - 1
        return np.broadcast_to(found, replicate.shape)

    def keep(self, runs: RunSet) -> None:
        """Keep only these runs."""
        before = self._is_selected
        self._is_selected = before.copy()
        self.remove(runs)
        # What was removed is what is kept.
        self._is_selected = before & ~self._is_selected

    @property
    def size(self) -> int:
        """The number of runs."""
        return int(np.count_nonzero(self._is_selected))

    @property
    def settings(self) -> NDArray[np.bool_]:
        """Whether any run of each setting is selected, in the order of the plan."""
        has_any: NDArray[np.bool_] = np.logical_or.reduce(self._is_selected, axis=1)
        return has_any[self._position]

    def remove(self, runs: RunSet) -> int:
        """Remove runs; return how many were selected."""
        index = self._plan.index_of(runs.ids)
        within = (index >= 0) & (runs.replicates >= 0) & (runs.replicates < self._is_selected.shape[1])
        rows, columns = self._position[index[within]], runs.replicates[within]
        count = int(np.count_nonzero(self._is_selected[rows, columns]))
        self._is_selected[rows, columns] = False
        return count

    def beyond(self, runs: RunSet) -> int:
        """Return how many of these runs have a higher number than their setting needs now; they are kept."""
        index = self._plan.index_of(runs.ids)
        index, replicates = index[index >= 0], runs.replicates[index >= 0]
        is_own = self._is_own(self._position[index], replicates)
        return int(np.count_nonzero(is_own & (replicates >= self._needed[index])))

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Yield setting and replicate of each run, so that alike ones follow each other.

        First come a few replicates of all settings, so that what is there after an interruption shows all of them.
        """
        begin, end = 0, _FIRST
        while begin < self._is_selected.shape[1]:
            for first in range(0, len(self._is_selected), _BLOCK):
                rows, replicates = np.nonzero(self._is_selected[first : first + _BLOCK, begin:end])
                yield from zip(self._plan.order[first + rows].tolist(), (begin + replicates).tolist(), strict=True)
            begin, end = end, end * _GROWTH
