"""The behaviours as Braitenberg vehicles: from two readings to two wheels, and from wheels to heading and distance."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.actions import turned_by
from teamsight.policies.braitenberg.readings import eyes, nearest, obstacle

#: The behaviours, in the order of the fixed priority; a robot's behaviour is an index into them.
BEHAVIOURS = ("avoid", "goal", "slow", "follow", "find")
AVOID, GOAL, SLOW, FOLLOW, FIND = range(5)

# How strongly avoidance brakes a wheel, and how much more the left one turns, so that robots do not stop face to face.
_BRAKE = 4.0
_BIAS = 0.2


@inlined
def roll(i: int, percept: Any, action: Any, left: float, right: float, agility: float) -> None:
    """Write the action of robot `i` for the speeds of its wheels, in [−1, 1].

    Their mean is the distance as a share of the speed; half their difference, times the agility [turns], the rotation.
    """
    left = min(max(left, -1.0), 1.0)
    right = min(max(right, -1.0), 1.0)
    x, y = turned_by(percept.heading[i, 0], percept.heading[i, 1], 0.5 * agility * (right - left))
    action.heading[i, 0] = x
    action.heading[i, 1] = y
    action.distance[i] = percept.speed[i] * max(0.5 * (left + right), 0.0)


@inlined
def wheels_of(behaviour: int, i: int, percept: Any, parameters: Any, random: float) -> tuple[float, float]:
    """Return the speeds of the left and the right wheel of robot `i` in a behaviour; `random` is uniform."""
    sphere, swerve = parameters[0], parameters[3]
    left = 0.0
    right = 0.0
    if behaviour == AVOID:
        # Each eye brakes the wheel on the other side, so the robot turns away.
        near_left, near_right = obstacle(i, percept, sphere)
        left, right = 1.0 + _BIAS - _BRAKE * near_right, 1.0 - _BRAKE * near_left
    elif behaviour in (GOAL, FOLLOW):
        # Each eye drives the wheel on the other side, so the robot turns to the light.
        if behaviour == GOAL:
            distance, x, y = nearest(i, percept.targets)
        else:
            distance, x, y = nearest(i, percept.teammates)
        right, left = eyes(i, percept, x, y, distance)
    else:
        left, right = 1.0 - swerve * random, 1.0 - swerve * (1.0 - random)
        if behaviour == SLOW:
            left, right = 0.5 * left, 0.5 * right
    return left, right
