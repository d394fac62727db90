"""A relation: one group observes others within a range. Percepts are made from relations."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.world.arena import Arena
from teamsight.world.bodies import Bodies
from teamsight.world.proximity.search import Search


class Members(Protocol):
    """The part of `Group` that a relation uses; groups import this file."""

    number: int
    bodies: Bodies
    agents: list[Any]

    @property
    def team(self) -> str | None: ...
    def __len__(self) -> int: ...


class Relation:
    """Which agents of the observed groups are within the range of each observer.

    Attributes
    ----------
    kind : {"targets", "teammates"}
        The role of the observed.
    observers, observed : Group, list of Group
        The group that observes, and those that it observes, in this order.
    first : dict of int to int
        For each observed group's number, the index of its first agent among the observed.
    everyone : ndarray, shape (observed,), int64
        The identities of the observed.
    identity : ndarray, shape (k,), int64
        Room for the identities of all neighbours; the search itself finds indices among the observed.
    """

    def __init__(
        self, kind: str, observers: Members, observed: list[Any], reach: npt.NDArray[np.float64], arena: Arena
    ) -> None:
        self.kind, self.observers, self.observed = kind, observers, observed
        arena.check_reach(float(reach.max(initial=0.0)))
        sizes = [len(group) for group in observed]
        self.first = dict(zip((group.number for group in observed), np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
        self.everyone = np.concatenate([group.bodies.identity for group in observed])
        own = self.first.get(observers.number, -1)
        self.search = Search(observers.bodies.position, reach, len(self.everyone), own, arena)
        self.identity = np.zeros(len(self.search.room.identity), np.int64)

    def grow(self, edges: int) -> None:
        """Make room for at least this many neighbours; records must be bound again."""
        self.search.grow(edges)
        self.identity = np.zeros(len(self.search.room.identity), np.int64)

    def observed_by(self, row: int) -> list[Any]:
        """Return the agents within the range of an observer."""
        first = list(self.first.values())
        found = []
        for index in self.graph.identity[self.graph.start[row] : self.graph.start[row + 1]]:
            place = bisect_right(first, index) - 1
            found.append(self.observed[place].agents[index - first[place]])
        return found

    def observers_of(self, agent: Any) -> list[Any]:
        """Return the observers that have an agent in range."""
        if agent.group.number not in self.first:
            return []
        edges = np.flatnonzero(self.graph.identity == self.first[agent.group.number] + agent.row)
        rows = np.searchsorted(self.graph.start, edges, side="right") - 1
        return [self.observers.agents[row] for row in rows]

    @property
    def graph(self) -> NeighbourList:
        """The neighbours by their indices among the observed."""
        return self.search.graph

    @property
    def neighbours(self) -> NeighbourList:
        """The neighbours by their identities, as policies receive them."""
        return filled(self.room)

    @property
    def room(self) -> NeighbourList:
        """The whole arrays behind `neighbours`."""
        return self.search.room._replace(identity=self.identity)
