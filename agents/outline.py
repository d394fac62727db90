"""The outline of an arena, as lines to draw."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.world.arena import Box, Torus
from teamsight.world.contract import Arena, Obstructed

Floats = npt.NDArray[np.float64]

#: The colours of groups by number, then again from the first; readable on light and dark pages.
COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#bcbd22")

# Cells along each side of the box around an arena whose shape is found with `contains`.
_CELLS = 48
# Each halves the error of a point of the wall: 2⁻¹⁶ of a cell.
_HALVINGS = 16


def walls(arena: Arena) -> list[Floats]:
    """Return lines along the walls of an arena, or along its seam where it repeats.

    Parameters
    ----------
    arena : Arena
        Any arena. Walls that its `boundary` does not describe are found with `contains`; narrow parts may be missing.

    Returns
    -------
    list of ndarray, shape (k, 2), float64
        Lines through k points [length].
    """
    if isinstance(arena, Obstructed):
        return walls(arena.arena)
    # A class that inherits `boundary` and defines `contains` has another shape than its base.
    boundary, contains = (
        next(home for home in type(arena).__mro__ if name in vars(home)) for name in ("boundary", "contains")
    )
    if type(arena) in (Box, Torus) or issubclass(boundary, contains):
        return [_closed(arena.boundary)]
    return _chained(_walls(arena))


def obstacles(arena: Arena) -> list[Floats]:
    """Return lines around the obstacles of an arena, each of shape (k, 2) [length]."""
    return [_closed(vertices) for vertices in arena.outline().obstacles]


def _closed(vertices: Floats) -> Floats:
    return np.concatenate([vertices, vertices[:1]])


def circle(x: float, y: float, radius: float, corners: int) -> Floats:
    """Return a closed line around a circle, shape (corners + 1, 2)."""
    angle = np.linspace(0.0, 2 * np.pi, corners + 1)
    line = np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=-1)
    line[-1] = line[0]
    return line


def square(x: float, y: float, half: float) -> Floats:
    """Return a closed line around a square of this half side, shape (5, 2)."""
    return np.array([x, y]) + half * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)], float)


def _walls(arena: Arena) -> Floats:
    """Return pieces of the walls, shape (pieces, 2, 2): marching squares with points found by bisection."""
    low, high = arena.bounds
    # One cell more on each side, so that walls along the box are crossed too.
    side = (high - low) / _CELLS
    ticks = [np.linspace(low[axis] - side[axis], high[axis] + side[axis], _CELLS + 3) for axis in (0, 1)]
    nodes = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1)
    along_x, along_y = _crossings(arena, nodes[:-1], nodes[1:]), _crossings(arena, nodes[:, :-1], nodes[:, 1:])
    # The four sides of each cell: below, left, above, right. Neighbouring sides are joined where all are crossed.
    sides = np.stack([along_x[:, :-1], along_y[:-1], along_x[:, 1:], along_y[1:]], axis=-2).reshape(-1, 4, 2)
    is_crossed = ~np.isnan(sides[..., 0])
    pairs = sides[is_crossed.sum(axis=1) == 2]
    once = pairs[~np.isnan(pairs[..., 0])].reshape(-1, 2, 2)
    return np.concatenate([once, sides[is_crossed.all(axis=1)].reshape(-1, 2, 2)])


def _chained(pieces: Floats) -> list[Floats]:
    """Return pieces, shape (pieces, 2, 2), as few lines: pieces that share an end follow each other."""
    following: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for (x0, y0), (x1, y1) in pieces.tolist():
        following.setdefault((x0, y0), []).append((x1, y1))
        following.setdefault((x1, y1), []).append((x0, y0))
    lines = []
    # Lines that end somewhere begin there; the others are closed.
    for start in sorted(following, key=lambda point: len(following[point]) != 1):
        line = [start]
        while following[line[-1]]:
            step = following[line[-1]].pop()
            following[step].remove(line[-1])
            line.append(step)
        if len(line) > 1:
            lines.append(np.array(line))
    return lines


def _crossings(arena: Arena, start: Floats, end: Floats) -> Floats:
    """Return where the wall crosses the way from each start to its end; NaN where both are on the same side."""
    shape, start, end = start.shape, start.reshape(-1, 2), end.reshape(-1, 2)
    points, is_inside = np.full(start.shape, np.nan), arena.contains(start)
    (crossed,) = np.nonzero(is_inside != arena.contains(end))
    one, two, first = start[crossed], end[crossed], is_inside[crossed]
    for _ in range(_HALVINGS):
        middle = (one + two) / 2
        is_before = (arena.contains(middle) == first)[:, None]
        one, two = np.where(is_before, middle, one), np.where(is_before, two, middle)
    points[crossed] = (one + two) / 2
    return points.reshape(shape)
