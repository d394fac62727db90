"""Placement: the rules for initial positions, and the starts of runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record
from teamsight.world.arena import Arena
from teamsight.world.motion import is_watched
from teamsight.world.noise import Stream, philox, stream_number
from teamsight.world.search import Search, proximity_graph

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


_CHANNELS = 3


class Request(NamedTuple):
    """The record of a call of `_fill`; k runs, n agents."""

    keys: Annotated[npt.NDArray[np.uint64], "k", 2]
    stream: Annotated[npt.NDArray[np.int64], "n"]
    member: Annotated[npt.NDArray[np.int64], "n"]
    numbers: Annotated[Points, _CHANNELS, "k", "n"]


REQUEST = Record(Request)
request_at = REQUEST.at


class Founders(NamedTuple):
    """Agents of a group at the start of a run, which were added together or follow the same rule.

    Attributes
    ----------
    number : int
        The group's number in its world; it selects the noise.
    size : int
        Number of agents, n.
    placement : {"uniform", "spread", "cells"} or ndarray, shape (n, 2), float64
        The rule for their positions, or the positions [length].
    spacing : float
        The radius of the discs that "spread" keeps apart [length].
    heading : ndarray, shape (n, 2), float64, optional
        Unit vectors; by default they are drawn.
    first : int
        The number of the first within the group; it selects the noise.
    """

    number: int
    size: int
    placement: str | Points
    spacing: float
    heading: Points | None = None
    first: int = 0

    def cut(self, members: int) -> Founders:
        """Return those whose number within the group is less than `members`."""
        size = max(min(self.size, members - self.first), 0)
        placement = self.placement if isinstance(self.placement, str) else self.placement[:size]
        heading = None if self.heading is None else self.heading[:size]
        return self._replace(size=size, placement=placement, heading=heading)

    def followed_by(self, other: Founders) -> list[Founders]:
        """Return these and the next ones of the same group, as one if the same rule can place them together."""
        one, two = self.placement, other.placement
        placement: str | Points
        if isinstance(one, str) and isinstance(two, str) and one == two:
            placement = one
        elif isinstance(one, np.ndarray) and isinstance(two, np.ndarray):
            placement = np.concatenate([one, two])
        else:
            return [self, other]
        heading = None
        if self.heading is not None and other.heading is not None:
            heading = np.concatenate([self.heading, other.heading])
        elif self.heading is not None or other.heading is not None:
            return [self, other]
        size, spacing = self.size + other.size, max(self.spacing, other.spacing)
        return [self._replace(size=size, placement=placement, spacing=spacing, heading=heading)]


class Starts(NamedTuple):
    """The initial positions and headings of all agents, for each of k runs.

    Attributes
    ----------
    position : ndarray, shape (k, n, 2), float64
        [length]; one group after the other.
    heading : ndarray, shape (k, n, 2), float64
        Unit vectors.
    """

    position: Points
    heading: Points


def starts(arena: Arena, groups: Sequence[Founders], keys: npt.NDArray[np.uint64]) -> Starts:
    """Place the agents of all groups for several runs at once.

    Parameters
    ----------
    arena : Arena
        The arena of all runs.
    groups : sequence of Founders
        All groups of the world; those of one group follow one another.
    keys : ndarray, shape (k, 2), uint64
        The noise key of each run, from `noise.key_of`.

    Returns
    -------
    Starts
        Each run depends on its own key only; computing several at once saves time.

    Raises
    ------
    ValueError
        If the arena's ``place`` returns positions outside the arena.
    """
    numbers = _numbers(groups, keys)
    angle = 2 * math.pi * numbers[2]
    heading = np.empty((*angle.shape, 2))
    heading[..., 0], heading[..., 1] = np.cos(angle), np.sin(angle)
    last = list(accumulate(one.size for one in groups))
    for one, end in zip(groups, last, strict=True):
        if one.heading is not None:
            heading[:, end - one.size : end] = one.heading
    if not is_watched(arena) and all(isinstance(one.placement, str) and one.placement == "uniform" for one in groups):
        return Starts(np.ascontiguousarray(arena.place(*numbers[:2])), heading)
    position = np.empty_like(heading)
    for run in range(len(keys)):
        for one, end in zip(groups, last, strict=True):
            here = slice(end - one.size, end)
            position[run, here] = _places(arena, one, np.ascontiguousarray(numbers[:2, run, here]))
    return Starts(position, heading)


def _numbers(groups: Sequence[Founders], keys: npt.NDArray[np.uint64]) -> Points:
    """Return uniform numbers in (0, 1), shape (channels, k, n): those of `noise.uniforms` at tick 0."""
    if len(groups) == 1:
        # The usual case of agents who come, in a fifth of the time.
        (one,) = groups
        stream = np.full(one.size, stream_number(Stream.PLACEMENT, one.number), np.int64)
        return _filled(keys, stream, np.arange(one.first, one.first + one.size))
    sizes = [one.size for one in groups]
    stream = np.repeat([stream_number(Stream.PLACEMENT, one.number) for one in groups], sizes).astype(np.int64)
    member = np.concatenate([one.first + np.arange(one.size) for one in groups] or [np.zeros(0, np.int64)])
    return _filled(keys, stream, member)


def _filled(keys: npt.NDArray[np.uint64], stream: npt.NDArray[np.int64], member: npt.NDArray[np.int64]) -> Points:
    keys = np.ascontiguousarray(keys, np.uint64)
    numbers = np.empty((_CHANNELS, len(keys), len(member)))
    _FILL(REQUEST.pack(Request(keys, stream, member, numbers)))
    return numbers


def _fill(address: int) -> int:
    keys, stream, member, numbers = request_at(address)
    for channel in range(_CHANNELS):
        for run in range(keys.shape[0]):
            for i in range(member.shape[0]):
                word, _, _, _ = philox(
                    np.uint64(0), np.uint64(member[i]), np.uint64(channel), np.uint64(stream[i]),
                    keys[run, 0], keys[run, 1],
                )  # fmt: skip
                numbers[channel, run, i] = (np.float64(np.int64(word)) + 0.5) * 2.0**-32
    return 0


_FILL = Entry(_fill)


def _places(arena: Arena, group: Founders, numbers: Points) -> Points:
    if not isinstance(group.placement, str):
        return group.placement
    if group.placement == "cells":
        return in_cells(arena, numbers)
    is_spread = group.placement == "spread"
    places = spread(arena, numbers, group.spacing) if is_spread else np.asarray(arena.place(*numbers))
    if is_watched(arena) and not (inside := np.asarray(arena.contains(places))).all():
        wrong = tuple(places[int(np.argmin(inside))].tolist())
        raise ValueError(
            f"{arena}: place() returns {wrong}, which is outside according to contains(); check the arena with "
            "check_arena()"
        )
    return places
