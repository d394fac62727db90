"""Slow twins of walls and sight: exact fractions, and reflections by solving for every wall."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise

Point = tuple[float, float]


def edges(vertices: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    """Return the walls of a polygon."""
    return pairwise([*vertices, vertices[0]])


def is_inside(x: Fraction, y: Fraction, vertices: Sequence[Point]) -> bool:
    """Whether a point that is on no wall is inside a polygon: a ray to the right crosses an odd number of walls."""
    crossed = 0
    for (x0, y0), (x1, y1) in edges(vertices):
        if (y0 > y) != (y1 > y):
            crossed += x < x0 + (y - y0) * Fraction(x1 - x0) / (y1 - y0)
    return bool(crossed % 2)


def on_wall(x: Fraction, y: Fraction, vertices: Sequence[Point]) -> bool:
    """Whether a point is on a wall of a polygon."""
    for (x0, y0), (x1, y1) in edges(vertices):
        cross = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
        between = min(x0, x1) <= x <= max(x0, x1) and min(y0, y1) <= y <= max(y0, y1)
        if cross == 0 and between:
            return True
    return False


def polygon_blocks(start: tuple[int, int], end: tuple[int, int], vertices: Sequence[tuple[int, int]]) -> bool:
    """Whether a polygon blocks the line of sight between two whole points: it enters it or touches a corner."""
    (x, y), (way_x, way_y) = start, (end[0] - start[0], end[1] - start[1])
    shares = {Fraction(0), Fraction(1)}
    for (x0, y0), (x1, y1) in edges(vertices):
        cross = way_x * (y1 - y0) - way_y * (x1 - x0)
        if cross != 0:
            share = Fraction((x0 - x) * (y1 - y0) - (y0 - y) * (x1 - x0), cross)
            along = Fraction((x0 - x) * way_y - (y0 - y) * way_x, cross)
            if 0 < share < 1 and 0 <= along <= 1:
                if along in (0, 1):
                    return True
                shares.add(share)
    for one, other in pairwise(sorted(shares)):
        middle = (one + other) / 2
        place = x + middle * way_x, y + middle * way_y
        if not on_wall(*place, vertices) and is_inside(*place, vertices):
            return True
    return False


def circle_blocks(start: tuple[int, int], end: tuple[int, int], centre: tuple[int, int], radius: int) -> bool:
    """Whether the line between two whole points comes nearer than the radius to the centre."""
    way = end[0] - start[0], end[1] - start[1]
    to = centre[0] - start[0], centre[1] - start[1]
    length_2 = way[0] ** 2 + way[1] ** 2
    share = Fraction(to[0] * way[0] + to[1] * way[1], length_2) if length_2 else Fraction(0)
    share = min(max(share, Fraction(0)), Fraction(1))
    return (to[0] - share * way[0]) ** 2 + (to[1] - share * way[1]) ** 2 < radius**2


def _meets_wall(x: float, y: float, step: Point, wall: tuple[Point, Point]) -> tuple[float, Point] | None:
    """Return the share of a step at which it meets a wall, and a normal of the wall."""
    (x0, y0), (x1, y1) = wall
    length = math.hypot(x1 - x0, y1 - y0)
    normal = (y0 - y1) / length, (x1 - x0) / length
    into = step[0] * normal[0] + step[1] * normal[1]
    if into == 0:
        return None
    share = -((x - x0) * normal[0] + (y - y0) * normal[1]) / into
    place = x + share * step[0] - x0, y + share * step[1] - y0
    along = (place[0] * (x1 - x0) + place[1] * (y1 - y0)) / length**2
    return (share, normal) if 0 <= along <= 1 else None


def _meets_circle(x: float, y: float, step: Point, circle: tuple[Point, float]) -> Iterator[tuple[float, Point]]:
    """Return the shares of a step at which it meets a circle, and the normals there."""
    (centre_x, centre_y), radius = circle
    a = step[0] ** 2 + step[1] ** 2
    b = (x - centre_x) * step[0] + (y - centre_y) * step[1]
    root = b * b - a * ((x - centre_x) ** 2 + (y - centre_y) ** 2 - radius**2)
    for sign in (-1, 1) if root >= 0 else ():
        share = (-b + sign * math.sqrt(root)) / a
        yield share, ((x + share * step[0] - centre_x) / radius, (y + share * step[1] - centre_y) / radius)


def bounce(
    place: Point,
    step: Point,
    walls: Sequence[tuple[Point, Point]],
    circles: Sequence[tuple[Point, float]] = (),
) -> tuple[Point, Point]:
    """Return where a step ends that walls and circles reflect, and its direction there."""
    x, y = place
    while math.hypot(*step) > 0:
        found = [met for wall in walls if (met := _meets_wall(x, y, step, wall))]
        found += [met for circle in circles for met in _meets_circle(x, y, step, circle)]
        # Where it has just been reflected, the way off the wall begins with a share of almost 0.
        later = [(share, normal) for share, normal in found if share * math.hypot(*step) > 1e-9 and share <= 1]
        if not later:
            break
        share, normal = min(later)
        x, y = x + share * step[0], y + share * step[1]
        rest = (1 - share) * step[0], (1 - share) * step[1]
        into = 2 * (rest[0] * normal[0] + rest[1] * normal[1])
        step = rest[0] - into * normal[0], rest[1] - into * normal[1]
    length = math.hypot(*step)
    return (x + step[0], y + step[1]), (step[0] / length, step[1] / length)
