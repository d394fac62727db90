"""The conditions that a prediction of degrees rests on: how many robots, how far they sense, how fast they move."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from teamsight.analysis.delta import closed_form
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.world.arena import Disc

if TYPE_CHECKING:
    from teamsight.agents.model import World


class Conditions(NamedTuple):
    """The conditions in one world at one time.

    ``robots`` is the size of the largest team, ``teams`` the number of teams with robots. ``awareness_range`` is None
    where robots differ, ``radius`` where the arena is no disc. ``speed`` is the root mean square over robots.
    """

    robots: int
    teams: int
    awareness_range: float | None
    radius: float | None
    speed: float


def conditions(world: World) -> Conditions:
    """Return the present conditions of a world."""
    members = world.teammates
    reach = members.awareness_range
    return Conditions(
        robots=members.largest_team,
        teams=int(np.count_nonzero(members.sizes)),
        awareness_range=float(reach[0]) if len(reach) and reach.min() == reach.max() else None,
        radius=world.arena.radius if isinstance(world.arena, Disc) else None,
        speed=float(np.sqrt(np.mean(np.square(members.speed)))) if len(members.speed) else 0.0,
    )


def awareness_range(met: set[Conditions]) -> float | None:
    """Return the one range of all robots, or None if there are several."""
    reaches = {one.awareness_range for one in met if one.robots}
    return reaches.pop() if len(reaches) == 1 else None


def predict(met: set[Conditions], size: int, steps: int) -> Prediction | None:
    """Return the closed form for one run, or None where it does not apply.

    Parameters
    ----------
    met : set of Conditions
        Those before and after each run.
    size : int
        The size of the largest team.
    steps : int
        T, the length of a run.

    Notes
    -----
    The form is for one team in a disc that stays as it is; so the conditions must all be the same.
    """
    if len(met) > 1:
        return None
    (same,) = met
    if same.radius is None or same.awareness_range is None or (same.robots, same.teams) != (size, 1):
        return None
    return closed_form.predict(size, same.radius, steps=steps, awareness_range=same.awareness_range, speed=same.speed)


def notes(met: set[Conditions], size: int) -> tuple[str, ...]:
    """Return what a reader must know of the teams to understand N.

    Parameters
    ----------
    met : set of Conditions
        Those before and after each run.
    size : int
        The size of the largest team.
    """
    said = []
    if max(one.teams for one in met) > 1:
        said.append(f"There are several teams: δ is for a robot among its own team, and N = {size} is the largest.")
    if len({one.robots for one in met} | {size}) > 1:
        said.append(f"The number of robots changes: N = {size} is the most that were counted in one team at once.")
    return tuple(said)
