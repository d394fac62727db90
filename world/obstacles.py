"""Obstacles: what shapes have in common, which of them an arena can have, and outlines for drawing."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.world.limits import FINEST
from teamsight.world.walls import Walls

Points = npt.NDArray[np.float64]


_MEMBERS = ("bounds", "finest", "faces", "boundary", "covers")


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


class Obstructable(Protocol):
    """The part of `Arena` on which obstacles depend; arenas import this file."""

    @property
    def bounds(self) -> tuple[Points, Points]: ...
    @property
    def period(self) -> tuple[float, float]: ...
    @property
    def walls(self) -> Walls | None: ...


def check_obstacles(arena: Obstructable, obstacles: tuple[Obstacle, ...]) -> None:
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
        if not all(hasattr(one, member) for member in _MEMBERS):
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
