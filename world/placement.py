"""Placement: the rules for initial positions, and the starts of runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, kernel
from teamsight.world.arena import Arena, kernel_period
from teamsight.world.motion import is_watched
from teamsight.world.noise import Stream, philox, stream_number
from teamsight.world.search import Search, proximity_graph
from teamsight.world.walls import ROUNDING, clearance, repeated

Points = npt.NDArray[np.float64]

#: The rules of placement by name.
PLACEMENTS = ("uniform", "spread", "cells")

# Given places at which two bodies touch are taken, whatever rounding says.
_TOUCHING = 1e-14
# Bodies of more radii than these are all placed as far from walls as the smallest, and drawn again if that is too near.
_MOST_RADII = 16
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
    """The record of a call of `_fill`; k runs or attempts, n agents."""

    keys: Annotated[npt.NDArray[np.uint64], "k", 2]
    attempt: Annotated[npt.NDArray[np.int64], "k"]
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
    radius : ndarray, shape (n,), float64, optional
        The radii of bodies that must not overlap [length]; by default they may, as those of radius 0.
    turn : int
        Bodies that must not overlap are placed in this order.
    """

    number: int
    size: int
    placement: str | Points
    spacing: float
    heading: Points | None = None
    first: int = 0
    radius: Points | None = None
    turn: int = 0

    def without(self, gone: npt.NDArray[np.bool_]) -> Founders:
        """Return these, of whom some members of the group, shape (members,), take no room."""
        if self.radius is None:
            return self
        return self._replace(radius=np.where(gone[self.first : self.first + self.size], 0.0, self.radius))

    def cut(self, members: int) -> Founders:
        """Return those whose number within the group is less than `members`."""
        size = max(min(self.size, members - self.first), 0)
        placement = self.placement if isinstance(self.placement, str) else self.placement[:size]
        heading = None if self.heading is None else self.heading[:size]
        radius = None if self.radius is None else self.radius[:size]
        return self._replace(size=size, placement=placement, heading=heading, radius=radius)

    def followed_by(self, other: Founders) -> list[Founders]:
        """Return these and the next ones of the same group, as one if the same rule can place them together."""
        if self.radius is not None or other.radius is not None:
            # Each is placed in its turn.
            return [self, other]
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


class NoRoomError(ValueError):
    """Raised for bodies that have no room."""


class Solid(NamedTuple):
    """Bodies that others must not overlap: where they are, shape (n, 2), and their radii, shape (n,) [length]."""

    position: Points
    radius: Points


def starts(
    arena: Arena, groups: Sequence[Founders], keys: npt.NDArray[np.uint64], taken: Solid | None = None
) -> Starts:
    """Place the agents of all groups for several runs at once.

    Parameters
    ----------
    arena : Arena
        The arena of all runs.
    groups : sequence of Founders
        All groups of the world; those of one group follow one another.
    keys : ndarray, shape (k, 2), uint64
        The noise key of each run, from `noise.key_of`.
    taken : Solid, optional
        Bodies that are there already.

    Returns
    -------
    Starts
        Each run depends on its own key only; computing several at once saves time.

    Raises
    ------
    ValueError
        If the arena's ``place`` returns positions outside the arena, or bodies that must not overlap do not fit.

    Notes
    -----
    Bodies that must not overlap are placed one after the other; one whose place is taken is drawn again.
    """
    numbers = _numbers(groups, keys)
    angle = 2 * math.pi * numbers[2]
    heading = np.empty((*angle.shape, 2))
    heading[..., 0], heading[..., 1] = np.cos(angle), np.sin(angle)
    last = list(accumulate(one.size for one in groups))
    for one, end in zip(groups, last, strict=True):
        if one.heading is not None:
            heading[:, end - one.size : end] = one.heading
    is_drawn = all(isinstance(one.placement, str) and one.placement == "uniform" for one in groups)
    if is_drawn and not is_watched(arena) and all(one.radius is None for one in groups):
        return Starts(np.ascontiguousarray(arena.place(*numbers[:2])), heading)
    position = np.empty_like(heading)
    is_solid = any(one.radius is not None for one in groups)
    for run in range(len(keys)):
        apart = Apart(arena, taken) if is_solid else None
        for one, end in sorted(zip(groups, last, strict=True), key=lambda pair: pair[0].turn):
            here = slice(end - one.size, end)
            drawn = np.ascontiguousarray(numbers[:2, run, here])
            if apart is None or one.radius is None:
                position[run, here] = _places(arena, one, drawn)
            else:
                position[run, here] = apart.place(one, drawn, keys[run])
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


def _filled(
    keys: npt.NDArray[np.uint64],
    stream: npt.NDArray[np.int64],
    member: npt.NDArray[np.int64],
    attempt: npt.NDArray[np.int64] | None = None,
) -> Points:
    keys = np.ascontiguousarray(keys, np.uint64)
    numbers = np.empty((_CHANNELS, len(keys), len(member)))
    attempt = np.zeros(len(keys), np.int64) if attempt is None else attempt
    _FILL(REQUEST.pack(Request(keys, attempt, stream, member, numbers)))
    return numbers


def _fill(address: int) -> int:
    keys, attempt, stream, member, numbers = request_at(address)
    for channel in range(_CHANNELS):
        for run in range(keys.shape[0]):
            for i in range(member.shape[0]):
                word, _, _, _ = philox(
                    np.uint64(attempt[run]), np.uint64(member[i]), np.uint64(channel), np.uint64(stream[i]),
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


class Placing(NamedTuple):
    """The record of a call of `_place`: bodies that are placed one after the other so that none overlaps another.

    Attributes
    ----------
    position, radius : ndarray, shape (n, 2) and (n,), float64
        Where all are, and their radii [length].
    is_placed : ndarray, shape (n,), bool
        Whether each has its place.
    rows : ndarray, shape (w,), int64
        The bodies to place, in this order.
    candidates : ndarray, shape (k, w, 2), float64
        Places to try for each, in this order [length]; NaN is none.
    keeps : bool
        Whether all take their first candidate, whatever is there.
    period : ndarray, shape (2,), float64
        That of the arena, from `kernel_period`.
    low, width : ndarray, shape (2,), float64
        The lowest corner of the arena, and the sides of a cell, at least the largest sum of two radii [length].
    cells : ndarray, shape (rows, columns), int64
        The last body that was placed in each cell; −1 for none.
    next_one : ndarray, shape (n,), int64
        The body that was placed in the same cell before; −1 for none.
    """

    position: Annotated[Points, "n", 2]
    radius: Annotated[Points, "n"]
    is_placed: Annotated[npt.NDArray[np.bool_], "n"]
    rows: Annotated[npt.NDArray[np.int64], "w"]
    candidates: Annotated[Points, "attempts", "w", 2]
    keeps: bool
    period: Annotated[Points, 2]
    low: Annotated[Points, 2]
    width: Annotated[Points, 2]
    cells: Annotated[npt.NDArray[np.int64], "rows", "columns"]
    next_one: Annotated[npt.NDArray[np.int64], "n"]


PLACING = Record(Placing)
placing_at = PLACING.at


@kernel
def _overlaps(address: int, i: int, x: float, y: float, row: int, column: int) -> bool:
    """Whether a body at (x, y), in this cell, would overlap one that is placed."""
    here = placing_at(address)
    rows, columns = here.cells.shape
    if here.radius[i] == 0.0:
        return False
    # Of few cells each is looked at once; where the arena repeats, they are neighbours across the seam.
    for up in range(min(rows, 3)):
        for across in range(min(columns, 3)):
            near_row = up if rows < 3 else row + up - 1
            near_column = across if columns < 3 else column + across - 1
            if here.period[0] > 0.0:
                near_row = (near_row + rows) % rows
                near_column = (near_column + columns) % columns
            elif near_row < 0 or near_column < 0 or near_row >= rows or near_column >= columns:
                continue
            j = here.cells[near_row, near_column]
            while j >= 0:
                off_x = here.position[j, 0] - x
                off_y = here.position[j, 1] - y
                if here.period[0] > 0.0:
                    off_x -= here.period[0] * np.rint(off_x / here.period[0])
                    off_y -= here.period[1] * np.rint(off_y / here.period[1])
                apart = (here.radius[i] + here.radius[j]) * (1.0 - _TOUCHING)
                if here.radius[j] > 0.0 and off_x * off_x + off_y * off_y < apart * apart:
                    return True
                j = here.next_one[j]
    return False


def _place(address: int) -> int:
    """Give each body the first candidate at which it overlaps none that is placed."""
    here = placing_at(address)
    for w in range(here.rows.shape[0]):
        i = here.rows[w]
        for k in range(here.candidates.shape[0]):
            x = here.candidates[k, w, 0]
            y = here.candidates[k, w, 1]
            if not abs(x + y) < math.inf:
                continue
            row = min(max(math.floor((y - here.low[1]) / here.width[1]), 0), here.cells.shape[0] - 1)
            column = min(max(math.floor((x - here.low[0]) / here.width[0]), 0), here.cells.shape[1] - 1)
            if here.keeps or not _overlaps(address, i, x, y, row, column):
                here.position[i, 0] = x
                here.position[i, 1] = y
                here.is_placed[i] = True
                here.next_one[i] = here.cells[row, column]
                here.cells[row, column] = i
                break
    return 0


_PLACE = Entry(_place)
# Attempts at once: first few, since most bodies need no more; then many. Where none of so many in a row has found a
# place for any body, there is none left.
_ATTEMPTS, _MORE, _MOST = 4, 64, 1024
# No arrangement of equal discs covers more of the plane.
_DENSEST = math.pi / math.sqrt(12.0)


class Apart:
    """Places bodies so that none overlaps another or a wall.

    Parameters
    ----------
    arena : Arena
        The arena.
    taken : Solid, optional
        Bodies that are there already.
    """

    def __init__(self, arena: Arena, taken: Solid | None) -> None:
        self._arena, self._there = arena, taken or Solid(np.zeros((0, 2)), np.zeros(0))
        assert arena.walls is not None
        self._walls = repeated(arena.walls, arena.period, arena.bounds)

    def place(self, group: Founders, numbers: Points, key: npt.NDArray[np.uint64]) -> Points:
        """Return the positions of a group, shape (n, 2); the next group must not overlap it.

        Parameters
        ----------
        group : Founders
            The group.
        numbers : ndarray, shape (2, n), float64
            The uniform numbers of the first attempt.
        key : ndarray, shape (2,), uint64
            The noise key of the run, for further attempts.

        Raises
        ------
        ValueError
            If positions overlap that were given, or there is too little room.
        """
        radius = np.asarray(group.radius)
        self._check_area(radius[radius > 0])
        solid, left = self._arranged(group, numbers, key)
        if left:
            # Fewer may fill the gaps in another way.
            fit = group.size - left
            while fit and (left := self._arranged(group.cut(group.first + fit), numbers[:, :fit], key)[1]):
                fit -= left
            raise self._too_many(f"{fit} fit when they are placed at random", radius[radius > 0])
        self._there = solid
        return solid.position[len(solid.radius) - group.size :]

    def _arranged(self, group: Founders, numbers: Points, key: npt.NDArray[np.uint64]) -> tuple[Solid, int]:
        """Return the bodies that are there and those of a group, and how many have found no place."""
        radius, there = np.asarray(group.radius), self._there
        first = len(there.radius)
        solid = Solid(np.concatenate([there.position, np.zeros((group.size, 2))]), np.append(there.radius, radius))
        low, high = map(np.asarray, self._arena.bounds)
        # At most about one cell for each body.
        side = max(2.0 * float(solid.radius.max()), math.sqrt(float(np.prod(high - low)) / len(solid.radius)))
        columns, rows = (max(int(extent // side), 1) for extent in high - low)
        placing = Placing(
            *solid, np.zeros(len(solid.radius), np.bool_), np.arange(first), there.position[np.newaxis], True,
            kernel_period(self._arena.period), low, (high - low) / (columns, rows), np.full((rows, columns), -1),
            np.zeros(len(solid.radius), np.int64),
        )  # fmt: skip
        _PLACE(PLACING.pack(placing))
        waiting, attempts, in_vain = np.arange(group.size), 0, 0
        while len(waiting) and in_vain < _MOST:
            count = 1 if not attempts else _ATTEMPTS if attempts == 1 else _MORE
            drawn = numbers[:, np.newaxis] if not attempts else self._drawn(group, waiting, key, attempts, count)
            candidates = self._candidates(group, waiting, drawn)
            _PLACE(PLACING.pack(placing._replace(rows=waiting + first, candidates=candidates, keeps=False)))
            left = waiting[~placing.is_placed[waiting + first]]
            if not isinstance(group.placement, str) and len(left):
                raise self._overlapping(group, solid, first, int(left[0]))
            attempts, in_vain = attempts + count, in_vain + count if len(left) == len(waiting) else 0
            waiting = left
        return solid, len(waiting)

    def _drawn(
        self, group: Founders, waiting: npt.NDArray[np.int64], key: npt.NDArray[np.uint64], attempts: int, count: int
    ) -> Points:
        """Return the uniform numbers of the next attempts, shape (2, count, w)."""
        stream = np.full(len(waiting), stream_number(Stream.PLACEMENT, group.number), np.int64)
        attempt = np.arange(attempts, attempts + count)
        return _filled(np.tile(key, (count, 1)), stream, group.first + waiting, attempt)[:2]

    def _candidates(self, group: Founders, waiting: npt.NDArray[np.int64], numbers: Points) -> Points:
        """Return places by the rule of a group for these uniform numbers, shape (k, w, 2); NaN if beside a wall."""
        radius = np.asarray(group.radius)[waiting]
        places = np.zeros((*numbers.shape[1:], 2))
        for attempt, drawn in enumerate(np.moveaxis(numbers, 1, 0)):
            rule = group.placement if isinstance(group.placement, str) else "given"
            # What cannot be spread is drawn.
            if rule == "uniform" or (rule == "spread" and len(waiting) < group.size):
                radii = np.unique(radius)
                for one in radii if len(radii) <= _MOST_RADII else radii[:1]:
                    alike = (radius == one) | (len(radii) > _MOST_RADII)
                    places[attempt, alike] = self._arena.place(drawn[0, alike], drawn[1, alike], one)
            else:
                places[attempt] = _places(self._arena, group, np.ascontiguousarray(drawn))
        slack = ROUNDING * float(np.abs(self._arena.bounds).max())
        is_free = self._arena.contains(places) & (clearance(self._walls, places) >= radius - slack)
        return np.where((radius == 0)[:, np.newaxis] | is_free[..., np.newaxis], places, np.nan)

    def _check_area(self, radius: Points) -> None:
        """Refuse discs that have no room, or a larger area than there is."""
        widest, arena = float(radius.max(initial=0.0)), self._arena
        if widest and not arena.fits(widest):
            raise ValueError(f"radius={widest:g}: no place in {arena} is so far from its walls; take a smaller radius")
        area = math.pi * float(np.sum(radius**2))
        if area > arena.area:
            most = max(int(_DENSEST * arena.area / (area / len(radius))), 1)
            raise self._too_many(f"at most {most} fit", radius)

    def _too_many(self, how: str, radius: Points) -> ValueError:
        sizes = f"radius {radius[0]:g}" if (radius == radius[0]).all() else f"radii up to {radius.max():g}"
        others = f" beside the {len(self._there.radius)} that are there" if len(self._there.radius) else ""
        return NoRoomError(
            f"{len(radius)} bodies of {sizes}: too many for {self._arena}{others}; {how}. Take fewer or smaller ones, "
            "or a larger arena; or give positions that do not overlap"
        )

    def _overlapping(self, group: Founders, solid: Solid, first: int, row: int) -> ValueError:
        """Return the exception for a given position that is taken, or too near to a wall."""
        place, radius = np.asarray(group.placement)[row], float(np.asarray(group.radius)[row])
        at = f"position: that of agent {group.first + row}, ({place[0]:g}, {place[1]:g}),"
        slack = ROUNDING * float(np.abs(self._arena.bounds).max())
        off = float(clearance(self._walls, place[np.newaxis])[0])
        if off < radius - slack:
            return ValueError(f"{at} is {off:g} from a wall, and its radius is {radius:g}; place it farther inside")
        ways = self._arena.displacement(solid.position[: first + row], place)
        distance = np.hypot(ways[:, 0], ways[:, 1])
        other = int(np.argmin(distance - solid.radius[: first + row]))
        whom = f"agent {group.first + other - first}" if other >= first else "another body, placed before"
        cure = "give another" if other >= first else "give another, or add the groups whose positions are given first"
        if group.first or not first:
            cure = "give another; if this is a reset, let one of them leave before"
        return NoRoomError(
            f"{at} is {distance[other]:g} from {whom}, and the sum of their radii is {radius + solid.radius[other]:g}; "
            f"{cure}"
        )
