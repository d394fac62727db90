"""Rings of range sensors: sectors around a robot, each measuring the distance to the nearest body in it."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined, kernel

#: Number of sectors of the ring with which a robot senses targets: the inputs of its own.
OWN_SECTORS = 16

_FULL_TURN = 2.0 * math.pi
# Twice the largest error of `_near_angle` [rad].
_MARGIN = 2e-5


@inlined
def _near_angle(left: float, ahead: float) -> float:
    """Return atan2(left, ahead) to within 1e-5, in a third of the time; NaN for (0, 0).

    Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 4.4.49.
    """
    wide, high = abs(ahead), abs(left)
    t = min(wide, high) / max(wide, high)
    s = t * t
    angle = t * (0.999866 + s * (-0.3302995 + s * (0.180141 + s * (-0.085133 + s * 0.0208351))))
    angle = 0.5 * math.pi - angle if high > wide else angle
    angle = math.pi - angle if ahead < 0.0 else angle
    return -angle if left < 0.0 else angle


@inlined
def sector_of(x: float, y: float, heading_x: float, heading_y: float, sectors: int) -> int:
    """Return the number of the sector of an offset, anticlockwise; the centre of sector 0 is straight ahead."""
    ahead = x * heading_x + y * heading_y
    left = y * heading_x - x * heading_y
    scale = sectors / _FULL_TURN
    at = _near_angle(left, ahead) * scale + 0.5
    number = math.floor(at)
    # Near the edge of a sector, and for NaN, the exact angle decides, so that it decides everywhere.
    if not _MARGIN * scale < at - number < 1.0 - _MARGIN * scale:
        number = math.floor(math.atan2(left, ahead) * scale + 0.5)
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


@kernel
def situate_targets(scene: Any, parameters: Any, situation: Any) -> None:
    """Write the own part of the situation: a heading-relative ring of `OWN_SECTORS` target sectors."""
    targets = scene.targets
    for i in range(situation.shape[0]):
        edges = (targets.start[i], targets.start[i + 1])
        reach = scene.sensing_range[i] * scene.farthest
        read_ring(situation[i], 0, OWN_SECTORS, scene.heading[i], targets, edges, reach)
