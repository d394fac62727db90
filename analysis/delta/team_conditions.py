"""Conditions of a prediction of degrees: team size, awareness range, arena and speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from teamsight.agents.teammates import are_all_sensed, of_team, teammates
from teamsight.analysis.delta import closed_form
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.world.arena import Disc

if TYPE_CHECKING:
    from teamsight.agents.world import World


#: A note on reports.
SQUARE_RANGES = (
    "Ranges are squares: neighbours are at most the awareness range away along either axis, and up to √2 times as far."
)


class Conditions(NamedTuple):
    """The conditions in one world at one time.

    ``robots`` is the size of the largest team, ``teams`` the number of teams with robots. ``awareness_range`` is None
    if robots differ, ``radius`` if the arena is not a disc. ``speed`` is the root mean square over robots.
    ``is_sensed`` is False if a sensor in order or an obstacle may hide teammates within the range, ``is_reliable`` if a
    robot has been inactive or one of its sensors out of order, ``are_discs`` if the ranges of some are squares.
    """

    robots: int
    teams: int
    awareness_range: float | None
    radius: float | None
    speed: float
    is_sensed: bool = True
    is_reliable: bool = True
    are_discs: bool = True


def conditions(world: World, team: str | None = None) -> Conditions:
    """Return the present conditions of a world.

    Parameters
    ----------
    world : World
        The world.
    team : str, optional
        The only team that counts; by default all do.
    """
    groups = of_team(world.groups, team)
    members = teammates(groups)
    reach = members.awareness_range
    return Conditions(
        robots=members.largest_team,
        teams=int(np.count_nonzero(members.sizes)),
        awareness_range=float(reach[0]) if len(reach) and reach.min() == reach.max() else None,
        radius=world.arena.radius if isinstance(world.arena, Disc) else None,
        speed=float(np.sqrt(np.mean(np.square(members.speed)))) if len(members.speed) else 0.0,
        is_sensed=are_all_sensed(groups, world.arena),
        is_reliable=not any(group.has_conditions for group in groups),
        are_discs=all(group.range_shape == "disc" for group in groups),
    )


def awareness_range(met: set[Conditions]) -> float | None:
    """Return the range of all robots, or None if they differ."""
    reaches = {one.awareness_range for one in met if one.robots}
    return reaches.pop() if len(reaches) == 1 else None


def predict(met: set[Conditions], size: int, steps: int) -> Prediction | None:
    """Return the closed form for one run, or None if it does not apply.

    Parameters
    ----------
    met : set of Conditions
        Conditions before and after each run.
    size : int
        Size of the largest team.
    steps : int
        T, the length of a run.

    Notes
    -----
    The closed form is for one constant team in a disc, with discs for ranges and without failures, so all
    conditions must be equal.
    """
    if len(met) > 1:
        return None
    (same,) = met
    if not same.is_reliable or not same.are_discs or (same.robots, same.teams) != (size, 1):
        return None
    if same.radius is None or same.awareness_range is None:
        return None
    return closed_form.predict(size, same.radius, steps=steps, awareness_range=same.awareness_range, speed=same.speed)


def notes(met: set[Conditions], size: int) -> tuple[str, ...]:
    """Return notes on the meaning of N.

    Parameters
    ----------
    met : set of Conditions
        Conditions before and after each run.
    size : int
        Size of the largest team.
    """
    said = []
    if max(one.teams for one in met) > 1:
        said.append(
            f"There are several teams: only teammates are neighbours, and N = {size} is the largest team; give team to "
            "choose δ for one of them."
        )
    if len({one.robots for one in met} | {size}) > 1:
        said.append(f"The number of robots changes: N = {size} is the largest number in one team at any time.")
    if not all(one.is_reliable for one in met):
        said.append(
            "Robots fail, or their sensors do: a robot has neighbours while it is active and its sensor for teammates "
            "is in order, and only active robots are neighbours. N counts all."
        )
    if not all(one.are_discs for one in met):
        said.append(SQUARE_RANGES)
    if not all(one.is_sensed for one in met):
        said.append(
            "Neighbours are teammates within the awareness range, also those that a sensor in order misses or an "
            "obstacle hides: the number that a robot really senses is at most as large."
        )
    return tuple(said)
