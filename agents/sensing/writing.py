"""Writing entries of the list of what is sensed."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined


@inlined
def put(sensed: Any, edge: Any, index: int, x: float, y: float, distance: float) -> None:
    """Write one entry."""
    sensed.identity[edge] = index
    sensed.offset[edge, 0] = x
    sensed.offset[edge, 1] = y
    sensed.distance[edge] = distance
