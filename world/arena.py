"""The arenas without corners and obstacles: a disc, a box, a torus."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from teamsight.world.contract import ENDLESS, Arena, Points, kernel_period
from teamsight.world.limits import Length
from teamsight.world.polygons import round_boundary, walls_of
from teamsight.world.walls import Walls, confine_box, confine_disc, confine_torus, no_walls

__all__ = ["ENDLESS", "Arena", "Box", "Disc", "Points", "Torus", "kernel_period"]


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
        return np.full(2, -self.radius), np.full(2, self.radius)

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
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

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
