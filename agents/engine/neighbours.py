"""Relations: one group observes others within a range. Percepts are made from relations."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.failures import check_places
from teamsight.agents.group import Group, team_of
from teamsight.agents.resolve import check_fit
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.world.arena import Arena
from teamsight.world.proximity.search import Search

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.world_data import WorldData


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
        self, kind: str, observers: Group, observed: list[Group], reach: npt.NDArray[np.float64], arena: Arena
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

    def observers_of(self, agent: Body) -> list[Any]:
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


def connect(data: WorldData, sensed: list[tuple[Group, Group]]) -> list[Relation]:
    """Return the relations of a world, given pairs (observers, observed), and set those of each group.

    Raises
    ------
    ValueError
        If an agent is outside the arena, or a policy does not fit its degree of awareness. No group is changed then.
    """
    check_places(data)
    teams = {group.number: team_of(data.groups, group) for group in data.groups}
    for group in data.groups:
        check_fit(group, teams[group.number])
    relations = []
    for group in data.groups:
        group.relations = {}
        targets = [observed for observers, observed in sensed if observers is group]
        for kind, others, reach in (
            ("targets", targets, group.sensing_range),
            ("teammates", teams[group.number], group.awareness_range),
        ):
            if others:
                group.relations[kind] = Relation(kind, group, others, reach, data.arena)
                relations.append(group.relations[kind])
    return relations
