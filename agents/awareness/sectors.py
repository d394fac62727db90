"""Rings of range sensors: sectors around a robot, each measuring the distance to the nearest body in it."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import kernel

OWN_SECTORS = 16

_FULL_TURN = 2.0 * math.pi


@kernel
def sector_of(x: float, y: float, heading_x: float, heading_y: float, sectors: int) -> int:
    """Return the number of the sector of an offset, anticlockwise; the centre of sector 0 is straight ahead."""
    ahead = x * heading_x + y * heading_y
    left = y * heading_x - x * heading_y
    number = math.floor(math.atan2(left, ahead) * (sectors / _FULL_TURN) + 0.5)
    return number + sectors if number < 0 else number % sectors


@kernel
def read_ring(
    row: Any, first: int, sectors: int, heading: Any, seen: Any, edges: tuple[int, int], reach: float
) -> None:
    """Write the readings of one robot's ring to ``row[first:]``.

    For each sector the smallest distance divided by `reach`, or 1 if the sector is empty. `edges` are the robot's first
    entry in the neighbour list `seen`, and the next robot's.
    """
    for sector in range(sectors):
        row[first + sector] = 1.0
    for k in range(edges[0], edges[1]):
        sector = first + sector_of(seen.offset[k, 0], seen.offset[k, 1], heading[0], heading[1], sectors)
        reading = seen.distance[k] / reach
        if reading < row[sector]:
            row[sector] = reading
