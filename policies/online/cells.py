"""Cells: places relative to a robot as whole numbers, for the rows of a table."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined


@inlined
def is_within(offset: Any, k: int, depth: float) -> bool:
    """Whether neighbour `k` is in the square that reaches `depth` cells to each side."""
    # Half a cell of tolerance, so that rounding decides nothing.
    return bool(abs(offset[k, 0]) < depth + 0.5 and abs(offset[k, 1]) < depth + 0.5)


@inlined
def closest(seen: Any, i: int, depth: float, fraction: float) -> int:
    """Return the nearest neighbour of robot `i` within the depth, a random one of equally near ones; −1 for none.

    Parameters
    ----------
    seen : NeighbourList
        The neighbours.
    i : int
        The robot.
    depth : float
        Cells to each side.
    fraction : float
        A uniform number in (0, 1), which chooses.
    """
    best = -1
    equals = 0
    for k in range(seen.start[i], seen.start[i + 1]):
        if is_within(seen.offset, k, depth):
            if best < 0 or seen.distance[k] < seen.distance[best]:
                best = k
                equals = 1
            elif seen.distance[k] == seen.distance[best]:
                equals += 1
    if equals > 1:
        chosen = int(fraction * equals)
        for k in range(best, seen.start[i + 1]):
            if is_within(seen.offset, k, depth) and seen.distance[k] == seen.distance[best]:
                if chosen == 0:
                    return k
                chosen -= 1
    return best


@inlined
def at_rank(seen: Any, i: int, rank: int, depth: float) -> int:
    """Return the neighbour of robot `i` of this rank, 0 for the nearest, of those within the depth; −1 for none.

    Of equally near ones the first in the list comes first.
    """
    chosen = -1
    for _ in range(rank + 1):
        after = chosen
        chosen = -1
        for k in range(seen.start[i], seen.start[i + 1]):
            if not is_within(seen.offset, k, depth):
                continue
            far = seen.distance[k]
            if after >= 0 and (far < seen.distance[after] or (far == seen.distance[after] and k <= after)):
                continue
            if chosen < 0 or far < seen.distance[chosen]:
                chosen = k
        if chosen < 0:
            return -1
    return chosen


@inlined
def cell(seen: Any, k: int, extent: int) -> int:
    """Return the number of the cell of neighbour `k` in a square that reaches `extent` cells to each side.

    The number after the last cell is for no neighbour, k = −1, and for one beyond the square.
    """
    side = 2 * extent + 1
    if k < 0 or not is_within(seen.offset, k, extent):
        return side * side
    return (_rounded(seen.offset[k, 0]) + extent) * side + _rounded(seen.offset[k, 1]) + extent


@inlined
def _rounded(number: float) -> int:
    return int(number + 0.5) if number >= 0.0 else -int(0.5 - number)


def cells(extent: int) -> int:
    """Return how many numbers `cell` gives."""
    return (2 * extent + 1) ** 2 + 1
