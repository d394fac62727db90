"""The four basis behaviours: safe wandering, dispersion, resting, homing."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.actions import go, turned_by
from teamsight.policies.schemas.vectors import avoid_teammates, home_offset

#: The behaviours in the order of the columns of a table.
BEHAVIOURS = ("wandering", "dispersion", "resting", "homing")
WANDERING, DISPERSION, RESTING, HOMING = range(4)


@inlined
def behave(number: int, i: int, percept: Any, wandering: Any, noise: Any, action: Any) -> None:
    """Write the action of robot `i` in a behaviour.

    Parameters
    ----------
    number : int
        The behaviour.
    i : int
        The robot.
    percept : Percept
        What it perceives.
    wandering : ndarray, shape (3,), float64
        The probability of a turn, the largest turn to either side [half turns], and the distance from teammates that
        is safe [length].
    noise : ndarray, shape (2, n), float64
        Uniform numbers.
    action : Action
        Written.
    """
    x = percept.heading[i, 0]
    y = percept.heading[i, 1]
    distance = percept.speed[i]
    if number == WANDERING:
        if noise[0, i] < wandering[0]:
            x, y = turned_by(x, y, wandering[1] * (noise[1, i] - 0.5))
        apart_x, apart_y = avoid_teammates(i, percept, wandering[2])
        if apart_x != 0.0 or apart_y != 0.0:
            x, y = apart_x, apart_y
    elif number == DISPERSION:
        apart_x, apart_y = avoid_teammates(i, percept, percept.awareness_range[i])
        if apart_x != 0.0 or apart_y != 0.0:
            x, y = apart_x, apart_y
        else:
            distance = 0.0
    elif number == RESTING:
        distance = 0.0
    else:
        # At full speed also at home, so that a homing robot never stands still.
        home_x, home_y = home_offset(i, percept)
        if home_x != 0.0 or home_y != 0.0:
            x, y = home_x, home_y
    go(action, i, x, y, distance)
