"""The behaviours as Braitenberg vehicles: from two readings to two wheels, and from wheels to heading and distance."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.actions import turned_by
from teamsight.policies.braitenberg.cues import AGILITY, OBSTACLE_RANGE, SWERVE
from teamsight.policies.braitenberg.readings import eyes, nearest, obstacle

#: The behaviours, in the order of the fixed priority; a robot's behaviour is an index into them.
BEHAVIOURS = ("avoid", "goal", "slow", "follow", "find")
AVOID, GOAL, SLOW, FOLLOW, FIND = range(5)

# How strongly avoidance brakes a wheel, and how much more the left one turns, so that robots do not stop face to face.
_BRAKE = 4.0
_BIAS = 0.2


@inlined
def _roll(i: int, percept: Any, action: Any, left: float, right: float, agility: float) -> None:
    """Write the action of robot `i` for the speeds of its wheels, cut to [−1, 1].

    Their mean is the distance as a share of the speed; half their difference, times the agility [turns], the rotation.
    """
    left = min(max(left, -1.0), 1.0)
    right = min(max(right, -1.0), 1.0)
    x, y = turned_by(percept.heading[i, 0], percept.heading[i, 1], 0.5 * agility * (right - left))
    action.heading[i, 0] = x
    action.heading[i, 1] = y
    action.distance[i] = percept.speed[i] * max(0.5 * (left + right), 0.0)


@inlined
def _wheels(behaviour: int, i: int, percept: Any, parameters: Any, random: float) -> tuple[float, float]:
    """Return the speeds of the left and the right wheel of robot `i` in a behaviour; `random` is uniform."""
    swerve = parameters[SWERVE]
    left = 1.0 - swerve * random
    right = 1.0 - swerve * (1.0 - random)
    if behaviour == AVOID:
        # Each side brakes the wheel of the other, so the robot turns away.
        near_left, near_right = obstacle(i, percept, parameters[OBSTACLE_RANGE])
        left = 1.0 + _BIAS - _BRAKE * near_right
        right = 1.0 - _BRAKE * near_left
    elif behaviour == SLOW:
        left *= 0.5
        right *= 0.5
    elif behaviour != FIND:
        # Each eye drives the wheel of the other side, so the robot turns to the light.
        distance, x, y = nearest(i, percept.targets) if behaviour == GOAL else nearest(i, percept.teammates)
        right, left = eyes(i, percept, x, y, distance)
    return left, right


@inlined
def behave(behaviour: int, i: int, percept: Any, parameters: Any, random: float, action: Any) -> None:
    """Write the action of robot `i` in a behaviour."""
    left, right = _wheels(behaviour, i, percept, parameters, random)
    _roll(i, percept, action, left, right, parameters[AGILITY])
