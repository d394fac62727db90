"""Numbers of neighbours that robots perceive: those at their decisions only, for robots that sense now and then."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from teamsight.agents.teammates import of_team
from teamsight.analysis.teams import team_graph

if TYPE_CHECKING:
    from teamsight.agents.model import World

Ints = NDArray[np.int64]


def run_perceiving(world: World, steps: int, team: str | None, largest: dict[tuple[str, str], int]) -> None:
    """Run a world step by step, and raise the largest numbers of neighbours at decisions.

    Parameters
    ----------
    world : World
        The world.
    steps : int
        Number of steps; fewer are made if the world stops.
    team : str or None
        The only team that counts; all do for None.
    largest : dict
        For (group, team) the largest number of neighbours of any robot when it decided.

    Notes
    -----
    Neighbours are counted by the last event before a step, after all others at that time: robots perceive what there is
    then. Sensors do not count, as elsewhere: neighbours are those within the awareness range.
    """
    found: dict[tuple[str, str], Ints] = {}

    def count() -> None:
        degree, row = team_graph(world, team).degree, 0
        for group in of_team(world.groups, team):
            found[group.name, str(group.team)] = degree[row : row + len(group)].copy()
            row += len(group)

    with warnings.catch_warnings():
        # Single steps of robots that sense rarely have no decision.
        warnings.filterwarnings("ignore", "none of .* decides before", UserWarning)
        for _ in range(steps):
            if not world.running:
                return
            tick = world.tick
            found.clear()
            world.clock.at(world.clock.now, count)
            world.run(1)
            for group in of_team(world.groups, team):
                name = group.name, str(group.team)
                if name in found:
                    deciding = found[name][group.decided_at == tick]
                    largest[name] = max(largest.get(name, 0), int(deciding.max(initial=0)))
