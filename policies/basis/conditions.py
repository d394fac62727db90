"""The conditions of a robot, as the row of a table: has it a puck, is it at home, is it night, who is near?"""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.columns import column_of

#: How the intruders that are near enter the row.
INTRUDERS = ("bit", "count", "ring")
BIT, COUNT, RING = range(3)

_TIE = 1e-6


@inlined
def nearest_teammate(i: int, percept: Any, reach: float) -> float:
    """Return the distance of the nearest teammate that robot `i` perceives within reach; the reach for none."""
    seen = percept.teammates
    nearest = reach
    for k in range(seen.start[i], seen.start[i + 1]):
        nearest = min(nearest, seen.distance[k])
    return nearest


@inlined
def _sector(x: float, y: float, heading: Any, sectors: Any) -> int:
    """Return the sector of an offset, anticlockwise from straight ahead: the first whose centre is nearest."""
    ahead = x * heading[0] + y * heading[1]
    left = y * heading[0] - x * heading[1]
    best = 0
    most = sectors[0, 0] * ahead + sectors[0, 1] * left
    for s in range(1, sectors.shape[0]):
        along = sectors[s, 0] * ahead + sectors[s, 1] * left
        # A robot that flees has the other straight behind, where odd numbers of sectors meet: rounding decides nothing.
        if along > most + _TIE * (abs(ahead) + abs(left)):
            best = s
            most = along
    return best


@inlined
def crowd(i: int, percept: Any, kind: int, most: int, reach: float, sectors: Any) -> int:
    """Return the number that stands for the teammates within reach of robot `i`; 0 for none.

    Parameters
    ----------
    i : int
        The robot.
    percept : Percept
        What it perceives.
    kind : int
        `BIT`, `COUNT` (of at most `most`), or `RING`: a bit for each of `most` sectors.
    most : int
        δ.
    reach : float
        Distance within which a teammate is an intruder [length].
    sectors : ndarray, shape (most, 2)
        For `RING`, the centres of the sectors as unit vectors, relative to the heading.
    """
    seen = percept.teammates
    found = 0
    for k in range(seen.start[i], seen.start[i + 1]):
        if seen.distance[k] < reach:
            if kind == RING:
                found |= 1 << _sector(seen.offset[k, 0], seen.offset[k, 1], percept.heading[i], sectors)
            else:
                found = min(found + 1, most)
    return found


@inlined
def is_set(column: Any, percept: Any, i: int) -> int:
    """Return 1 if a column of robot `i` is above 0, and 0 otherwise, also where it has none."""
    return 1 if column_of(column, percept.identity[i]) > 0.0 else 0
