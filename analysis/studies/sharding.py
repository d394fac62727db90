"""Divides the missing runs of a study into shards of about a second's work."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from teamsight.analysis.studies.definition.values import hex_of
from teamsight.analysis.studies.shard import Common, Shard
from teamsight.analysis.studies.shard_run import ShardRun

if TYPE_CHECKING:
    from teamsight.analysis.studies.missing import Selection
    from teamsight.analysis.studies.plan import Plan

# Work of a shard [s], and of the first ones, as long as the rate is not known.
_SECONDS, _FIRST_SECONDS = 1.0, 0.25
# The least work of a shard at the end, where shards are smaller so that all workers end together [s].
_LEAST_SECONDS = 0.1
# Shards into which what is left is divided for each worker.
_SHARDS_PER_WORKER = 4
# Cost per second of CMOMMT, as `Run.cost` counts it, until it is measured. Other models begin with single runs.
_RATES = {"cmommt": 800_000.0}
# Runs of a shard: each is a row in memory.
_MOST_RUNS = 5_000
# Into how many pieces a shard is divided in which workers died.
_PIECES = 8
# Share of the last shard in a rate that rises.
_WEIGHT = 0.5
# The most runs per second where all have failed.
_MOST_FAILING = 100.0
# Settings whose cost is looked at, to estimate how long a study takes.
_MOST_EXAMINED = 100


def expected_seconds(plan: Plan, replicates: int) -> float | None:
    """Return about how long one worker takes for all runs of a study [s]; None for a model that is not known.

    Parameters
    ----------
    plan : Plan
        The plan of the study.
    replicates : int
        Replicates of each setting.
    """
    rate = _RATES.get(plan.study.model)
    if rate is None:
        return None
    count = min(plan.settings, _MOST_EXAMINED)
    examined = [plan.settings * number // count for number in range(count)]
    return sum(map(plan.cost, examined)) / count * plan.settings * replicates / rate


class Sized(NamedTuple):
    """A shard and its expected work, in the unit of `Run.cost`."""

    shard: Shard
    cost: float


class Sharding:
    """An iterator over shards, whose size follows the measured rate.

    Parameters
    ----------
    plan : Plan
        The plan of the study.
    common : Common
        What all runs share.
    missing : Selection
        The runs, in the order in which they are made.
    workers : int
        Number of shards that are made at the same time.
    rate : float, optional
        Cost per second of one worker, as far as it is known.

    Attributes
    ----------
    rate : float or None
        Cost per second of one worker as it was measured last.
    """

    def __init__(self, plan: Plan, common: Common, missing: Selection, workers: int, rate: float | None = None) -> None:
        self.rate = rate
        self._plan, self._common, self._workers = plan, common, workers
        self._left = missing.size
        self._runs = iter(missing)
        self._again: deque[Sized] = deque()
        # Of one setting after the other, since neighbouring runs often share it.
        self._setting, self._id, self._parameters, self._cost = -1, "", dict[str, object](), 1.0

    def __iter__(self) -> Iterator[Sized]:
        while not self.is_empty:
            yield self._again.popleft() if self._again else self._following()

    @property
    def is_empty(self) -> bool:
        """Whether each shard was taken."""
        return not self._again and not self._left

    def measured(self, sized: Sized, seconds: float, done: int) -> None:
        """Take note of how long a shard took [s], and of how many of its runs did not fail."""
        runs = len(sized.shard.runs)
        rate = sized.cost / max(seconds, 1e-6)
        # Runs that fail at once do not show how long others take.
        rate = rate * done / runs if done else min(rate, sized.cost / runs * _MOST_FAILING)
        # Shards that take too long cost more than short ones: what they have made is lost in an interruption.
        if self.rate is None or rate < self.rate:
            self.rate = rate
        else:
            self.rate += _WEIGHT * (rate - self.rate)

    def know(self, common: Common) -> None:
        """Give further shards what all runs share."""
        self._common = common

    def repeat(self, sized: Sized) -> None:
        """Make a shard again, with what all runs share now."""
        self._again.append(Sized(Shard(self._common, sized.shard.runs), sized.cost))

    def divide(self, sized: Sized) -> None:
        """Make a shard again in pieces."""
        (common, runs), cost = sized
        size = -(-len(runs) // _PIECES)
        for first in range(0, len(runs), size):
            piece = runs[first : first + size]
            self._again.append(Sized(Shard(common, piece), cost * len(piece) / len(runs)))

    def _following(self) -> Sized:
        """Return the next shard of runs that were not taken yet."""
        runs: list[ShardRun] = []
        cost, room, most = 0.0, 0.0, _MOST_RUNS
        if self.rate is None and self._workers > 1:
            # Runs may take much longer than expected, with a slow measure: each worker shall have some.
            most = min(most, -(-self._left // (_SHARDS_PER_WORKER * self._workers)))
        while self._left and len(runs) < most and (not runs or cost < room):
            setting, replicate = next(self._runs)
            if setting != self._setting:
                self._turn_to(setting)
            if not runs:
                room = self._room()
            runs.append(ShardRun(self._id, replicate, self._plan.seed(setting, replicate), self._parameters))
            cost += self._cost
            self._left -= 1
        return Sized(Shard(self._common, tuple(runs)), cost)

    def _turn_to(self, setting: int) -> None:
        plan = self._plan
        self._setting, self._id = setting, hex_of(plan.ids[setting])
        self._parameters = plan.parameters(setting)
        # A component that cannot be made is an error of the run, not of the sweep.
        with contextlib.suppress(Exception):
            self._cost = plan.cost(setting)

    def _room(self) -> float:
        """Return the cost of the next shard, which begins with a run of the present setting."""
        rate = self.rate or _RATES.get(self._common.model)
        if rate is None:
            return 0.0
        seconds = _SECONDS if self.rate else _FIRST_SECONDS
        if self._workers > 1:
            share = self._left * self._cost / rate / (_SHARDS_PER_WORKER * self._workers)
            seconds = min(seconds, max(share, _LEAST_SECONDS))
        return seconds * rate
