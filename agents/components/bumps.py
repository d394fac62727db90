"""Bumps as events: when the way of an agent becomes blocked by another body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.records import Bound
from teamsight.agents.events.sources import Watching
from teamsight.core.kernel import Entry, Record

Integers = npt.NDArray[np.int64]


class BumpsArrays(NamedTuple):
    """The record of what is watched: the bumps of all agents of a group, and those that have been logged."""

    bumps: Annotated[Integers, "n"]
    logged: Annotated[Integers, "n"]


BUMPS = Record(BumpsArrays)
bumps_at = BUMPS.at


def _watch(address: int) -> int:
    here = bumps_at(address)
    for i in range(here.bumps.shape[0]):
        if here.bumps[i] != here.logged[i]:
            return 1
    return 0


WATCH_BUMPS = Entry(_watch)


@dataclass(eq=False, repr=False)
class Bumps(Watching):
    """Logs an event "bumped" when the way of an agent becomes blocked by another body, which it was not before.

    `Body.bumps` counts the same; see `World` for when bodies meet.

    Raises
    ------
    ValueError
        When attached, if the bodies of the group meet nobody.
    """

    entry = WATCH_BUMPS

    def check(self) -> None:
        """Refuse a group that can have no bumps."""
        group = self._its_group()
        if group not in self.world._data.solid:
            raise ValueError(
                f"attach(Bumps(), {group.name}): these bodies meet nobody; give them a radius and let the world have "
                "contacts, as in World(arena, contact='slide') and world.add(…, radius=0.1)"
            )

    def bind(self, bound: Bound) -> None:
        """Take all bumps so far for logged: each was logged after the step in which it was."""
        bumps = self._its_group().bodies.bumps
        self.record = BUMPS.pack(BumpsArrays(bumps, bumps.copy()))

    def happened(self) -> None:
        """Log the bumps of the last step."""
        bumps, logged = self.record.value
        for row in np.flatnonzero(bumps != logged):
            self.log("bumped", self._its_group()[int(row)])
        logged[:] = bumps
