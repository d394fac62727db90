"""Geometry of polygons as arrays of vertices: checks, area, which points are inside, triangles."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.world.limits import length

Points = npt.NDArray[np.float64]

# Corners and walls that do not touch are at least so far apart, as a share of the largest coordinate.
_NEAREST = 1e-9
# The largest coordinate, as a multiple of the longer side of the box around the polygon.
_FARTHEST = 1e5


def checked_vertices(vertices: npt.ArrayLike) -> Points:
    """Return the vertices of a simple polygon in counter-clockwise order, beginning with the first.

    Raises
    ------
    TypeError, ValueError
        If they are not at least three pairs of finite numbers within the limits of lengths, lie too near to each other
        or too far from the origin, or if the polygon crosses or touches itself or has no area.
    """
    given = checks.shown(vertices)
    try:
        points = np.array(vertices, float)
    except (TypeError, ValueError):
        raise TypeError(f"vertices={given}: must be pairs of numbers, such as [(0, 0), (2, 0), (0, 1)]") from None
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
        raise ValueError(f"vertices={given}: must be at least 3 pairs of numbers, such as [(0, 0), (2, 0), (0, 1)]")
    if not np.isfinite(points).all():
        raise ValueError(f"vertices={given}: must be finite numbers")
    sides = np.ptp(points, axis=0)
    length("the longer side of the polygon", float(sides.max()))
    largest = float(np.abs(points).max())
    if largest > _FARTHEST * sides.max():
        raise ValueError(
            f"vertices={given}: the polygon is {largest:g} from the origin, more than {_FARTHEST:g} times its size "
            f"{sides.max():g}; move it nearer to the origin"
        )
    _check_corners(points, _NEAREST * largest)
    _check_crossings(points, _NEAREST * largest)
    return points if signed_area(points) > 0 else np.concatenate([points[:1], points[:0:-1]])


def _check_corners(points: Points, nearest: float) -> None:
    """Refuse vertices that coincide with the next, and corners at which the polygon runs back along itself."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    short = np.hypot(*after.T) <= nearest
    if short.any():
        k = int(np.argmax(short))
        raise ValueError(f"vertex {k}, {_pair(points[k])}: coincides with the next; leave one of them out")
    lengths = np.minimum(np.hypot(*before.T), np.hypot(*after.T))
    back = (_cross(before, after) ** 2 <= (nearest * lengths) ** 2) & (np.sum(before * after, axis=1) < 0)
    if back.any():
        k = int(np.argmax(back))
        raise ValueError(f"vertex {k}, {_pair(points[k])}: the polygon runs back along itself; leave the vertex out")


def _check_crossings(points: Points, nearest: float) -> None:
    """Refuse walls that cross or touch others than the next."""
    begin, end = points, np.roll(points, -1, axis=0)
    for k, others, gap in gaps(points):
        sides = [_cross(end[k] - begin[k], place[others] - begin[k]) > 0 for place in (begin, end)]
        turns = [_cross(end[others] - begin[others], place - begin[others]) > 0 for place in (begin[k], end[k])]
        wrong = (gap <= nearest) | ((sides[0] != sides[1]) & (turns[0] != turns[1]))
        if wrong.any():
            other = int(others[np.argmax(wrong)])
            raise ValueError(
                f"vertices: the walls from {_pair(begin[k])} to {_pair(end[k])} and from {_pair(begin[other])} to "
                f"{_pair(end[other])} cross or touch; list the corners in order around the polygon"
            )


def gaps(points: Points) -> Iterator[tuple[int, npt.NDArray[np.int64], Points]]:
    """Return for each wall those after it that are not next to it, and the least distances from ends to walls."""
    begin, end = points, np.roll(points, -1, axis=0)
    count = len(points)
    for k in range(count - 2):
        others = np.arange(k + 2, count if k else count - 1)
        walls = walls_of(points)
        found = [distance_to_walls(ends[others], walls[k : k + 1]) for ends in (begin, end)]
        for place in (begin[k], end[k]):
            found.append(np.hypot(*np.moveaxis(place - nearest_on_walls(place, walls[others]), -1, 0)))
        yield k, others, np.min(found, axis=0)


def _pair(point: Points) -> str:
    return f"({point[0]:g}, {point[1]:g})"


def _cross(one: Points, other: Points) -> Points:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def signed_area(points: Points) -> float:
    """Return the area of a polygon, positive if its vertices are in counter-clockwise order."""
    seen = points - points[0]
    return 0.5 * float(np.sum(_cross(seen, np.roll(seen, -1, axis=0))))


def walls_of(points: Points) -> Points:
    """Return the walls between the vertices, shape (s, 4): x0, y0, x1, y1 each."""
    return np.ascontiguousarray(np.concatenate([points, np.roll(points, -1, axis=0)], axis=1))


def round_boundary(centre: tuple[float, float], radius: float) -> Points:
    """Return 180 vertices on a circle, shape (180, 2)."""
    angle = 2 * math.pi * np.arange(180) / 180
    return np.asarray(centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def is_convex(points: Points) -> bool:
    """Return whether a polygon in counter-clockwise order is convex."""
    after = np.roll(points, -1, axis=0) - points
    turns = _cross(np.roll(after, 1, axis=0), after)
    return bool((turns >= -1e-12 * np.abs(after).max() ** 2).all())


def is_within(position: Points, points: Points) -> npt.NDArray[np.bool_]:
    """Return for each position, shape (..., 2), whether it is inside a polygon; walls are decided by rounding."""
    x, y = position[..., 0], position[..., 1]
    inside = np.zeros(position.shape[:-1], bool)
    for begin, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        spans = (begin[1] > y) != (end[1] > y)
        if begin[1] != end[1]:
            inside ^= spans & (x < begin[0] + (y - begin[1]) * ((end[0] - begin[0]) / (end[1] - begin[1])))
    return inside


def nearest_on_walls(position: Points, segments: Points) -> Points:
    """Return the nearest place on each wall for each position, shape (..., s, 2)."""
    begin, edge = segments[:, :2], segments[:, 2:] - segments[:, :2]
    share = np.sum((position[..., None, :] - begin) * edge, axis=-1) / np.sum(edge**2, axis=-1)
    return np.asarray(begin + np.clip(share, 0.0, 1.0)[..., None] * edge)


def distance_to_walls(position: Points, segments: Points) -> Points:
    """Return the distance of each position, shape (..., 2), to the nearest wall; infinite without walls."""
    x, y = (np.ascontiguousarray(position[..., axis]) for axis in (0, 1))
    distance_2 = np.full(position.shape[:-1], np.inf)
    # One wall after the other: all at once would need much memory for many positions.
    for x0, y0, x1, y1 in segments.tolist():
        edge_x, edge_y = x1 - x0, y1 - y0
        off_x, off_y = x - x0, y - y0
        share = np.clip((off_x * edge_x + off_y * edge_y) / (edge_x**2 + edge_y**2), 0.0, 1.0)
        distance_2 = np.minimum(distance_2, (off_x - share * edge_x) ** 2 + (off_y - share * edge_y) ** 2)
    return np.asarray(np.sqrt(distance_2))


def triangles(points: Points) -> Points:
    """Return triangles that a simple polygon, in counter-clockwise order, consists of; shape (t, 3, 2)."""
    left = list(range(len(points)))
    found = []
    while len(left) > 3:
        ear = _ear(points[left])
        found.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear]
    return np.asarray(points[[*found, left]])


def _ear(points: Points) -> int:
    """Return a corner whose triangle with its neighbours contains no other corner; prefer the largest triangle."""
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    turns = _cross(points - before, after - points)
    corners = [int(k) for k in np.argsort(-turns, kind="stable") if turns[k] > 0.0]
    # Another corner on the edge of the triangle is harmless, but better avoided.
    for most in (0.0, -1e-12 * float(turns.max())):
        for k in corners:
            triangle = np.array([before[k], points[k], after[k]])
            edges = np.roll(triangle, -1, axis=0) - triangle
            sides = [_cross(edge, points - corner) for corner, edge in zip(triangle, edges, strict=True)]
            inside = np.min(sides, axis=0) + most >= 0.0
            inside[[k - 1, k, (k + 1) % len(points)]] = False
            if not inside.any():
                return k
    return int(np.argmin(np.abs(turns)))
