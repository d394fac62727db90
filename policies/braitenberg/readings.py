"""What robots with Braitenberg behaviours read: two eyes, two obstacle sensors, and the nearest of what they sense."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined

# The eyes look this far to either side of the heading: cosine and sine of 45°.
_EYE = 0.7071067811865476
# Robots are sensed ahead: cosine of the half angle, 60°.
_AHEAD = 0.5


@inlined
def eyes(i: int, percept: Any, x: float, y: float, length: float) -> tuple[float, float]:
    """Return the left and right readings of a light at an offset: 1 straight before the eye, 0 behind it."""
    if length <= 0.0:
        return 0.5, 0.5
    ahead = (percept.heading[i, 0] * x + percept.heading[i, 1] * y) / length
    left = (percept.heading[i, 0] * y - percept.heading[i, 1] * x) / length
    return 0.5 + 0.5 * _EYE * (ahead + left), 0.5 + 0.5 * _EYE * (ahead - left)


@inlined
def nearest(i: int, seen: Any) -> tuple[float, float, float]:
    """Return the distance and the offset of the nearest agent of a neighbour list; an infinite distance without any."""
    distance = math.inf
    x = 0.0
    y = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        if seen.distance[k] < distance:
            distance = seen.distance[k]
            x = seen.offset[k, 0]
            y = seen.offset[k, 1]
    return distance, x, y


@inlined
def is_ahead(i: int, percept: Any, x: float, y: float, length: float) -> bool:
    """Return whether an offset of this length is at most 60° from the heading of robot `i`."""
    return percept.heading[i, 0] * x + percept.heading[i, 1] * y >= _AHEAD * length  # type: ignore[no-any-return]


@inlined
def obstacle(i: int, percept: Any, sphere: float) -> tuple[float, float]:
    """Return how near obstacles ahead are, left and right of the heading: in [0, 1], 0 beyond the sphere."""
    seen = percept.channels.obstacles
    left = 0.0
    right = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        x = seen.offset[k, 0]
        y = seen.offset[k, 1]
        if seen.distance[k] >= sphere or not is_ahead(i, percept, x, y, seen.distance[k]):
            continue
        near = 1.0 - seen.distance[k] / sphere
        if percept.heading[i, 0] * y - percept.heading[i, 1] * x >= 0.0:
            left = max(left, near)
        else:
            right = max(right, near)
    return left, right
