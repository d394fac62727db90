"""The area of what is free among walls, by integrating the free length of lines along x."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.world.free_places import WalledArena
from teamsight.world.nearest import crossings

Points = npt.NDArray[np.float64]

_NODES = 24
# Lines at once, to limit the memory.
_LINES = 1000


def free_area(arena: WalledArena) -> float:
    """Return the area of all that `arena` contains, accurate to rounding.

    Between the heights at which walls begin, end or meet, the free length is a sum of straight lines and arcs, which
    a quadrature whose nodes lie more densely at the ends integrates to rounding.
    """
    low, high = arena.bounds
    walls = arena.near_walls
    circles = np.abs(walls.discs)
    circles[:, :2] = walls.discs[:, :2]
    tops = [circles[:, 1] - circles[:, 2], circles[:, 1] + circles[:, 2]]
    ends = [walls.segments[:, 1], walls.segments[:, 3], *tops, crossings(walls.segments, circles)[:, 1]]
    heights = np.unique(np.clip(np.concatenate([*ends, [low[1], high[1]]]), low[1], high[1]))
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    angle = 0.5 * np.pi * (node + 1.0)
    half = 0.5 * np.diff(heights)[:, None]
    lines = (heights[:-1, None] + half * (1.0 - np.cos(angle))).ravel()
    weights = (half * (0.5 * np.pi * weight * np.sin(angle))).ravel()
    parts = np.array_split(np.arange(len(lines)), len(lines) // _LINES + 1)
    return float(sum(np.sum(weights[part] * _free_length(arena, lines[part], circles)) for part in parts))


def _free_length(arena: WalledArena, y: Points, circles: Points) -> Points:
    """Return the length of the free parts of the line along x at each height."""
    low, high = arena.bounds
    x0, y0, x1, y1 = arena.near_walls.segments.T
    height = y[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        on_segments = np.where((y0 > height) != (y1 > height), x0 + (height - y0) * ((x1 - x0) / (y1 - y0)), np.nan)
        half = np.sqrt(circles[:, 2] ** 2 - (height - circles[:, 1]) ** 2)
    ends = np.broadcast_to([low[0], high[0]], (len(y), 2))
    places = np.concatenate([ends, on_segments, circles[:, 0] - half, circles[:, 0] + half], axis=1)
    places = np.sort(np.clip(np.where(np.isnan(places), high[0], places), low[0], high[0]), axis=1)
    # Where a line meets few walls, the last places are all at the end.
    places = places[:, : int((places < high[0]).sum(axis=1).max()) + 1]
    middle = 0.5 * (places[:, :-1] + places[:, 1:])
    is_free = arena.contains(np.stack([middle, np.broadcast_to(height, middle.shape)], axis=-1))
    return np.asarray(np.sum(np.diff(places, axis=1) * is_free, axis=1))
