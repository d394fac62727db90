"""Behaviours by fixed priority: avoid, goal, slow, follow, find."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.braitenberg.readings import obstacle, teammate
from teamsight.policies.braitenberg.recovery import recovers
from teamsight.policies.braitenberg.vehicle import Vehicle
from teamsight.policies.braitenberg.vehicles import AVOID, FIND, FOLLOW, GOAL, SLOW, roll, wheels_of

_OBSTACLE_RANGE, _SLOW_RANGE, _AGILITY = range(3)


@inlined
def priority(i: int, percept: Any, parameters: Any) -> int:
    """Return the first behaviour whose condition holds."""
    left, right = obstacle(i, percept, parameters[_OBSTACLE_RANGE])
    if left > 0.0 or right > 0.0:
        return AVOID
    if percept.targets.start[i] < percept.targets.start[i + 1]:
        return GOAL
    distance = teammate(i, percept)
    if distance <= parameters[_SLOW_RANGE]:
        return SLOW
    return FOLLOW if distance < math.inf else FIND


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        if recovers(i, percept, arrays, noise[0, i], action):
            continue
        behaviour = priority(i, percept, arrays.parameters)
        left, right = wheels_of(behaviour, i, percept, arrays.parameters, noise[0, i])
        roll(i, percept, action, left, right, arrays.parameters[_AGILITY])


@dataclass(frozen=True)
class FixedPriority(Vehicle):
    """The behaviour of the highest priority whose condition holds: avoid, goal, slow, follow, find.

    *Avoid* acts if a robot is ahead within `obstacle_range`; *goal* if the box is sensed, and goes to it; *slow* if the
    nearest perceived teammate is ahead within `slow_range`; *follow* if it is ahead anywhere, and goes to it; *find*
    wanders.

    Parameters
    ----------
    obstacle_range, slow_range, agility, swerve, recovery, patience, contact
        As for `Vehicle`.

    Notes
    -----
    *Source:* Kube and Zhang (1994), as Touzet (2000, §9) reports them; the order is recalled, not verified. *Departs:*
    sensors, wires and ranges are ours. Walls reflect, so there is no need to avoid them.
    """

    kernel = _decide
