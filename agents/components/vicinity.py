"""Vicinity: the watcher that stops a run when an agent with a low battery has come to a charging place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.components.drain import ENOUGH, Drain
from teamsight.agents.engine.watching import Bound, Watcher
from teamsight.agents.group import Group
from teamsight.core.kernel import Entry, Record
from teamsight.core.neighbour_list import Filled

Integers = npt.NDArray[np.int64]


class VicinityArrays(NamedTuple):
    """The record of the agents that may need a charging place.

    Attributes
    ----------
    member : ndarray, shape (n,), int64
        The member of each row.
    level : ndarray, shape (members,), int64
        By member, the level of its battery.
    place : ndarray, shape (members,), int64
        Written: by member, the charging place at which it is, counted from 1; 0 for none.
    near : NeighbourList
        The charging places in range of each agent, by their indices.
    first, number : int
        The index of the first of these charging places, and how many there are.
    radius : float
        The distance within which an agent is at a place [length].
    """

    member: Annotated[Integers, "n"]
    level: Annotated[Integers, "members"]
    place: Annotated[Integers, "members"]
    near: Filled
    first: int
    number: int
    radius: float


VICINITY = Record(VicinityArrays)
_vicinity_at = VICINITY.at


def _find(address: int) -> int:
    here = _vicinity_at(address)
    has_come = 0
    for i in range(here.member.shape[0]):
        m = here.member[i]
        if here.level[m] != ENOUGH and here.place[m] == 0:
            least = here.radius
            for k in range(here.near.start[i], here.near.start[i + 1]):
                index = here.near.identity[k] - here.first
                if 0 <= index < here.number and here.near.distance[k] <= least:
                    least = here.near.distance[k]
                    here.place[m] = index + 1
                    has_come = 1
    return has_come


class Vicinity(Watcher):
    """Finds the agents of a group that have come to a charging place with a low battery.

    Parameters
    ----------
    group, places : Group
        The agents, and the charging places.
    channel : str
        The channel in which the agents sense the places.
    radius : float
        The distance within which an agent is at a place [length].
    drain : Drain
        The batteries.
    report : callable
        Called after a step in which an agent has come.

    Attributes
    ----------
    place : ndarray, shape (members,), int64
        As for `VicinityArrays`.
    """

    entry = Entry(_find)

    def __init__(
        self, group: Group, places: Group, channel: str, radius: float, drain: Drain, report: Callable[[], None]
    ) -> None:
        self._group, self._places, self._channel, self._radius = group, places, channel, radius
        self._drain, self._report = drain, report
        self.place = np.zeros(0, np.int64)
        self.make_room()

    def make_room(self) -> None:
        """Make room for the members that have come."""
        self._drain.make_room()
        self.place = np.append(self.place, np.zeros(len(self._drain.level) - len(self.place), np.int64))

    def release(self, member: int) -> None:
        """Forget where a member is, so that it is found again."""
        self.make_room()
        self.place[member] = 0

    def bind(self, bound: Bound) -> None:
        """Pack the record from the present arrays."""
        self.make_room()
        relation = bound.relation(self._group, self._channel)
        assert relation is not None
        first = self._group.relations[self._channel].first[self._places.number]
        self.record = VICINITY.pack(VicinityArrays(
            self._group.bodies.member, self._drain.level, self.place, relation.value.neighbours, first,
            len(self._places), self._radius,
        ))  # fmt: skip

    def happened(self) -> None:
        """Report who has come."""
        self._report()
