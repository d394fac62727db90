"""Placement: where bodies are put so that they do not overlap."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from teamsight.world.arena import Arena
from teamsight.world.proximity.search import Search, proximity_graph

Points = npt.NDArray[np.float64]

#: The rules of placement by name.
PLACEMENTS = ("uniform", "spread", "cells")

_SWEEPS = 400
_SAMPLES = 40


def spread(arena: Arena, numbers: Points, radius: float) -> Points:
    """Place bodies so that discs around them neither overlap nor cross the wall; if that is impossible, evenly.

    Parameters
    ----------
    arena : Arena
        The arena.
    numbers : ndarray, shape (2, n), float64
        Uniform numbers in (0, 1), which determine the first arrangement.
    radius : float
        The radius of the discs [length]: a sensing range.

    Returns
    -------
    ndarray, shape (n, 2), float64
        Positions [length].

    Notes
    -----
    *Source:* §6, "a group of stationary non overlapping robots". The paper does not say how they were placed. Here
    bodies that are too close push each other apart, first from random positions, then from an even arrangement, in
    which each body is at the centre of the points nearest to it (Lloyd's method). If discs still overlap, the even
    arrangement over the whole arena is returned.
    """
    margin = radius if arena.fits(radius) else 0.0
    points = arena.place(numbers[0], numbers[1], margin)
    # Discs with a larger area than the arena surely overlap.
    is_crowded = margin > 0 and len(points) * math.pi * radius**2 > 1.01 * arena.area
    for even in () if is_crowded else (False, True):
        start = _even_out(arena, points, margin) if even else points
        points = _push_apart(arena, start, radius, margin, is_last=even)
        if _closest(arena, points) >= 2 * radius * (1 - 1e-9):
            return points
    return _even_out(arena, arena.place(numbers[0], numbers[1]), 0.0)


def in_cells(arena: Arena, numbers: Points) -> Points:
    """Place bodies at the centres of random cells of side 1, which begin at the lower left corner of the arena.

    Several bodies can be in one cell.

    Parameters
    ----------
    arena : Arena
        The arena.
    numbers : ndarray, shape (2, n), float64
        Uniform numbers in (0, 1), which choose the cells.

    Returns
    -------
    ndarray, shape (n, 2), float64
        Positions [length].

    Raises
    ------
    ValueError
        If the centre of a cell is outside the arena.
    """
    corner = np.asarray(arena.bounds[0], float)
    places = np.floor(np.asarray(arena.place(numbers[0], numbers[1])) - corner) + corner + 0.5
    if not (inside := np.asarray(arena.contains(places))).all():
        wrong = tuple(places[int(np.argmin(inside))].tolist())
        raise ValueError(
            f"placement='cells': the centre {wrong} of a cell is outside {arena}; use a Box or a Torus whose sides are "
            "whole numbers"
        )
    return np.asarray(places)


def _closest(arena: Arena, points: Points) -> float:
    reach = 2 * math.sqrt(arena.area / max(len(points), 1))
    wraps = [side / 2 for side in arena.period if side > 0]
    graph = proximity_graph(points, None, min([reach, *wraps]), arena)
    return float(graph.distance.min(initial=reach))


def _push_apart(arena: Arena, points: Points, radius: float, margin: float, *, is_last: bool) -> Points:
    """Return the points after all sweeps; the last attempt ends early if it comes to rest with discs that overlap."""
    apart = 2 * radius * (1 + 1e-6)
    limits = [side / 2 for side in arena.period if side > 0]
    points = np.array(points)
    search = Search(points, np.full(len(points), min([apart, *limits])), len(points), 0, arena)
    every = np.arange(len(points))
    for _ in range(_SWEEPS):
        search.x[:], search.y[:] = points.T
        if not search.run():
            break
        graph = search.graph
        push = -0.5 * (apart - graph.distance)[:, None] * (graph.offset / np.maximum(graph.distance, 1e-9)[:, None])
        observer = np.repeat(every, graph.degree)
        total = [np.bincount(observer, along, len(points)) for along in push.T]
        pushed = arena.inside(points + np.transpose(total), margin)
        rests = is_last and np.abs(pushed - points).max() < 1e-12 * radius
        points[:] = pushed
        if rests and graph.distance.min() < 2 * radius * (1 - 1e-6):
            break
    return points


def _even_out(arena: Arena, points: Points, margin: float) -> Points:
    from scipy.spatial import cKDTree

    # Samples of equal parts of the area represent the arena.
    count = _SAMPLES * max(len(points), 25)
    step = np.arange(count)
    samples = arena.place((step + 0.5) / count, (step * 0.6180339887498949) % 1.0, margin)
    period = np.array(arena.period)
    wraps = bool(period.any())
    sight = arena.sight
    # The centre of places inside may be outside of an arena that is not convex.
    leaves = wraps or len(sight.segments) + len(sight.discs) > 0
    for _ in range(100):
        if wraps:
            owner = cKDTree(_shifted(points, period), boxsize=period).query(_shifted(samples, period))[1]
        else:
            owner = cKDTree(points).query(samples)[1]
        ways = arena.displacement(points[owner], samples)
        weight = np.bincount(owner, minlength=len(points))
        centre = np.stack([np.bincount(owner, ways[:, axis], len(points)) for axis in (0, 1)], axis=-1)
        shift = centre / np.maximum(weight, 1)[:, None]
        points = points + shift
        if leaves:
            points = arena.inside(points, margin)
        if np.abs(shift).max() < 1e-3 * math.sqrt(arena.area / len(points)):
            break
    return points


def _shifted(points: Points, period: Points) -> Points:
    """Return points as `cKDTree` requires them: in [0, period) along an axis that repeats."""
    return np.where(period > 0, (points + period / 2) % np.where(period > 0, period, 1.0), points)
