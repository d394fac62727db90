"""Arenas: where bodies can be, what happens at the wall, and the way from one place to another.

An arena is centred on the origin. A new one is a subclass of `Arena` with five members: `area`, `bounds`, `contains`,
`place`, and a kernel `confine`; on a torus also a `period`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined, kernel
from teamsight.world import limits

Points = npt.NDArray[np.float64]


class Arena(ABC):
    """A bounded part of the plane.

    Attributes
    ----------
    confine : kernel
        ``confine(x, y, step_x, step_y, heading_x, heading_y, size)`` takes a place inside, a step from there, the
        heading, and the arena's `size`; returns the place reached and the heading there, after meeting the wall.
    """

    confine: ClassVar[Callable[..., Any]]

    @property
    @abstractmethod
    def size(self) -> tuple[float, float]:
        """The two numbers that `confine` is given [length]."""

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
        """The distance after which the arena repeats along x and y; 0 where it does not."""
        return 0.0, 0.0

    @abstractmethod
    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Say for each position, shape (..., 2), whether it lies inside; the wall itself is inside."""

    @abstractmethod
    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        """Map numbers uniform in (0, 1) to places uniform over the area at least `margin` from the wall."""

    def displacement(self, start: npt.ArrayLike, end: npt.ArrayLike) -> Points:
        """Return the shortest way from each `start` to its `end`, shape (..., 2)."""
        way = np.asarray(end, float) - np.asarray(start, float)
        period = np.asarray(self.period)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(period > 0, way - period * np.rint(way / period), way))

    def check_reach(self, reach: float) -> None:
        """Refuse a range that would see the same body twice.

        Raises
        ------
        ValueError
            If `reach` exceeds half a side along which the arena repeats.
        """
        limit = min((side / 2 for side in self.period if side > 0), default=math.inf)
        if reach > limit:
            raise ValueError(
                f"range={reach:g}: on a torus a range must be at most half of the shorter side, here {limit:g}; "
                "take a larger torus or a shorter range"
            )


@inlined
def _confine_disc(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    end_x = x + step_x
    end_y = y + step_y
    if end_x * end_x + end_y * end_y <= size[0] * size[0]:
        return end_x, end_y, heading_x, heading_y
    return _bounce(x, y, step_x, step_y, heading_x, heading_y, size[0])


@kernel
def _bounce(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, radius: float
) -> tuple[float, float, float, float]:
    square = radius * radius
    for _ in range(64):
        end_x = x + step_x
        end_y = y + step_y
        if end_x * end_x + end_y * end_y <= square:
            return end_x, end_y, heading_x, heading_y
        # Where the path meets the wall: |place + share · step| = radius.
        a = step_x * step_x + step_y * step_y
        if a == 0.0:
            # The whole step led to the wall, where rounding has left the place a hair outside.
            break
        b = x * step_x + y * step_y
        c = min(x * x + y * y - square, 0.0)
        share = min(max((math.sqrt(max(b * b - a * c, 0.0)) - b) / a, 0.0), 1.0)
        x += share * step_x
        y += share * step_y
        normal = 1.0 / math.sqrt(x * x + y * y)
        normal_x = x * normal
        normal_y = y * normal
        outward = 2.0 * (1.0 - share) * (step_x * normal_x + step_y * normal_y)
        step_x = (1.0 - share) * step_x - outward * normal_x
        step_y = (1.0 - share) * step_y - outward * normal_y
        turned = 2.0 * (heading_x * normal_x + heading_y * normal_y)
        heading_x -= turned * normal_x
        heading_y -= turned * normal_y
    # A step of very many bounces, or one along the wall: stop on the wall.
    inside = radius * (1.0 - 1e-12) / max(math.sqrt(x * x + y * y), radius)
    return x * inside, y * inside, heading_x, heading_y


@inlined
def _fold(place: float, half: float) -> tuple[float, float]:
    # The mirror images of a segment repeat every 4 · half: find the place in the first, and whether it is reversed.
    if place >= -half and place <= half:
        return place, 1.0
    shifted = (place + half) % (4.0 * half)
    if shifted <= 2.0 * half:
        return min(max(shifted - half, -half), half), 1.0
    return min(max(3.0 * half - shifted, -half), half), -1.0


@inlined
def _confine_box(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    x, turned_x = _fold(x + step_x, 0.5 * size[0])
    y, turned_y = _fold(y + step_y, 0.5 * size[1])
    return x, y, heading_x * turned_x, heading_y * turned_y


@inlined
def _wrap(place: float, side: float) -> float:
    if place >= -0.5 * side and place < 0.5 * side:
        return place
    place -= side * math.floor(place / side + 0.5)
    # Rounding can leave a place a hair outside.
    return place if place >= -0.5 * side and place < 0.5 * side else -0.5 * side


@inlined
def _confine_torus(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    return _wrap(x + step_x, size[0]), _wrap(y + step_y, size[1]), heading_x, heading_y


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
    confine = _confine_disc

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", limits.length("radius", self.radius))

    @property
    def size(self) -> tuple[float, float]:
        return self.radius, 0.0

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
        # The polar form can round to a hair beyond the wall.
        radius = np.minimum(radius, self.radius * (1 - 1e-15))
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


@dataclass(frozen=True)
class _Rectangle(Arena):
    width: float
    height: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "width", limits.length("width", self.width))
        object.__setattr__(self, "height", limits.length("height", self.height))

    @property
    def size(self) -> tuple[float, float]:
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
        return np.asarray(share * np.maximum(np.array(self.size) - 2 * margin, 0.0))


@dataclass(frozen=True)
class Box(_Rectangle):
    """A rectangle; its walls reflect position and heading.

    Parameters
    ----------
    width, height : float
        Along x and y [length], above 0.
    """

    confine = _confine_box


@dataclass(frozen=True)
class Torus(_Rectangle):
    """A rectangle without walls: what leaves on one side comes back on the other.

    Parameters
    ----------
    width, height : float
        Along x and y [length], above 0.
    """

    confine = _confine_torus

    @property
    def period(self) -> tuple[float, float]:
        return self.width, self.height
