"""Arenas: where bodies can be, what happens at the wall, and the shortest way between two positions.

A new arena is a subclass of `Arena` in a file of its own; `teamsight.check_arena` checks whether it keeps the contract.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.world import limits
from teamsight.world.sight import Sight, open_sight
from teamsight.world.walls import confine_box, confine_disc, confine_torus

Points = npt.NDArray[np.float64]

#: A period longer than any distance: ``way - ENDLESS * rint(way / ENDLESS)`` is `way`, to the last bit.
ENDLESS = 1e300

# For arenas that do not override `inside`.
_HALVINGS = 50
_DIRECTIONS = 64


class Arena(ABC):
    """A bounded part of the plane, centred on the origin.

    A subclass defines `confine`, `size`, `area`, `bounds`, `contains` and `place`. If the arena repeats, it also
    defines `period`; if it is not star-shaped around the origin, `inside`.

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
        # Each look costs time: only points that have to move are moved.
        stuck = np.flatnonzero(~self._is_free(points, around))
        moving = points[stuck]
        near, far = np.zeros(len(stuck)), np.ones(len(stuck))
        for _ in range(_HALVINGS if len(stuck) else 0):
            middle = 0.5 * (near + far)
            is_free = self._is_free(np.where(is_open, moving, moving * middle[:, None]), around)
            near, far = np.where(is_free, middle, near), np.where(is_free, far, middle)
        points[stuck] = np.where(is_open, moving, moving * near[:, None])
        return points

    def _is_free(self, points: Points, around: Points) -> npt.NDArray[np.bool_]:
        """Return for each point whether all points around it are inside."""
        # The arena continues across the seam of an axis that repeats.
        places = self.displacement(np.zeros(2), points[:, None] + around)
        return np.asarray(np.all(self.contains(places), axis=1))

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
        way: Points = np.asarray(end, float) - np.asarray(start, float)
        if not any(self.period):
            return way
        period = kernel_period(self.period)
        return np.asarray(way - period * np.rint(way / period))

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


def kernel_period(period: tuple[float, float]) -> Points:
    """Return an arena's period for formulas that divide by it: `ENDLESS` along an axis that does not repeat.

    If neither axis repeats, both are 0: nothing needs wrapping.
    """
    sides = np.array(period, float)
    return np.where(sides > 0, sides, ENDLESS) if sides.any() else sides


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

    radius: float
    confine = confine_disc

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", limits.length("radius", self.radius))

    @property
    def size(self) -> tuple[float, ...]:
        return (self.radius,)

    @property
    def area(self) -> float:
        return math.pi * self.radius**2

    @property
    def bounds(self) -> tuple[Points, Points]:
        return np.full(2, -self.radius), np.full(2, self.radius)

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        return np.asarray(np.sum(np.square(np.asarray(position, float)), axis=-1) <= self.radius**2)

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        radius = max(self.radius - margin, 0.0) * np.sqrt(np.asarray(u, float))
        angle = 2 * np.pi * np.asarray(v, float)
        # The polar form can round to just beyond the wall.
        radius = np.minimum(radius, self.radius * (1 - 1e-15))
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

    def inside(self, points: Points, margin: float = 0.0) -> Points:
        length = np.sqrt(np.sum(points**2, axis=1))
        share = np.minimum(1.0, (self.radius - margin) / np.maximum(length, 1e-300))
        return np.asarray(points * share[:, None])


@dataclass(frozen=True)
class _Rectangle(Arena):
    width: float
    height: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "width", limits.length("width", self.width))
        object.__setattr__(self, "height", limits.length("height", self.height))

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
    def period(self) -> tuple[float, float]:
        return self.width, self.height
