"""The contract of arenas: where bodies can be, what happens at the wall, the shortest way between two positions.

A new arena is a subclass of `Arena` in a file of its own; `teamsight.check_arena` checks whether it keeps the contract.
`Obstructed` is any arena with obstacles.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Component
from teamsight.world.limits import FINEST
from teamsight.world.walls import (
    ROUNDING,
    Sight,
    Walls,
    clearance,
    confine_walls,
    joined,
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


def _check_obstacles(arena: Arena, obstacles: tuple[Obstacle, ...]) -> None:
    """Refuse obstacles that `arena` cannot have; see `Arena.with_obstacles`."""
    name = type(arena).__name__
    # Walls that are inherited from a class with another `confine` may be wrong.
    walls, confine = (next(home for home in type(arena).__mro__ if key in vars(home)) for key in ("walls", "confine"))
    if arena.walls is None or not issubclass(walls, confine):
        raise TypeError(
            f"{name}: cannot have obstacles, because its class does not say where its walls are; define `walls`, the "
            "segments and discs at which its confine reflects, or use Polygon"
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


# More obstacles are counted where a world is described.
_MOST_NAMED = 3


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


@dataclass(frozen=True)
class Obstructed(Arena):
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

    @cached_property
    def kept(self) -> dict[tuple[str, float], Points]:
        """What searches for places have found, for each margin."""
        return {}

    @property
    def size(self) -> tuple[float, ...]:
        return walls_size(self.walls, self.period, self._slack)

    @cached_property
    def _slack(self) -> float:
        return ROUNDING * float(np.abs([self.bounds, *(obstacle.bounds for obstacle in self.obstacles)]).max())

    @cached_property
    def area(self) -> float:
        from teamsight.world.free_places import free_area

        return free_area(self)

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

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        from teamsight.world.free_places import place_freely

        return place_freely(self, u, v, margin)

    def inside(self, points: Points, margin: float = 0.0) -> Points:
        from teamsight.world.free_places import nearest_free

        return nearest_free(self, points, margin)

    def fits(self, margin: float) -> bool:
        from teamsight.world.free_places import fits

        return fits(self, margin)

    def __repr__(self) -> str:
        return f"{self.arena!r}.with_obstacles({', '.join(map(repr, self.obstacles))})"

    def __str__(self) -> str:
        number = len(self.obstacles)
        return repr(self) if number <= _MOST_NAMED else f"{self.arena!r} with {number} obstacles"
