"""All agents of a world that are on a team, and who of them is whose neighbour, as flat arrays for analyses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.group import Group
from teamsight.core.neighbour_list import NeighbourList

Floats = npt.NDArray[np.float64]


class Teammates(NamedTuple):
    """All agents that are on a team, group by group in the order of the world's groups: copies, which do not change.

    Attributes
    ----------
    team : ndarray, shape (n,), int64
        The team of each: teams are numbered from 0 in the order of their first groups.
    identity : ndarray, shape (n,), int64
        Their `unique_id`.
    position : ndarray, shape (n, 2), float64
        Where they are [length].
    heading : ndarray, shape (n, 2), float64
        Which way they face: unit vectors.
    speed : ndarray, shape (n,), float64
        The farthest each can go a step [length].
    awareness_range : ndarray, shape (n,), float64
        How far each senses its teammates [length].
    """

    team: npt.NDArray[np.int64]
    identity: npt.NDArray[np.int64]
    position: Floats
    heading: Floats
    speed: Floats
    awareness_range: Floats

    @property
    def sizes(self) -> npt.NDArray[np.int64]:
        """How many agents each team has, shape (teams,)."""
        return np.bincount(self.team)

    @property
    def largest_team(self) -> int:
        """The size of the largest team; 0 without agents."""
        return int(self.sizes.max(initial=0))


def on_teams(groups: list[Group]) -> list[Group]:
    """Return the groups that are on a team."""
    return [group for group in groups if group.team is not None]


def teammates(groups: list[Group]) -> Teammates:
    """Return all agents that are on a team."""
    teams = on_teams(groups)
    names = list(dict.fromkeys(group.team for group in teams))
    bodies = [group.bodies for group in teams]
    nobody, nowhere = np.zeros(0), np.zeros((0, 2))
    return Teammates(
        np.concatenate([np.full(len(group), names.index(group.team)) for group in teams] or [nobody.astype(np.int64)]),
        np.concatenate([body.identity for body in bodies] or [nobody.astype(np.int64)]),
        np.concatenate([body.position for body in bodies] or [nowhere]),
        np.concatenate([body.heading for body in bodies] or [nowhere]),
        np.concatenate([body.speed for body in bodies] or [nobody]),
        np.concatenate([group.ranges[1] for group in teams] or [nobody]),
    )


def proximity(groups: list[Group]) -> NeighbourList:
    """Return who of `teammates` is within whose awareness range; edges join agents of one team only."""
    teams = on_teams(groups)
    if len(teams) == 1:
        graph = teams[0].relations["teammates"].graph
        return graph.copy()
    first, row = {}, 0
    for group in teams:
        first[group.number] = row
        row += len(group)
    start, index, offset, distance = [np.zeros(1, np.int64)], [np.zeros(0, np.int64)], [np.zeros((0, 2))], [np.zeros(0)]
    edges = 0
    for group in teams:
        relation = group.relations["teammates"]
        graph = relation.graph
        # The relation counts through the groups of this team only.
        rows = [first[other.number] + np.arange(len(other)) for other in relation.observed]
        start.append(edges + graph.start[1:])
        index.append(np.concatenate(rows)[graph.identity])
        offset.append(graph.offset)
        distance.append(graph.distance)
        edges += len(graph.identity)
    return NeighbourList(
        np.concatenate(start), np.concatenate(index), np.concatenate(offset), np.concatenate(distance)
    )
