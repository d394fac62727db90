"""The contract of arenas and obstacles, arenas with obstacles and their free places; a disc, a box, a torus."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Component
from teamsight.core.kernel import Entry, Record, inlined
from teamsight.world.limits import FINEST, Length
from teamsight.world.noise import philox
from teamsight.world.polygons import nearest_on_walls, round_boundary, walls_of
from teamsight.world.walls import (
    ROUNDING,
    Sight,
    Walls,
    clearance,
    confine_box,
    confine_disc,
    confine_torus,
    confine_walls,
    inset,
    joined,
    no_walls,
    open_sight,
    repeated,
    walls_size,
)

Points = npt.NDArray[np.float64]


class Outline(NamedTuple):
    """What an arena looks like, for drawing.

    Attributes
    ----------
    wall : ndarray, shape (k, 2), float64
        The vertices of the wall [length].
    obstacles : tuple of ndarray, each of shape (k, 2), float64
        The vertices of each obstacle [length]; one that crosses the seam of an arena that repeats is there twice.
    """

    wall: Points
    obstacles: tuple[Points, ...]


@runtime_checkable
class Obstacle(Protocol):
    """The shape of an obstacle: `Circle` and `Polygon`."""

    @property
    def bounds(self) -> tuple[Points, Points]:
        """The lower left and the upper right corner of the box around it, each of shape (2,)."""

    @property
    def finest(self) -> float:
        """Its least thickness [length]."""

    @property
    def faces(self) -> Walls:
        """Its walls, seen from outside."""

    @property
    def boundary(self) -> Points:
        """Its vertices, for drawing, shape (k, 2)."""

    def covers(self, position: npt.ArrayLike, slack: float = 0.0) -> npt.NDArray[np.bool_]:
        """Return for each position, shape (..., 2), whether it is inside by more than `slack`."""


#: A period longer than any distance: ``way - ENDLESS * rint(way / ENDLESS)`` is `way`, to the last bit.
ENDLESS = 1e300


def kernel_period(period: tuple[float, float]) -> Points:
    """Return an arena's period for formulas that divide by it: `ENDLESS` along an axis that does not repeat.

    If neither axis repeats, both are 0: nothing needs wrapping.
    """
    sides = np.array(period, float)
    return np.where(sides > 0, sides, ENDLESS) if sides.any() else sides


def shortest(way: Points, period: tuple[float, float]) -> Points:
    """Return the shortest displacements between positions that `way`, shape (..., 2), leads from one to another."""
    if not any(period):
        return way
    sides = kernel_period(period)
    return np.asarray(way - sides * np.rint(way / sides))


_HALVINGS = 50
_DIRECTIONS = 64


def farthest_inside(is_inside: Callable[[Points], Any], far: Points, halvings: int) -> Points:
    """Return the largest numbers from 0 to `far` at which `is_inside`, if it is from 0 up to there, by bisection."""
    near = np.zeros(len(far))
    for _ in range(halvings):
        middle = 0.5 * (near + far)
        found = is_inside(middle)
        near, far = np.where(found, middle, near), np.where(found, far, middle)
    return near


class Arena(Component, ABC):
    """A bounded part of the plane.

    A subclass defines `confine`, `size`, `area`, `bounds`, `contains` and `place`. If the arena repeats, it also
    defines `period` and is centred on the origin; if it is not star-shaped around the origin, `inside`; if it is not
    convex, `sight` and `fits`; and for obstacles `walls`.

    Attributes
    ----------
    confine : kernel
        ``confine(x, y, step_x, step_y, heading_x, heading_y, size)`` returns the position that a step from a position
        inside reaches, and the heading there, after any contact with the wall: four numbers. `size` is an array of the
        arena's `size`.
    """

    confine: ClassVar[Callable[..., Any]]

    @property
    @abstractmethod
    def size(self) -> tuple[float, ...]:
        """The numbers that `confine` reads, such as lengths of sides [length]; any number of them."""

    @property
    @abstractmethod
    def area(self) -> float:
        """The arena's area [length²]."""

    @property
    @abstractmethod
    def bounds(self) -> tuple[Points, Points]:
        """The lower left and the upper right corner of the box around the arena, each of shape (2,)."""

    @property
    def period(self) -> tuple[float, float]:
        """The distance after which the arena repeats along x and along y; 0 along an axis that does not repeat."""
        return 0.0, 0.0

    @property
    def sight(self) -> Sight:
        """What blocks sight; by default nothing, which suits convex arenas."""
        return open_sight()

    @property
    def walls(self) -> Walls | None:
        """The walls that `confine` reflects at, if they are segments and discs; with them it can have obstacles."""
        return None

    @property
    def boundary(self) -> Points:
        """The vertices of the wall, for drawing, shape (k, 2); by default the box around the arena."""
        (left, bottom), (right, top) = self.bounds
        return np.array([(left, bottom), (right, bottom), (right, top), (left, top)])

    def outline(self) -> Outline:
        """Return what the arena looks like: the vertices of its wall and of its obstacles."""
        return Outline(self.boundary, ())

    def with_obstacles(self, *obstacles: Obstacle) -> Obstructed:
        """Return this arena with obstacles, which block motion and sight.

        Parameters
        ----------
        *obstacles : Circle or Polygon
            They may overlap each other and the wall.

        Raises
        ------
        TypeError
            If something is not an obstacle, or the arena does not define the `walls` at which its `confine` reflects.
        ValueError
            If an obstacle is outside the arena, repeats within itself, or nothing remains free.
        """
        return Obstructed(self, obstacles)

    def fits(self, margin: float) -> bool:
        """Return whether there is room at least `margin` from the walls; by default, by the box around the arena."""
        low, high = self.bounds
        return bool(np.all((np.array(self.period) > 0) | (high - low > 2 * margin)))

    @abstractmethod
    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return for each position, shape (..., 2), whether it is inside; the wall itself is inside."""

    @abstractmethod
    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        """Map uniform numbers in (0, 1) to positions uniform over the area, at least `margin` from the wall.

        Parameters
        ----------
        u, v : array_like, shape (...)
            Uniform numbers in (0, 1).
        margin : float
            The least distance from the wall [length].

        Returns
        -------
        ndarray, shape (..., 2), float64
            Positions [length].
        """

    def inside(self, points: Points, margin: float = 0.0) -> Points:
        """Move points that are outside, or nearer to the wall than `margin`, to positions inside.

        Along an axis that repeats there is no wall: points are wrapped. By default points move towards the origin,
        which suits arenas that are star-shaped around it; the margin is accurate to 0.2 %.

        Parameters
        ----------
        points : ndarray, shape (n, 2), float64
            Positions anywhere [length].
        margin : float
            The least distance from the wall [length], which must fit into the arena.

        Returns
        -------
        ndarray, shape (n, 2), float64
            Positions inside [length].
        """
        points = np.array(self.displacement(np.zeros(2), points))
        is_open = np.asarray(self.period) > 0
        angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        around = np.concatenate([np.zeros((1, 2)), margin * np.stack([np.cos(angle), np.sin(angle)], axis=-1)])

        def is_free(places: Points) -> npt.NDArray[np.bool_]:
            """Return for each point whether all points around it are inside."""
            # The arena continues across the seam of an axis that repeats.
            near = self.displacement(np.zeros(2), places[:, None] + around)
            return np.asarray(np.all(self.contains(near), axis=1))

        def moved(share: Points) -> Points:
            return np.where(is_open, moving, moving * share[:, None])

        # Each look costs time: only points that have to move are moved.
        stuck = np.flatnonzero(~is_free(points))
        moving = points[stuck]
        if len(stuck):
            points[stuck] = moved(farthest_inside(lambda share: is_free(moved(share)), np.ones(len(stuck)), _HALVINGS))
        return points

    def displacement(self, start: npt.ArrayLike, end: npt.ArrayLike) -> Points:
        """Return the shortest way from each position to another.

        Parameters
        ----------
        start, end : array_like, shape (..., 2)
            Positions [length].

        Returns
        -------
        ndarray, shape (..., 2), float64
            Displacements [length].
        """
        return shortest(np.asarray(end, float) - np.asarray(start, float), self.period)

    def check_reach(self, reach: float) -> None:
        """Refuse a range within which a body could be found twice.

        Raises
        ------
        ValueError
            If `reach` exceeds half the distance after which the arena repeats.
        """
        limit = min((side / 2 for side in self.period if side > 0), default=math.inf)
        if reach > limit:
            raise ValueError(
                f"range={reach:g}: on a torus a range must be at most half of the shorter side, here {limit:g}; "
                "take a larger torus or a shorter range"
            )


Words = npt.NDArray[np.uint64]

_SAMPLES = 4096
# Attempts at once: first few, since most places need no more; then many. If one place in `_SAMPLES` is free, one in
# e^30 is not found after all rounds; it is then taken from the samples.
_FEW, _MANY, _ROUNDS = 4, 128, 1000
_GOLDEN = 0.6180339887498949
_MOST_KEPT = 64


class Attempt(NamedTuple):
    """The record of a call of `_draw_again`; n places, k attempts at each."""

    words: Annotated[Words, "n", 4]
    first: int
    numbers: Annotated[Points, 2, "n", "k"]


ATTEMPT = Record(Attempt)
attempt_at = ATTEMPT.at


@inlined
def _uniform(high: np.uint64, low: np.uint64) -> float:
    # 52 bits and a half: never 0, never 1.
    return (np.float64(np.int64(high)) * 2.0**20 + np.float64(np.int64(low >> np.uint64(12))) + 0.5) * 2.0**-52


def _draw_again(address: int) -> int:
    attempt = attempt_at(address)
    words, numbers = attempt.words, attempt.numbers
    for i in range(numbers.shape[1]):
        for k in range(numbers.shape[2]):
            a, b, c, d = philox(
                words[i, 0], words[i, 1], np.uint64(attempt.first + k), np.uint64(0), words[i, 2], words[i, 3]
            )
            numbers[0, i, k] = _uniform(a, b)
            numbers[1, i, k] = _uniform(c, d)
    return 0


_DRAW_AGAIN = Entry(_draw_again)


def is_free(arena: WalledArena, position: Points, margin: float) -> npt.NDArray[np.bool_]:
    """Return for each position, shape (..., 2), whether it is inside and at least `margin` from the walls."""
    inside = np.asarray(arena.contains(position))
    return inside & (clearance(arena.near_walls, position) >= margin) if margin > 0 else inside


def _free_samples(arena: WalledArena, margin: float) -> Points:
    found = arena.kept.get(("samples", margin))
    if found is None:
        step = np.arange(float(_SAMPLES))
        samples = arena.draw((step + 0.5) / _SAMPLES, (step * _GOLDEN) % 1.0)
        found = samples[is_free(arena, samples, margin)]
        keep(arena, "samples", margin, found)
    return found


def keep(arena: WalledArena, name: str, margin: float, found: Points) -> None:
    """Keep what a search has found, but not for very many margins."""
    if len(arena.kept) >= _MOST_KEPT:
        arena.kept.clear()
    arena.kept[name, margin] = found


# A place is as far from the walls as the margin says, up to this share of the arena's extent.
_NEAR = 1e-10
# Points moved at once, to limit the memory.
_ROWS = 256


def _rounded(arena: WalledArena, margin: float) -> float:
    """Return a margin that rounding cannot miss."""
    low, high = arena.bounds
    return max(margin - _NEAR * float(np.max(high - low)), 0.0)


def _limits(walls: Walls, margin: float) -> tuple[Points, Points]:
    """Return the lines and the circles (x, y, radius) at which the places that are `margin` from the walls end."""
    lines, discs = inset(walls, margin)
    # The places within a hollow disc end at a smaller circle; without room there, at its centre.
    is_open = np.ones(len(discs), np.bool_)
    if len(walls.discs):
        is_open[-len(walls.discs) :] = np.sign(discs[-len(walls.discs) :, 2]) == np.sign(walls.discs[:, 2])
    return lines, np.concatenate([discs[:, :2], (np.abs(discs[:, 2]) * is_open)[:, None]], axis=1)


def _feet_on_circles(points: Points, circles: Points) -> Points:
    off = points[:, None] - circles[:, :2]
    length = np.hypot(off[..., 0], off[..., 1])[..., None]
    # From the centre, all places of a circle are equally near.
    way = np.where(length > 0, off / np.maximum(length, 1e-300), [1.0, 0.0])
    return np.asarray(circles[:, :2] + circles[:, 2:] * way)


def _meetings(arena: WalledArena, margin: float, lines: Points, circles: Points) -> Points:
    """Return the free places where two of the limits meet, shape (k, 2)."""
    found = arena.kept.get(("meetings", margin))
    if found is None:
        places = crossings(lines, circles)
        found = places[is_free(arena, places, _rounded(arena, margin))]
        keep(arena, "meetings", margin, found)
    return found


def crossings(segments: Points, circles: Points) -> Points:
    """Return where segments x0, y0, x1, y1 and circles x, y, radius cross or meet each other, shape (k, 2)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        places = np.concatenate([_of_segments(segments), _of_both(segments, circles), _of_circles(circles)])
    return np.asarray(places[np.isfinite(places).all(axis=1)])


def _of_segments(segments: Points) -> Points:
    one, other = np.triu_indices(len(segments), 1)
    begin, edge = segments[one, :2], segments[one, 2:] - segments[one, :2]
    off, way = segments[other, :2] - begin, segments[other, 2:] - segments[other, :2]
    cross = edge[:, 0] * way[:, 1] - edge[:, 1] * way[:, 0]
    share = (off[:, 0] * way[:, 1] - off[:, 1] * way[:, 0]) / cross
    there = (off[:, 0] * edge[:, 1] - off[:, 1] * edge[:, 0]) / cross
    return np.asarray((begin + share[:, None] * edge)[_is_share(share) & _is_share(there)])


def _is_share(share: Points) -> npt.NDArray[np.bool_]:
    return (share >= -1e-9) & (share <= 1 + 1e-9)


def _of_both(segments: Points, circles: Points) -> Points:
    begin, edge = segments[:, None, :2], segments[:, None, 2:] - segments[:, None, :2]
    length_2 = np.sum(edge**2, axis=2)
    off = begin - circles[None, :, :2]
    along = -np.sum(off * edge, axis=2) / length_2
    half = np.sqrt((circles[None, :, 2] ** 2 - np.sum((off + along[..., None] * edge) ** 2, axis=2)) / length_2)
    found = [np.empty((0, 2))]
    for share in (along - half, along + half):
        found.append((begin + share[..., None] * edge)[_is_share(share)])
    return np.concatenate(found)


def _of_circles(circles: Points) -> Points:
    one, other = np.triu_indices(len(circles), 1)
    way = circles[other, :2] - circles[one, :2]
    length = np.hypot(*way.T)
    along = 0.5 * (length + (circles[one, 2] ** 2 - circles[other, 2] ** 2) / length)
    half = np.sqrt(circles[one, 2] ** 2 - along**2)
    way = way / length[:, None]
    middle = circles[one, :2] + along[:, None] * way
    across = half[:, None] * np.stack([-way[:, 1], way[:, 0]], axis=1)
    return np.concatenate([middle - across, middle + across])


_NODES = 24
# Lines at once, to limit the memory.
_LINES = 1000


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


class WalledArena(Arena):
    """An arena whose walls are segments and discs: its free places are found from these."""

    @property
    @abstractmethod
    def near_walls(self) -> Walls:
        """Its walls, with the images that are near it if it repeats."""

    @abstractmethod
    def draw(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Points:
        """Map uniform numbers to positions uniform over an area that contains the free area."""

    @cached_property
    def kept(self) -> dict[tuple[str, float], Points]:
        """What searches for places have found, by their name and the margin."""
        return {}

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        """Return what `Arena.place` returns: exactly uniform over the free area, a pure function of `u` and `v`.

        A place that is not free is drawn again, with numbers that are Philox of the bits of `u` and `v`. A margin that
        does not fit is left out.
        """
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        shape = u.shape
        u, v = np.ravel(u), np.ravel(v)
        margin = margin if margin > 0 and self.fits(margin) else 0.0
        places = self.draw(u, v)
        missing = np.flatnonzero(~is_free(self, places, margin))
        words = np.stack([u[missing], v[missing]], axis=-1).view(np.uint64)
        words = np.concatenate([words & np.uint64(0xFFFFFFFF), words >> np.uint64(32)], axis=1)
        first = 0
        for count in (_FEW, *[_MANY] * _ROUNDS):
            if not len(missing):
                break
            numbers = np.empty((2, len(missing), count))
            _DRAW_AGAIN(ATTEMPT.pack(Attempt(words, first, numbers)))
            drawn = self.draw(*numbers)
            free = is_free(self, drawn, margin)
            found = free.any(axis=1)
            places[missing[found]] = drawn[found, np.argmax(free[found], axis=1)]
            missing, words, first = missing[~found], words[~found], first + count
        if len(missing):
            samples = _free_samples(self, margin)
            places[missing] = samples[(u[missing] * len(samples)).astype(int)]
        return np.asarray(places.reshape(*shape, 2))

    def inside(self, points: Points, margin: float = 0.0) -> Points:
        """Return for each point, shape (n, 2), itself if it is free, else the nearest place that is.

        Places at least `margin` from the walls end at lines beside segments, and at circles around their ends and
        around discs. The nearest one is the foot of a point on one of these, or a place where two of them meet. A
        margin that does not fit is left out.
        """
        margin = margin if self.fits(margin) else 0.0
        points = np.array(self.displacement(np.zeros(2), points))
        stuck = np.flatnonzero(~is_free(self, points, margin))
        lines, circles = _limits(self.near_walls, margin)
        meetings = _meetings(self, margin, lines, circles)
        for rows in np.array_split(stuck, len(stuck) // _ROWS + 1):
            moving = points[rows]
            shared = np.broadcast_to(meetings, (len(rows), *meetings.shape))
            feet = np.concatenate([nearest_on_walls(moving, lines), _feet_on_circles(moving, circles), shared], axis=1)
            feet = self.displacement(np.zeros(2), feet)
            distance = np.sum(self.displacement(moving[:, None], feet) ** 2, axis=2)
            distance[~is_free(self, feet, _rounded(self, margin))] = np.inf
            best = np.argmin(distance, axis=1)
            found = np.isfinite(distance[np.arange(len(rows)), best])
            points[rows[found]] = feet[found, best[found]]
        return points

    def fits(self, margin: float) -> bool:
        """Return whether there is room so far from the walls: whether any of 4096 even places is."""
        return len(_free_samples(self, margin)) > 0

    @cached_property
    def area(self) -> float:
        """The area of all that it contains, accurate to rounding.

        Between the heights at which walls begin, end or meet, the free length is a sum of straight lines and arcs,
        which a quadrature whose nodes lie more densely at the ends integrates to rounding.
        """
        low, high = self.bounds
        walls = self.near_walls
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
        return float(sum(np.sum(weights[part] * _free_length(self, lines[part], circles)) for part in parts))


def states_walls(arena: Arena) -> bool:
    """Whether an arena says at which walls its `confine` reflects."""
    # Walls that are inherited from a class with another `confine` may be wrong.
    walls, confine = (next(home for home in type(arena).__mro__ if key in vars(home)) for key in ("walls", "confine"))
    return arena.walls is not None and issubclass(walls, confine)


def _check_obstacles(arena: Arena, obstacles: tuple[Obstacle, ...]) -> None:
    """Refuse obstacles that `arena` cannot have; see `Arena.with_obstacles`."""
    if not states_walls(arena):
        raise TypeError(
            f"{type(arena).__name__}: cannot have obstacles, because its class does not say where its walls are; "
            "define `walls`, the segments and discs at which its confine reflects, or use Polygon"
        )
    if not obstacles:
        raise ValueError(f"{arena}.with_obstacles(): give at least one obstacle, such as Circle((0, 0), 1)")
    low, high = arena.bounds
    for one in obstacles:
        if isinstance(one, (list, tuple)):
            kind = type(one).__name__
            raise TypeError(f"obstacle {checks.shown(one)}: is a {kind}; unpack it: with_obstacles(*shapes)")
        if not isinstance(one, Obstacle):
            raise TypeError(f"obstacle {checks.shown(one)}: must be a shape, such as Circle((0, 0), 1) or Polygon(…)")
        first, last = one.bounds
        if not ((first < high) & (last > low)).all():
            box = f"{low.tolist()}, {high.tolist()}"
            raise ValueError(f"{one}: is outside {arena}, whose bounds are {box}; move it inside or leave it out")
        scale = float(np.abs([low, high, first, last]).max())
        if one.finest < FINEST * scale:
            raise ValueError(
                f"{one}: has a part that is only {one.finest:g} wide, less than {FINEST:g} of the largest coordinate "
                f"{scale:g}, which is too thin for the rounding of positions; make it thicker"
            )
        for side, extent in zip(arena.period, last - first, strict=True):
            if 0 < side <= extent:
                raise ValueError(f"{one}: is {extent:g} long, but {arena} repeats after {side:g}; make it smaller")


# More obstacles are counted where a world is described.
_MOST_NAMED = 3


@dataclass(frozen=True)
class Obstructed(WalledArena):
    """An arena with obstacles; walls and obstacles reflect position and heading.

    `Arena.with_obstacles` makes it. The obstacles may divide the arena into parts; a body stays in its part.

    Parameters
    ----------
    arena : Arena
        The arena without obstacles.
    obstacles : tuple of Circle or Polygon
        The obstacles.
    """

    arena: Arena
    obstacles: tuple[Obstacle, ...]
    confine = confine_walls

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.arena, Obstructed):
            object.__setattr__(self, "obstacles", (*self.arena.obstacles, *self.obstacles))
            object.__setattr__(self, "arena", self.arena.arena)
        _check_obstacles(self.arena, self.obstacles)
        if not self.fits(0.0):
            raise ValueError(f"{self}: the obstacles cover the whole arena; leave some out or make them smaller")

    @property
    def walls(self) -> Walls:
        return joined([self.arena.walls, *(obstacle.faces for obstacle in self.obstacles)])

    @cached_property
    def near_walls(self) -> Walls:
        """The walls, with their images in half a period around an arena that repeats."""
        return repeated(self.walls, self.period, self.bounds)

    @property
    def size(self) -> tuple[float, ...]:
        return walls_size(self.walls, self.period, self._slack)

    @cached_property
    def _slack(self) -> float:
        return ROUNDING * float(np.abs([self.bounds, *(obstacle.bounds for obstacle in self.obstacles)]).max())

    @property
    def bounds(self) -> tuple[Points, Points]:
        return self.arena.bounds

    @property
    def period(self) -> tuple[float, float]:
        return self.arena.period

    @property
    def sight(self) -> Sight:
        inner = self.arena.sight
        blocking = joined([Walls(inner.segments, inner.discs), *(obstacle.faces for obstacle in self.obstacles)])
        return Sight(*blocking, np.array(self.period), 10.0 * self._slack)

    @property
    def boundary(self) -> Points:
        return self.arena.boundary

    def outline(self) -> Outline:
        return Outline(self.boundary, tuple(one.boundary + shift for one, shift in self._images))

    @cached_property
    def _images(self) -> list[tuple[Obstacle, Points]]:
        """The obstacles and the shifts at which they, or their images, reach into the arena."""
        low, high = self.bounds
        shifts = map(np.array, product(*(sorted({0.0, -side, side}) for side in self.period)))
        return [
            (one, shift)
            for one, shift in product(self.obstacles, shifts)
            if (one.bounds[0] + shift < high).all() and (one.bounds[1] + shift > low).all()
        ]

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        position = np.asarray(position, float)
        inside = np.array(self.arena.contains(position))
        # A body on a wall may be beyond it through rounding.
        outside = ~inside
        inside[outside] = clearance(joined([self.arena.walls]), position[outside]) <= self._slack
        for obstacle, shift in self._images:
            inside &= ~obstacle.covers(position - shift, self._slack)
        return inside

    def draw(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Points:
        """Map uniform numbers to positions uniform over the arena without obstacles."""
        return np.array(self.arena.place(u, v), float)

    def __repr__(self) -> str:
        return f"{self.arena!r}.with_obstacles({', '.join(map(repr, self.obstacles))})"

    def __str__(self) -> str:
        number = len(self.obstacles)
        return repr(self) if number <= _MOST_NAMED else f"{self.arena!r} with {number} obstacles"


@dataclass(frozen=True)
class Disc(Arena):
    """A disc; its wall reflects position and heading.

    Parameters
    ----------
    radius : float
        [length], above 0.

    Raises
    ------
    ValueError, TypeError
        If the radius is not a number above 0 within the limits of lengths (`teamsight.world.limits`).
    """

    radius: Length
    confine = confine_disc

    @property
    def size(self) -> tuple[float, ...]:
        return (self.radius,)

    @property
    def area(self) -> float:
        return math.pi * self.radius**2

    @property
    def bounds(self) -> tuple[Points, Points]:
        high = np.full(2, self.radius)
        return -high, high

    @property
    def walls(self) -> Walls:
        return Walls(np.empty((0, 4)), np.array([[0.0, 0.0, -self.radius]]))

    @property
    def boundary(self) -> Points:
        return round_boundary((0.0, 0.0), self.radius)

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        return np.asarray(np.sum(np.square(np.asarray(position, float)), axis=-1) <= self.radius**2)

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        radius = max(self.radius - margin, 0.0) * np.sqrt(np.asarray(u, float))
        angle = 2 * np.pi * np.asarray(v, float)
        # The polar form can round to just beyond the wall.
        radius = np.minimum(radius, self.radius * (1 - 1e-15))
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        # `np.stack` would take longer than the numbers of a small team.
        place = np.empty((*x.shape, 2))
        place[..., 0], place[..., 1] = x, y
        return place

    def inside(self, points: Points, margin: float = 0.0) -> Points:
        length = np.sqrt(np.sum(points**2, axis=1))
        share = np.minimum(1.0, (self.radius - margin) / np.maximum(length, 1e-300))
        return np.asarray(points * share[:, None])


@dataclass(frozen=True)
class _Rectangle(Arena):
    """A rectangle.

    Parameters
    ----------
    width, height : float
        Along x and y [length], above 0.
    """

    width: Length
    height: Length

    @property
    def size(self) -> tuple[float, ...]:
        return self.width, self.height

    @property
    def area(self) -> float:
        return self.width * self.height

    @property
    def bounds(self) -> tuple[Points, Points]:
        corner = np.array([self.width / 2, self.height / 2])
        return -corner, corner

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        return np.asarray(np.all(np.abs(np.asarray(position, float)) <= self.bounds[1], axis=-1))

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        share = np.stack([np.asarray(u, float), np.asarray(v, float)], axis=-1) - 0.5
        return np.asarray(share * np.maximum(np.array([self.width, self.height]) - 2 * margin, 0.0))

    def inside(self, points: Points, margin: float = 0.0) -> Points:
        low, high = self.bounds
        walls = np.where(np.asarray(self.period) > 0, 0.0, margin)
        return np.clip(self.displacement(np.zeros(2), points), low + walls, high - walls)


@dataclass(frozen=True)
class Box(_Rectangle):
    """A rectangle; its walls reflect position and heading.

    Parameters
    ----------
    width, height : float
        Along x and y [length], above 0.
    """

    confine = confine_box

    @property
    def walls(self) -> Walls:
        return Walls(walls_of(self.boundary), np.empty((0, 3)))


@dataclass(frozen=True)
class Torus(_Rectangle):
    """A rectangle without walls: a body that leaves on one side enters on the other.

    Parameters
    ----------
    width, height : float
        Along x and y [length], above 0.
    """

    confine = confine_torus

    @property
    def walls(self) -> Walls:
        return no_walls()

    @property
    def period(self) -> tuple[float, float]:
        return self.width, self.height
