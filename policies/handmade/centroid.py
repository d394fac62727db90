"""The centroid policy: the paper's collective behaviour, which does not use teammates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.core.component import Allowed, Flag, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.handmade.forces import BEHAVIOURS, TURN_PROBABILITY, idle_step


@inlined
def _to_centroid(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    targets = percept.targets
    for i in range(percept.heading.shape[0]):
        first = targets.start[i]
        last = targets.start[i + 1]
        if first == last:
            idle_step(arrays.parameters[0], arrays.parameters[1], i, percept, noise, action)
            continue
        x = 0.0
        y = 0.0
        for k in range(first, last):
            x += targets.offset[k, 0]
            y += targets.offset[k, 1]
        x /= last - first
        y /= last - first
        distance = math.sqrt(x * x + y * y)
        # Its speed is the farthest that a robot goes in a step.
        action.distance[i] = distance if arrays.parameters[2] else percept.speed[i]
        if distance > 0.0:
            action.heading[i, 0] = x / distance
            action.heading[i, 1] = y / distance
        else:
            action.heading[i, 0] = 0.0
            action.heading[i, 1] = 0.0


@dataclass(frozen=True)
class Centroid(CompiledPolicy):
    """Move to the geographical centre of the sensed targets, as far as the speed allows.

    Parameters
    ----------
    idle : {"redraw", "wander", "stay"}
        Behaviour of a robot that senses no target: turn to a new direction each step, wander, or stay.
    turn_probability : float, default 0.05
        Probability per step with which a robot that wanders turns; other idle behaviours do not use it.
    arrive : bool, default True
        Stop at the centre. Otherwise a robot goes on at its speed, and beyond a centre that is nearer than a step.

    Raises
    ------
    ValueError, TypeError
        If there is no such idle behaviour, or the probability is not in [0, 1].

    Notes
    -----
    *Source:* §6, "a behavior that places it at the geographical center of the sensed targets; it does not take into
    account the other robot positions". *Departs:* the paper does not say what a robot without targets does,
    nor whether one that is nearer to the centre than a step stops there; "places it" suggests so.
    """

    idle: Annotated[str, Allowed(choices=BEHAVIOURS)] = "redraw"
    turn_probability: Probability = TURN_PROBABILITY
    arrive: Flag = True

    kernel = _to_centroid

    @property
    def draws(self) -> int:  # type: ignore[override]
        return BEHAVIOURS[self.idle].draws

    @property
    def parameters(self) -> tuple[float, ...]:
        return BEHAVIOURS[self.idle].number, self.turn_probability, float(self.arrive)
