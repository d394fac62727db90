"""Sets of runs as columns: a million runs are two arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class RunSet(NamedTuple):
    """Distinct runs, in ascending order of setting and replicate.

    Attributes
    ----------
    ids : ndarray, shape (N,), uint64
        Id of the setting of each run.
    replicates : ndarray, shape (N,), int64
        Number of each run of its setting.
    """

    ids: NDArray[np.uint64]
    replicates: NDArray[np.int64]

    @classmethod
    def of(cls, ids: NDArray[np.uint64], replicates: NDArray[np.int64]) -> RunSet:
        """Return the distinct runs among these, in order."""
        order = np.lexsort((replicates, ids))
        ids, replicates = ids[order], replicates[order]
        first = np.ones(len(ids), bool)
        first[1:] = (ids[1:] != ids[:-1]) | (replicates[1:] != replicates[:-1])
        return cls(ids[first], replicates[first])

    @classmethod
    def empty(cls) -> RunSet:
        """Return no runs."""
        return cls(np.empty(0, np.uint64), np.empty(0, np.int64))

    @property
    def size(self) -> int:
        """The number of runs."""
        return len(self.ids)

    def without(self, others: RunSet) -> RunSet:
        """Return the runs that are not among `others`."""
        both = (np.concatenate(columns) for columns in zip(others, self, strict=True))
        ids, replicates = both
        # Of equal runs, a stable order has the one of `others` first.
        order = np.lexsort((replicates, ids))
        ids, replicates = ids[order], replicates[order]
        kept = order >= others.size
        kept[1:] &= (ids[1:] != ids[:-1]) | (replicates[1:] != replicates[:-1])
        return RunSet(ids[kept], replicates[kept])

    def names(self, most: int | None = None) -> list[str]:
        """Return the run ids, at most `most` of them."""
        rows = zip(self.ids[:most].tolist(), self.replicates[:most].tolist(), strict=True)
        return [f"{setting:016x}-{replicate}" for setting, replicate in rows]
