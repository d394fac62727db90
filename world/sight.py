"""Sight: what stands in the way of a line of sight, as arrays, and the kernel that looks.

A line of sight is blocked if it enters a disc or crosses a segment. At the edges, where rounding decides:

- A line that only runs along a wall, or touches a disc, is free; one that touches a corner of a polygon is blocked.
- A body on a wall sees what is in front of this wall: being on it, up to `Sight.slack`, does not block.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined, kernel

Floats = npt.NDArray[np.float64]


class Sight(NamedTuple):
    """What blocks sight in an arena; it can be part of a `Record`.

    Attributes
    ----------
    segments : ndarray, shape (s, 4), float64
        Walls: the ends x0, y0, x1, y1 of each [length]. Seen from the first end, what is free lies on the left.
    discs : ndarray, shape (d, 3), float64
        Discs: x, y and radius of each [length].
    period : ndarray, shape (2,), float64
        The period of the arena [length]; 0 along an axis that does not repeat.
    slack : float
        A position beyond a wall by at most this distance is on the wall [length].
    """

    segments: Annotated[Floats, ".segments", 4]
    discs: Annotated[Floats, ".discs", 3]
    period: Annotated[Floats, 2]
    slack: float


@cache
def open_sight() -> Sight:
    """Return the sight in an arena where nothing blocks it."""
    return Sight(np.empty((0, 4)), np.empty((0, 3)), np.zeros(2), 0.0)


@inlined
def images(period: float) -> int:
    """Return the number of images of a thing that can be near a place, along an axis with this period."""
    return 2 if period > 0.0 else 1


@inlined
def image(thing: float, place: float, period: float, which: int) -> float:
    """Return the shift of an image of `thing`: the nearest above `place`, or (1) the nearest below it."""
    if period > 0.0:
        return -period * (math.floor((thing - place) / period) + which)
    return 0.0


@inlined
def is_behind(side: float, length_2: float, slack: float) -> bool:
    """Whether a point is behind a wall by more than the slack; `side` is its distance times the wall's length."""
    return side < 0.0 and side * side > slack * slack * length_2


@kernel
def is_crossed(x: float, y: float, way_x: float, way_y: float, walls: Any, k: int, slack: float) -> bool:
    """Whether the way from (x, y) crosses wall `k` of `walls`, x0, y0, x1, y1 each, from whichever side."""
    edge_x = walls[k, 2] - walls[k, 0]
    edge_y = walls[k, 3] - walls[k, 1]
    length_2 = edge_x * edge_x + edge_y * edge_y
    from_x = x - walls[k, 0]
    from_y = y - walls[k, 1]
    begin = edge_x * from_y - edge_y * from_x
    end = edge_x * (from_y + way_y) - edge_y * (from_x + way_x)
    is_begin_behind = is_behind(begin, length_2, slack)
    if is_begin_behind == is_behind(end, length_2, slack):
        return False
    share = min(max(begin / (begin - end), 0.0), 1.0)
    along = (from_x + share * way_x) * edge_x + (from_y + share * way_y) * edge_y
    if is_behind(along, length_2, slack) or is_behind(length_2 - along, length_2, slack):
        return False
    # A body at a corner is on two walls; it looks past the one that it looks along from behind.
    distance_2 = share * share * (way_x * way_x + way_y * way_y)
    to_corner = min(abs(along), abs(length_2 - along))
    is_at_corner = to_corner * to_corner <= slack * slack * length_2
    rest_2 = (1.0 - share) * (1.0 - share) * (way_x * way_x + way_y * way_y)
    return not (is_at_corner and min(distance_2, rest_2) <= slack * slack)


@kernel
def is_entered(x: float, y: float, way_x: float, way_y: float, centre_x: float, centre_y: float, radius: float) -> bool:
    """Whether the way from (x, y) comes nearer than `radius` to a centre."""
    to_x = centre_x - x
    to_y = centre_y - y
    length_2 = way_x * way_x + way_y * way_y
    share = 0.0
    if length_2 > 0.0:
        share = min(max((to_x * way_x + to_y * way_y) / length_2, 0.0), 1.0)
    off_x = to_x - share * way_x
    off_y = to_y - share * way_y
    return radius > 0.0 and off_x * off_x + off_y * off_y < radius * radius


@kernel
def is_blocked(x: float, y: float, way_x: float, way_y: float, sight: Any) -> bool:
    """Whether something blocks the line of sight from (x, y) to (x + way_x, y + way_y).

    Parameters
    ----------
    x, y : float
        Where the observer is [length].
    way_x, way_y : float
        The shortest way to what it looks at [length].
    sight : Sight
        What blocks sight.
    """
    segments, discs, slack = sight.segments, sight.discs, sight.slack
    period_x = sight.period[0]
    period_y = sight.period[1]
    # A thing and a line of sight that is at most half a period long meet near the middle of the line.
    middle_x = x + 0.5 * way_x
    middle_y = y + 0.5 * way_y
    for across in range(images(period_x)):
        for up in range(images(period_y)):
            for k in range(segments.shape[0]):
                from_x = x - image(0.5 * (segments[k, 0] + segments[k, 2]), middle_x, period_x, across)
                from_y = y - image(0.5 * (segments[k, 1] + segments[k, 3]), middle_y, period_y, up)
                if is_crossed(from_x, from_y, way_x, way_y, segments, k, slack):
                    return True
            for k in range(discs.shape[0]):
                centre_x = discs[k, 0] + image(discs[k, 0], middle_x, period_x, across)
                centre_y = discs[k, 1] + image(discs[k, 1], middle_y, period_y, up)
                if is_entered(x, y, way_x, way_y, centre_x, centre_y, discs[k, 2] - slack):
                    return True
    return False
