"""Idle behaviour: what a robot without anything to follow does.

The paper does not say. ``redraw`` turns to a new direction each step, ``wander`` turns with a probability per step,
and ``stay`` waits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.kernel import inlined

#: Probability per step with which a target turns (§5).
TURN_PROBABILITY = 0.05


class Idle(NamedTuple):
    """An idle behaviour: its number in kernels, and how many random numbers a robot needs per decision."""

    number: float
    draws: int


BEHAVIOURS = {"redraw": Idle(0.0, 1), "wander": Idle(1.0, 2), "stay": Idle(2.0, 0)}


def check_idle(idle: str, turn_probability: float) -> None:
    """Refuse an idle behaviour that is unknown, and a probability that is not in [0, 1].

    Raises
    ------
    ValueError, TypeError
        Naming the option, its value and its limits.
    """
    checks.choice("idle", idle, BEHAVIOURS)
    checks.number("turn_probability", turn_probability, least=0, most=1)


@inlined
def idle_step(behaviour: float, turn_probability: float, i: int, percept: Any, noise: Any, action: Any) -> None:
    """Write the action of the idle robot `i`; `behaviour` is a number of `BEHAVIOURS`.

    Row 0 of the noise decides the direction, row 1 (wander only) whether to turn.
    """
    if behaviour == 2.0:
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
        action.distance[i] = 0.0
        return
    action.distance[i] = percept.speed[i]
    if behaviour == 0.0 or noise[1, i] < turn_probability:
        x, y = direction(noise[0, i])
    else:
        x, y = percept.heading[i, 0], percept.heading[i, 1]
    action.heading[i, 0] = x
    action.heading[i, 1] = y
