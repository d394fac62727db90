"""Divides the missing runs of a study into shards of about a second's work."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.shard import Common, Shard

if TYPE_CHECKING:
    from teamsight.analysis.studies.plan import Plan

# Work of a shard [s], and of the first ones, as long as the rate is not known.
_SECONDS, _FIRST_SECONDS = 1.0, 0.25
# Work of a shard at the end, so that all workers end together [s].
_LEAST_SECONDS = 0.1
# Shards into which what is left is divided for each worker.
_SHARDS_PER_WORKER = 4
# Cost per second of CMOMMT, as `Run.cost` counts it, until it is measured; other models begin with single runs.
_RATE = 800_000.0
# Runs of a shard: each is a row in memory.
_MOST_RUNS = 5_000
# Into how many pieces a shard is divided in which workers died.
_PIECES = 8
# Share of the last shard in the rate.
_WEIGHT = 0.5


class Missing(NamedTuple):
    """Runs to be made, in the order in which they are made.

    Attributes
    ----------
    settings : ndarray, shape (N,), int64
        Number of each run's setting in the plan.
    replicates : ndarray, shape (N,), int64
        Number of each run of its setting.
    """

    settings: NDArray[np.int64]
    replicates: NDArray[np.int64]


class Sharding:
    """An iterator over shards, whose size follows the measured rate.

    Parameters
    ----------
    plan : Plan
        The plan of the study.
    common : Common
        What all runs share.
    missing : Missing
        The runs.
    workers : int
        Number of shards that are made at the same time.
    rate : float or None
        Cost per second of one worker, as far as it is known.

    Attributes
    ----------
    rate : float or None
        Cost per second of one worker, measured.
    """

    def __init__(self, plan: Plan, common: Common, missing: Missing, workers: int, rate: float | None = None) -> None:
        self.rate = rate
        self._plan, self._common, self._missing, self._workers = plan, common, missing, workers
        self._next = 0
        self._again: deque[Shard] = deque()
        # Of one setting after the other, since neighbouring runs often share it.
        self._setting, self._parameters, self._cost = -1, dict[str, object](), 0.0
        self._left = self._cost_of_all()

    def __iter__(self) -> Iterator[Shard]:
        while self._again or self._next < len(self._missing.settings):
            yield self._again.popleft() if self._again else self._following()

    @property
    def is_empty(self) -> bool:
        """Whether each shard was taken."""
        return not self._again and self._next == len(self._missing.settings)

    def cost(self, shard: Shard) -> float:
        """Return the expected work of a shard."""
        raise NotImplementedError

    def measured(self, shard: Shard, seconds: float) -> None:
        """Take note of how long a shard took."""
        raise NotImplementedError

    def divide(self, shard: Shard) -> None:
        """Make a shard again in pieces, since workers died in it."""
        size = -(-len(shard.runs) // _PIECES)
        self._again.extend(
            Shard(shard.common, shard.runs[first : first + size]) for first in range(0, len(shard.runs), size)
        )

    def _following(self) -> Shard:
        raise NotImplementedError

    def _cost_of_all(self) -> float:
        return 0.0
