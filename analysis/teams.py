"""The teams of a world: their groups, and the graph of the neighbours in one team or in all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.agents.teammates import neighbours, of_team, sensed_teammates, team_names
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.core.neighbour_list import NeighbourList


def team_graph(world: World, team: str | None = None, *, sensed: bool = False) -> NeighbourList:
    """Return the present neighbours of each robot, by row.

    Parameters
    ----------
    world : World
        The world.
    team : str, optional
        The team whose robots are the rows; by default those of all teams, the rows of `World.teammates`.
    sensed : bool
        Return only the neighbours that the robots' sensors detect; see `Group.sensors`.
    """
    groups = of_team(world.groups, team)
    for group in groups[:1]:
        group.host.find_neighbours()
    return sensed_teammates(groups, world.arena) if sensed else neighbours(groups)


def active_team_graph(world: World, team: str | None = None, *, sensed: bool = False) -> NeighbourList:
    """Return the present neighbours of each active robot, by its row among the active ones; see `team_graph`.

    Parameters
    ----------
    world, team, sensed
        See `team_graph`.
    """
    graph = team_graph(world, team, sensed=sensed)
    active = np.concatenate([np.zeros(0, bool), *(group.active for group in of_team(world.groups, team))])
    if active.all():
        return graph
    # Others neither have neighbours nor are any.
    start = np.concatenate([[0], np.cumsum(graph.degree[active])])
    return graph._replace(start=start, identity=(np.cumsum(active) - 1)[graph.identity])


def check_team(world: World, team: str | None, what: str) -> None:
    """Raise an error if no group of a world is on a team, or none on this one.

    Parameters
    ----------
    world : World
        The world.
    team : str or None
        The name of a team; None for any.
    what : str
        What to call the world in the error.

    Raises
    ------
    ValueError
        Naming the teams that there are.
    """
    names = team_names(world.groups)
    if not names:
        raise ValueError(
            f"{what}: no group is on a team at tick {world.tick}, so no agent has neighbours; add a group of Robot, or "
            "give World.add a team"
        )
    if team is not None and team not in names:
        known = ", ".join(map(repr, names))
        missing = f"team={checks.shown(team)}: no group of {what} is on it at tick {world.tick}"
        raise ValueError(f"{missing}; known are {known}")
