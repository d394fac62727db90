"""Perceptual cues: thresholded readings, the bits on which arbiters decide."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.braitenberg.readings import is_ahead, nearest, obstacle

#: The cues, in the order of their bits.
CUES = (
    "obstacle left", "obstacle right", "obstacle near left", "obstacle near right", "box", "box left", "box touched",
    "teammate", "teammate left", "teammate ahead", "teammate ahead in slow range", "teammate ahead near",
)  # fmt: skip
#: The parameters that all kernels here have.
OBSTACLE_RANGE, SLOW_RANGE, AGILITY, SWERVE, PATIENCE, CONTACT = range(6)

# The readings from which obstacles are near, and the share of the slow range within which a teammate is near.
_NEAR = 0.2
_NEAR_SHARE = 0.5


@inlined
def _bit(number: int, is_set: bool) -> int:
    return (1 << number) if is_set else 0


@inlined
def has(cues: int, number: int) -> bool:
    """Return whether a cue is set."""
    return (cues >> number) & 1 == 1


@inlined
def _is_left(i: int, percept: Any, x: float, y: float) -> bool:
    return percept.heading[i, 0] * y - percept.heading[i, 1] * x >= 0.0  # type: ignore[no-any-return]


@inlined
def cues_of(i: int, percept: Any, parameters: Any) -> int:
    """Return the cues of robot `i`, one bit for each of `CUES`.

    Of teammates only the nearest that its degree of awareness shows counts.
    """
    left, right = obstacle(i, percept, parameters[OBSTACLE_RANGE])
    cues = _bit(0, left > 0.0) + _bit(1, right > 0.0) + _bit(2, left > _NEAR) + _bit(3, right > _NEAR)
    distance, x, y = nearest(i, percept.targets)
    if distance < math.inf:
        cues += _bit(4, True) + _bit(5, _is_left(i, percept, x, y)) + _bit(6, distance <= parameters[CONTACT])
    distance, x, y = nearest(i, percept.teammates)
    if distance < math.inf:
        cues += _bit(7, True) + _bit(8, _is_left(i, percept, x, y))
        if is_ahead(i, percept, x, y, distance):
            slow = parameters[SLOW_RANGE]
            cues += _bit(9, True) + _bit(10, distance <= slow) + _bit(11, distance <= _NEAR_SHARE * slow)
    return cues
