"""How bodies that are discs keep apart: places on the rim of the box, and free places."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.angles import direction
from teamsight.core.kernel import inlined

# Distances that are too short by this share are rounding errors.
_ROUNDING = 1e-9
# How often a robot between two things is put back on their rims in turn.
_REBOUNDS = 16
# Places that are tried for a robot which cannot stay where it is, and the share of a turn between one and the next.
_TRIES = 400
_GOLDEN = 0.6180339887498949


@inlined
def off_rim(x: float, y: float, box_x: float, box_y: float, reach: float) -> tuple[float, float]:
    """Return the place nearest to (x, y) that is at least `reach` from the box."""
    dx = x - box_x
    dy = y - box_y
    square = dx * dx + dy * dy
    if square >= reach * reach:
        return x, y
    length = math.sqrt(square)
    if length < _ROUNDING * reach:
        dx, dy, length = 1.0, 0.0, 1.0
    return box_x + reach * dx / length, box_y + reach * dy / length


@inlined
def is_clear(x: float, y: float, other_x: float, other_y: float, apart: float) -> bool:
    """Return whether two places are at least `apart` from each other, but for rounding."""
    dx = x - other_x
    dy = y - other_y
    least = apart * (1.0 - _ROUNDING)
    return dx * dx + dy * dy >= least * least


@inlined
def overlapped(robots: Any, i: int, x: float, y: float, apart: float) -> int:
    """Return the first robot that robot `i` would overlap at a place; −1 if there is none.

    Robots before it in the group have moved, those after it have not.
    """
    for j in range(robots.position.shape[0]):
        if j == i or not robots.active[j]:
            continue
        other_x, other_y = place_of(robots, j, i)
        if not is_clear(x, y, other_x, other_y, apart):
            return j
    return -1


@inlined
def place_of(robots: Any, j: int, i: int) -> tuple[float, float]:
    """Return where robot `j` is while robot `i` moves."""
    if j < i:
        return robots.position[j, 0], robots.position[j, 1]
    return robots.before[j, 0], robots.before[j, 1]


@inlined
def fits(robots: Any, i: int, x: float, y: float, walls: Any) -> bool:
    """Return whether a place of robot `i` is in the arena, and free; `walls` are box x and y, reach, apart and half."""
    box_x, box_y, reach, apart, half = walls
    is_inside = max(abs(x), abs(y)) <= half
    return is_inside and is_clear(x, y, box_x, box_y, reach) and overlapped(robots, i, x, y, apart) < 0


@inlined
def aside(robots: Any, i: int, walls: Any) -> tuple[float, float]:
    """Return where robot `i` slides to: the rims of the box and of robots push it back in turn until it is free."""
    box_x, box_y, reach, apart, _half = walls
    x = robots.position[i, 0]
    y = robots.position[i, 1]
    for _ in range(_REBOUNDS):
        x, y = off_rim(x, y, box_x, box_y, reach)
        j = overlapped(robots, i, x, y, apart)
        if j < 0:
            break
        other_x, other_y = place_of(robots, j, i)
        x, y = off_rim(x, y, other_x, other_y, apart)
    return x, y


@inlined
def settle(robots: Any, i: int, walls: Any) -> None:
    """Put robot `i` on the rims of what it would overlap.

    If it does not fit there, it stays where it was; and if it cannot stay, since it was placed on something, it gets a
    free place near by. If there is none, its place is no number, which the engine refuses.
    """
    x, y = aside(robots, i, walls)
    is_placed = False
    for k in range(-1, _TRIES + 1):
        is_placed = fits(robots, i, x, y, walls)
        if is_placed:
            break
        # Where it was, and then places along a spiral around it.
        way_x, way_y = direction((max(k, 0) * _GOLDEN) % 1.0)
        x = robots.before[i, 0] + 0.5 * walls[3] * math.sqrt(k + 1) * way_x
        y = robots.before[i, 1] + 0.5 * walls[3] * math.sqrt(k + 1) * way_y
    robots.position[i, 0] = x if is_placed else math.nan
    robots.position[i, 1] = y if is_placed else math.nan
