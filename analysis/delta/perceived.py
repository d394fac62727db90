"""Numbers of neighbours that robots perceive: those at their decisions only, for robots that sense now and then."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from teamsight.agents.teammates import of_team
from teamsight.analysis.teams import team_graph

if TYPE_CHECKING:
    from teamsight.agents.group import Group
    from teamsight.agents.world import World

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
    Neighbours are counted after all events that precede a step, in whatever order these were planned: robots perceive
    what there is then. Neighbours are those of `CountDegrees`.
    """
    found: dict[tuple[str, str], tuple[Ints, int]] = {}

    def count(model: World) -> None:
        degree, row = team_graph(model, team).degree, 0
        for group in of_team(model.groups, team):
            found[group.name, str(group.team)] = degree[row : row + len(group)].copy(), model.tick
            row += len(group)

    world.recording.before_steps.append(count)
    try:
        with warnings.catch_warnings():
            # Single steps of robots that sense rarely have no decision.
            warnings.filterwarnings("ignore", "none of .* decides before", UserWarning)
            for _ in range(steps):
                if not world.running:
                    return
                found.clear()
                world.run(1)
                _note(of_team(world.groups, team), found, largest)
    finally:
        world.recording.before_steps.remove(count)


def _note(
    groups: Iterable[Group[Any]],
    found: dict[tuple[str, str], tuple[Ints, int]],
    largest: dict[tuple[str, str], int],
) -> None:
    """Raise the largest numbers by those of the robots that decided in the step since the count."""
    for group in groups:
        name = group.name, str(group.team)
        if name in found:
            degree, tick = found[name]
            largest[name] = max(largest.get(name, 0), int(degree[group.decided_at == tick].max(initial=0)))
