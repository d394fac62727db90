"""Search: what a robot does that has nothing to follow.

The paper does not say. Three rules are offered: ``redraw`` turns to a new direction each step, ``wander`` turns with a
probability of 5 % a step, as the targets do, and ``stay`` waits.
"""

from __future__ import annotations

from typing import Any

from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.kernel import inlined

BEHAVIOURS = {"redraw": 0.0, "wander": 1.0, "stay": 2.0}

_DRAWS = {"redraw": 1, "wander": 2, "stay": 0}
_WANDER_TURN = 0.05


def idle_number(rule: str) -> float:
    """Return the number by which a kernel knows the rule.

    Raises
    ------
    ValueError
        If there is no such rule.
    """
    return BEHAVIOURS[checks.choice("idle", rule, BEHAVIOURS)]


def idle_draws(rule: str) -> int:
    """Return how many random numbers a robot needs for a step under this rule."""
    return _DRAWS[checks.choice("idle", rule, BEHAVIOURS)]


@inlined
def idle_step(rule: float, i: int, percept: Any, noise: Any, action: Any) -> None:
    """Write the action of robot `i` that has nothing to follow.

    Parameters
    ----------
    rule : float
        From `idle_number`.
    i : int
        Which robot.
    percept : Percept
        What the group knows.
    noise : ndarray, shape (draws, n), float64
        Row 0 gives the direction, row 1 (wander only) whether to turn.
    action : Action
        Written.
    """
    if rule == 2.0:
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
        action.distance[i] = 0.0
        return
    action.distance[i] = percept.speed[i]
    if rule == 0.0 or noise[1, i] < _WANDER_TURN:
        x, y = direction(noise[0, i])
    else:
        x, y = percept.heading[i, 0], percept.heading[i, 1]
    action.heading[i, 0] = x
    action.heading[i, 1] = y
