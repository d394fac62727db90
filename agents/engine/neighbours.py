"""A relation: one group observes others within a range. Percepts are made from relations."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.world.arena import Arena
from teamsight.world.bodies import Bodies
from teamsight.world.proximity.search import Search


class Members(Protocol):
    """The part of `Group` that a relation uses."""

    number: int
    team: str | None
    bodies: Bodies
    agents: list[Any]

    def __len__(self) -> int: ...


class Relation:
    """Which agents of the observed groups are within the range of each observer.

    Parameters
    ----------
    kind : {"targets", "teammates"}
        The role of the observed.
    observers : Group
        The group that observes.
    observed : list of Group
        The groups that are observed, in this order.
    reach : ndarray, shape (n,), float64
        The range of each observer [length].
    arena : Arena
        The arena.

    Attributes
    ----------
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
