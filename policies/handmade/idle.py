"""Idle behaviour: what a robot without anything to follow does.

The paper does not say. ``redraw`` turns to a new direction each step, ``wander`` turns with a probability of 5 % per
step, as the targets do, and ``stay`` waits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from teamsight.core.angles import direction
from teamsight.core.kernel import inlined

_WANDER_TURN = 0.05


class Idle(NamedTuple):
    """An idle behaviour: its number in kernels, and how many random numbers a robot needs per decision."""

    number: float
    draws: int


BEHAVIOURS = {"redraw": Idle(0.0, 1), "wander": Idle(1.0, 2), "stay": Idle(2.0, 0)}


@inlined
def idle_step(behaviour: float, i: int, percept: Any, noise: Any, action: Any) -> None:
    """Write the action of the idle robot `i`; `behaviour` is a number of `BEHAVIOURS`.

    Row 0 of the noise decides the direction, row 1 (wander only) whether to turn.
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
