"""The ring of range sensors: sectors around a robot, each reading the distance to the nearest body in it."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import kernel

OWN_SECTORS = 16

_FULL_TURN = 2.0 * math.pi


@kernel
def sector_of(x: float, y: float, heading_x: float, heading_y: float, sectors: int) -> int:
    """Return the sector that holds a bearing; sector 0 is centred straight ahead, and they go anticlockwise."""
    ahead = x * heading_x + y * heading_y
    left = y * heading_x - x * heading_y
    number = math.floor(math.atan2(left, ahead) * (sectors / _FULL_TURN) + 0.5)
    return number + sectors if number < 0 else number % sectors


@kernel
def read_ring(
    row: Any, first: int, sectors: int, heading: Any, seen: Any, edges: tuple[int, int], reach: float
) -> None:
    """Write the readings of one robot's ring.

    Parameters
    ----------
    row : ndarray, shape (width,), float32
        Elements `first` to ``first + sectors`` are written: the distance over the range, 1 where there is nothing.
    first, sectors : int
        Where the ring begins, and how many sectors it has.
    heading : ndarray, shape (2,), float64
        The robot's heading.
    seen : NeighbourList
        What the group sees.
    edges : tuple of two int
        Which of the sightings are the robot's.
    reach : float
        The range [length].
    """
    for sector in range(sectors):
        row[first + sector] = 1.0
    for k in range(edges[0], edges[1]):
        sector = first + sector_of(seen.offset[k, 0], seen.offset[k, 1], heading[0], heading[1], sectors)
        reading = seen.distance[k] / reach
        if reading < row[sector]:
            row[sector] = reading
