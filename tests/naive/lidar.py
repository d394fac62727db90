"""The slow twin of the lidar: each ray against each wall, obstacle and body, and each of their images."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any

from naive.paper import Vector

#: Position, radius and identity.
Body = tuple[Vector, float, int]


def reading(here: Vector, way: Vector, most: float, arena: Any, bodies: Iterable[Body], slack: float) -> float:
    """Return how far a ray goes from `here` along the unit vector `way`: to the nearest thing, or as far as `most`."""
    return min([most, *_distances(here, way, arena, bodies, slack)])


def _distances(here: Vector, way: Vector, arena: Any, bodies: Iterable[Body], slack: float) -> Iterator[float]:
    for x, y in _shifts(arena):
        walls = [tuple(wall) for wall in arena.walls.segments.tolist()]
        for x_0, y_0, x_1, y_1 in walls:
            first, last = (x_0 + x - here[0], y_0 + y - here[1]), (x_1 + x - here[0], y_1 + y - here[1])
            # At the corner of an obstacle a ray is stopped only if it leads behind both walls.
            edge = x_1 - x_0, y_1 - y_0
            beyond = [
                (wall[2] - wall[0], wall[3] - wall[1])
                for end, place, side in ((first, (x_0, y_0), slice(2, 4)), (last, (x_1, y_1), slice(2)))
                if math.hypot(*end) <= slack for wall in walls
                if wall[side] == place and _turn(edge, wall) * (1 if end == last else -1) < 0
            ]  # fmt: skip
            if beyond:
                yield from [0.0] * all(along[0] * way[1] - along[1] * way[0] < 0 for along in (edge, *beyond))
            else:
                yield from _to_segment(first, last, way, slack)
        for centre_x, centre_y, radius in arena.walls.discs.tolist():
            yield from _to_disc((centre_x + x - here[0], centre_y + y - here[1]), radius, way, is_wall=True)
        for (body_x, body_y), radius, _ in bodies:
            if radius > 0:
                yield from _to_disc((body_x - (here[0] - x), body_y - (here[1] - y)), radius, way)


def _turn(edge: Vector, wall: tuple[float, ...]) -> float:
    """Above 0 if a wall leads to the left of an edge."""
    return edge[0] * (wall[3] - wall[1]) - edge[1] * (wall[2] - wall[0])


def _shifts(arena: Any) -> Iterator[Vector]:
    steps = ([0] if side == 0 else range(-3, 4) for side in arena.period)
    for across, up in product(*steps):
        yield across * arena.period[0], up * arena.period[1]


def _to_segment(first: Vector, last: Vector, way: Vector, slack: float) -> Iterator[float]:
    """To a wall that is met from its left side: its first end is to the right of the ray, its last to the left."""
    right, left = (way[0] * y - way[1] * x for x, y in (first, last))
    area = first[0] * last[1] - first[1] * last[0]
    length_2 = (last[0] - first[0]) ** 2 + (last[1] - first[1]) ** 2
    is_behind = area < 0 and area * area > slack * slack * length_2
    if not is_behind and right <= 0 <= left and left > right:
        ends = sorted(way[0] * x + way[1] * y for x, y in (first, last))
        yield max(min(max(max(area, 0.0) / (left - right), ends[0]), ends[1]), 0.0)


def _to_disc(centre: Vector, radius: float, way: Vector, *, is_wall: bool = False) -> Iterator[float]:
    """To the edge of a disc, from outside; from inside of one whose radius is negative."""
    along = centre[0] * way[0] + centre[1] * way[1]
    across = centre[0] * way[1] - centre[1] * way[0]
    gap = centre[0] * centre[0] + centre[1] * centre[1] - radius * radius
    depth = radius * radius - across * across
    if radius < 0:
        yield along + math.sqrt(along * along + max(-gap, 0.0))
    elif gap <= 0:
        # Whoever is in an obstacle is on its wall, where rounding has put it.
        yield from [0.0] * (along > 0 or not is_wall)
    elif along > 0 and depth >= 0:
        yield gap / (along + math.sqrt(depth))
