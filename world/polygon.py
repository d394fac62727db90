"""Polygons: arenas of any simple polygonal shape, and polygonal obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.world import polygons
from teamsight.world.contract import Arena, Points
from teamsight.world.free_places import fits, nearest_free, place_freely
from teamsight.world.sight import Sight, open_sight
from teamsight.world.walls import ROUNDING, Walls, confine_walls, walls_size

_MOST_SHOWN = 6


class Polygon(Arena):
    """An arena, or an obstacle, that is a simple polygon; its walls reflect position and heading.

    It need not be convex, nor centred on the origin.

    Parameters
    ----------
    vertices : sequence of pairs of float
        The corners in order around it, in either direction [length].

    Attributes
    ----------
    vertices : ndarray, shape (k, 2), float64
        The corners in counter-clockwise order, beginning with the first; read-only.

    Raises
    ------
    TypeError, ValueError
        If they are not at least three pairs of finite numbers, or if the polygon crosses or touches itself.
    """

    confine = confine_walls

    def __init__(self, vertices: Sequence[Sequence[float]] | npt.NDArray[Any]) -> None:
        self.vertices = polygons.checked_vertices(vertices)
        self.vertices.flags.writeable = False

    @cached_property
    def walls(self) -> Walls:
        return Walls(polygons.walls_of(self.vertices), np.empty((0, 3)))

    @property
    def near_walls(self) -> Walls:
        """The walls."""
        return self.walls

    @cached_property
    def kept(self) -> dict[tuple[str, float], Points]:
        """What searches for places have found, for each margin."""
        return {}

    @property
    def faces(self) -> Walls:
        """The walls seen from outside, if it is an obstacle."""
        return Walls(self.walls.segments[:, [2, 3, 0, 1]], self.walls.discs)

    @cached_property
    def finest(self) -> float:
        """The least length of a wall, or distance between walls that are not next to each other [length]."""
        segments = self.walls.segments
        lengths = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
        return float(min([lengths.min(), *(gap.min() for _, _, gap in polygons.gaps(self.vertices) if len(gap))]))

    @cached_property
    def _slack(self) -> float:
        return ROUNDING * float(np.abs(self.vertices).max())

    @property
    def size(self) -> tuple[float, ...]:
        return walls_size(self.walls, self.period, self._slack)

    @cached_property
    def area(self) -> float:
        return polygons.signed_area(self.vertices)

    @property
    def bounds(self) -> tuple[Points, Points]:
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @cached_property
    def sight(self) -> Sight:
        if polygons.is_convex(self.vertices):
            return open_sight()
        return Sight(*self.walls, np.zeros(2), 10.0 * self._slack)

    @property
    def boundary(self) -> Points:
        return self.vertices

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        position = np.asarray(position, float)
        inside = polygons.is_within(position, self.vertices)
        outside = ~inside
        inside[outside] = polygons.distance_to_walls(position[outside], self.walls.segments) <= self._slack
        return inside

    def covers(self, position: npt.ArrayLike, slack: float = 0.0) -> npt.NDArray[np.bool_]:
        """Return for each position, shape (..., 2), whether it is inside by more than `slack` [length]."""
        position = np.asarray(position, float)
        inside = polygons.is_within(position, self.vertices)
        inside[inside] = polygons.distance_to_walls(position[inside], self.walls.segments) > slack
        return inside

    @cached_property
    def _triangles(self) -> tuple[Points, Points]:
        """Triangles that it consists of, shape (t, 3, 2), and their shares of the area, summed up, shape (t,)."""
        found = polygons.triangles(self.vertices)
        areas = np.array([polygons.signed_area(triangle) for triangle in found])
        return found, np.cumsum(areas) / areas.sum()

    def draw(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Points:
        """Map uniform numbers to positions uniform over the polygon."""
        u, v = np.asarray(u, float), np.asarray(v, float)
        triangles, shares = self._triangles
        which = np.minimum(np.searchsorted(shares, u, side="right"), len(shares) - 1)
        before = np.concatenate([[0.0], shares])[which]
        # The part of u beyond the triangles before is uniform again.
        root = np.sqrt(np.clip((u - before) / (shares[which] - before), 0.0, 1.0))[..., None]
        first, second, third = np.moveaxis(triangles[which], -2, 0)
        share = v[..., None]
        return np.asarray((1.0 - root) * first + root * ((1.0 - share) * second + share * third))

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> Points:
        return place_freely(self, u, v, margin)

    def inside(self, points: Points, margin: float = 0.0) -> Points:
        return nearest_free(self, points, margin)

    def fits(self, margin: float) -> bool:
        return fits(self, margin)

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and np.array_equal(self.vertices, other.vertices)  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash(self.vertices.tobytes())

    def __repr__(self) -> str:
        return f"Polygon({self._listed(len(self.vertices))})"

    def __str__(self) -> str:
        shown = self._listed(_MOST_SHOWN)
        return f"Polygon({shown})" if len(self.vertices) <= _MOST_SHOWN else f"Polygon({shown[:-1]}, …])"

    def _listed(self, most: int) -> str:
        return f"[{', '.join(f'({x:.15g}, {y:.15g})' for x, y in self.vertices[:most].tolist())}]"
