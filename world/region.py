"""Where bodies may be: a region for kernels, and that of an arena."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import kernel
from teamsight.world.arena import Disc
from teamsight.world.circle import Circle
from teamsight.world.contract import Arena, Obstructed
from teamsight.world.polygon import Polygon

Floats = npt.NDArray[np.float64]


class Region(NamedTuple):
    """An area: what is inside all of some shapes and inside none of others.

    Attributes
    ----------
    box : ndarray, shape (2, 2), float64
        The lowest and the highest corner of the box around it.
    discs : ndarray, shape (discs, 4), float64
        Discs: centre, radius, and 1 for one that is an obstacle, else 0.
    corners : ndarray, shape (corners, 2), float64
        The corners of all polygons, one polygon after the other.
    polygons : ndarray, shape (polygons, 3), int64
        For each polygon: its first corner, that after its last, and 1 for an obstacle, else 0.
    slack : float
        So far a body may be beyond a wall through rounding [length].
    """

    box: Annotated[Floats, 2, 2]
    discs: Annotated[Floats, ".discs", 4]
    corners: Annotated[Floats, ".corners", 2]
    polygons: Annotated[npt.NDArray[np.int64], ".polygons", 3]
    slack: float


@kernel
def _is_within(corners: Any, first: int, last: int, x: float, y: float) -> bool:
    """Whether a place is inside a polygon."""
    inside = False
    before = last - 1
    for at in range(first, last):
        x_0 = corners[before, 0]
        y_0 = corners[before, 1]
        x_1 = corners[at, 0]
        y_1 = corners[at, 1]
        if (y_0 > y) != (y_1 > y) and x < x_0 + (y - y_0) * ((x_1 - x_0) / (y_1 - y_0)):
            inside = not inside
        before = at
    return inside


@kernel
def _distance_to_walls(corners: Any, first: int, last: int, x: float, y: float) -> float:
    """Return the distance of a place to the nearest wall of a polygon."""
    nearest = math.inf
    before = last - 1
    for at in range(first, last):
        edge_x = corners[at, 0] - corners[before, 0]
        edge_y = corners[at, 1] - corners[before, 1]
        off_x = x - corners[before, 0]
        off_y = y - corners[before, 1]
        share = (off_x * edge_x + off_y * edge_y) / (edge_x * edge_x + edge_y * edge_y)
        share = min(max(share, 0.0), 1.0)
        gap_x = off_x - share * edge_x
        gap_y = off_y - share * edge_y
        nearest = min(nearest, gap_x * gap_x + gap_y * gap_y)
        before = at
    return math.sqrt(nearest)


@kernel
def is_in_region(region: Any, x: float, y: float) -> bool:
    """Whether a place is in a region; NaN is not."""
    box, slack = region.box, region.slack
    if not (
        box[0, 0] - slack <= x <= box[1, 0] + slack and box[0, 1] - slack <= y <= box[1, 1] + slack
    ):
        return False
    for d in range(region.discs.shape[0]):
        off_x = x - region.discs[d, 0]
        off_y = y - region.discs[d, 1]
        radius = region.discs[d, 2]
        if region.discs[d, 3] != 0.0:
            if math.sqrt(off_x * off_x + off_y * off_y) < radius - slack:
                return False
        elif off_x * off_x + off_y * off_y > (radius + slack) * (radius + slack):
            return False
    for p in range(region.polygons.shape[0]):
        first = region.polygons[p, 0]
        last = region.polygons[p, 1]
        is_obstacle = region.polygons[p, 2] != 0
        # On the right side, or so near to the wall that rounding may have put it on the other.
        if _is_within(region.corners, first, last, x, y) == is_obstacle and not (
            _distance_to_walls(region.corners, first, last, x, y) <= slack
        ):
            return False
    return True


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
