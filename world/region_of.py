"""The region of an arena: `Arena.contains` of the arenas that ship, and the box around others, for kernels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.world.arena import Disc
from teamsight.world.circle import Circle
from teamsight.world.contract import Arena, Obstructed
from teamsight.world.polygon import Polygon
from teamsight.world.region import Region

Floats = npt.NDArray[np.float64]


def region_of(arena: Arena) -> Region:
    """Return where bodies may be in an arena; for one of a user, the box around it."""
    slack = arena._slack if isinstance(arena, (Obstructed, Polygon)) else 0.0
    inner, images = (arena.arena, arena._images) if isinstance(arena, Obstructed) else (arena, [])
    discs: list[tuple[float, float, float, float]] = []
    rings: list[tuple[Floats, bool]] = []
    # A class derived from one of these may have another `contains`.
    if type(inner) is Disc:
        discs.append((0.0, 0.0, inner.radius, 0.0))
    elif type(inner) is Polygon:
        rings.append((inner.vertices, False))
    for obstacle, shift in images:
        if type(obstacle) is Circle:
            discs.append((*(np.array(obstacle.centre) + shift).tolist(), obstacle.radius, 1.0))
        elif type(obstacle) is Polygon:
            rings.append((obstacle.vertices + shift, True))
    ends = np.cumsum([len(corners) for corners, _ in rings]).tolist()
    polygons = [
        (end - len(corners), end, int(is_obstacle)) for (corners, is_obstacle), end in zip(rings, ends, strict=True)
    ]
    corners = np.concatenate([np.zeros((0, 2)), *(corners for corners, _ in rings)])
    return Region(
        np.array(arena.bounds, float), np.array(discs, float).reshape(-1, 4), corners,
        np.array(polygons, np.int64).reshape(-1, 3), float(slack),
    )  # fmt: skip
