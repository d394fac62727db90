"""The agents of a world that are on a team, and their neighbours, as flat arrays for analyses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.relation import Relation, needs_detection
from teamsight.agents.group import Group
from teamsight.agents.sensing.sensor import Sensor
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class Teammates(NamedTuple):
    """The agents that are on a team, in the order of the world's groups. The arrays are copies.

    Attributes
    ----------
    team : ndarray, shape (n,), int64
        Team numbers. Teams are numbered from 0 in the order of their first groups.
    identity : ndarray, shape (n,), int64
        Their `unique_id`.
    position : ndarray, shape (n, 2), float64
        Positions [length].
    heading : ndarray, shape (n, 2), float64
        Unit vectors.
    speed : ndarray, shape (n,), float64
        The largest distance that each can move in a step [length].
    awareness_range : ndarray, shape (n,), float64
        Distance within which each senses its teammates [length].
    """

    team: npt.NDArray[np.int64]
    identity: npt.NDArray[np.int64]
    position: Floats
    heading: Floats
    speed: Floats
    awareness_range: Floats

    @property
    def sizes(self) -> npt.NDArray[np.int64]:
        """The number of agents in each team, shape (teams,)."""
        return np.bincount(self.team)

    @property
    def largest_team(self) -> int:
        """The size of the largest team; 0 without agents."""
        return int(self.sizes.max(initial=0))


def on_teams(groups: Iterable[Group]) -> list[Group]:
    """Return the groups that are on a team."""
    return [group for group in groups if group.team is not None]


def of_team(groups: Iterable[Group], team: str | None) -> list[Group]:
    """Return the groups of a team, or for None those of all teams."""
    return [group for group in on_teams(groups) if team in (None, group.team)]


def team_names(groups: Iterable[Group]) -> list[str]:
    """Return the names of the teams, in the order of their first groups."""
    return list(dict.fromkeys(group.team for group in groups if group.team is not None))


def teammates(groups: list[Group]) -> Teammates:
    """Return all agents that are on a team."""
    teams = on_teams(groups)
    names = list(dict.fromkeys(group.team for group in teams))
    bodies = [group.bodies for group in teams]
    empty, no_points = np.zeros(0), np.zeros((0, 2))
    return Teammates(
        np.concatenate([np.full(len(group), names.index(group.team)) for group in teams] or [empty.astype(np.int64)]),
        np.concatenate([body.identity for body in bodies] or [empty.astype(np.int64)]),
        np.concatenate([body.position for body in bodies] or [no_points]),
        np.concatenate([body.heading for body in bodies] or [no_points]),
        np.concatenate([body.speed for body in bodies] or [empty]),
        np.concatenate([body.awareness_range for body in bodies] or [empty]),
    )


def _joined(groups: list[Group], lists: Callable[[Relation], tuple[Integers, Integers]]) -> tuple[Integers, Integers]:
    """Return the lists of all that are on a team by the rows of `teammates`; `lists` returns those of a relation."""
    teams = on_teams(groups)
    ends = np.cumsum([0, *map(len, teams)])
    rows = {group.number: np.arange(*ends[at : at + 2]) for at, group in enumerate(teams)}
    starts, index, edges = [np.zeros(1, np.int64)], [np.zeros(0, np.int64)], 0
    for group in teams:
        relation = group.relations[TEAMMATES]
        start, found = lists(relation)
        # The relation numbers the agents of this team only.
        row_of = np.concatenate([rows[other.number] for other in relation.observed])
        starts.append(edges + start[1:])
        index.append(row_of[found[: start[-1]]])
        edges += int(start[-1])
    return np.concatenate(starts), np.concatenate(index)


def neighbours(groups: list[Group]) -> NeighbourList:
    """Return the neighbours of each of `teammates`, by row: agents of its team within its awareness range."""
    graphs = [group.relations[TEAMMATES].graph for group in on_teams(groups)]
    start, index = _joined(groups, lambda relation: (relation.graph.start, relation.graph.identity))
    offset = np.concatenate([np.zeros((0, 2)), *(graph.offset for graph in graphs)])
    return NeighbourList(start, index, offset, np.concatenate([np.zeros(0), *(graph.distance for graph in graphs)]))


def are_all_sensed(groups: list[Group], arena: Arena) -> bool:
    """Return whether all robots sense every neighbour: whether no sensor and no obstacle keeps them from it.

    A robot whose sensor is out of order has no neighbours.
    """
    channels = [group.channels[TEAMMATES] for group in on_teams(groups)]
    return not any(needs_detection(channel.sensor or Sensor(), arena) for channel in channels)


def sensed_teammates(groups: list[Group], arena: Arena) -> NeighbourList:
    """Return whom each of `teammates` really senses, by row: its neighbours that the sensor of its group detects.

    False detections are left out, and detections on their way to the percept are in. Offsets are the true ones.
    """
    start, index = _joined(groups, lambda relation: relation.true_lists)
    position = teammates(groups).position
    observer = np.repeat(np.arange(len(position)), np.diff(start))
    offset = arena.displacement(position[observer], position[index])
    return NeighbourList(start, index, offset, np.hypot(offset[:, 0], offset[:, 1]))
