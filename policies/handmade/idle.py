"""Idle behaviour: what a robot without anything to follow does.

The paper does not say. ``redraw`` turns to a new direction each step, ``wander`` turns with a probability of 5 % per
step, as the targets do, and ``stay`` waits.
"""

from __future__ import annotations

from typing import Any

from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.kernel import inlined

BEHAVIOURS = {"redraw": 0.0, "wander": 1.0, "stay": 2.0}

_DRAWS = {"redraw": 1, "wander": 2, "stay": 0}
_WANDER_TURN = 0.05


def idle_number(behaviour: str) -> float:
    """Return the number of an idle behaviour in kernels.

    Raises
    ------
    ValueError
        If there is no such behaviour.
    """
    return BEHAVIOURS[checks.choice("idle", behaviour, BEHAVIOURS)]


def idle_draws(behaviour: str) -> int:
    """Return the number of random numbers that a robot with this idle behaviour needs per decision."""
    return _DRAWS[checks.choice("idle", behaviour, BEHAVIOURS)]


@inlined
def idle_step(behaviour: float, i: int, percept: Any, noise: Any, action: Any) -> None:
    """Write the action of the idle robot `i`.

    Parameters
    ----------
    behaviour : float
        From `idle_number`.
    i : int
        The robot.
    percept : Percept
        The group's percept.
    noise : ndarray, shape (draws, n), float64
        Row 0 decides the direction, row 1 (wander only) whether to turn.
    action : Action
        Written.
    """
    if behaviour == 2.0:
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
        action.distance[i] = 0.0
        return
    action.distance[i] = percept.speed[i]
    if behaviour == 0.0 or noise[1, i] < _WANDER_TURN:
        x, y = direction(noise[0, i])
    else:
        x, y = percept.heading[i, 0], percept.heading[i, 1]
    action.heading[i, 0] = x
    action.heading[i, 1] = y
