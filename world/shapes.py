"""Circles, polygons, arenas with obstacles, and the region of an arena in which bodies may be, for kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, Component
from teamsight.core.kernel import kernel
from teamsight.world.arena import Arena, Disc, Obstructed, Points, WalledArena
from teamsight.world.limits import LONGEST, Length
from teamsight.world.polygons import (
    checked_vertices,
    distance_to_walls,
    gaps,
    is_convex,
    is_within,
    round_boundary,
    signed_area,
    triangles,
    walls_of,
)
from teamsight.world.walls import (
    ROUNDING,
    Sight,
    Walls,
    confine_walls,
    open_sight,
    walls_size,
)


def _checked_place(name: str, value: Any) -> tuple[float, float]:
    given = checks.shown(value)
    try:
        place = np.array(value, float)
    except (TypeError, ValueError):
        raise TypeError(f"{name}={given}: must be two numbers, such as (0, 0)") from None
    if place.shape != (2,) or not (np.abs(place) <= LONGEST).all():
        raise ValueError(f"{name}={given}: must be two numbers of at most {LONGEST:g}, such as (0, 0)")
    x, y = place.tolist()
    return x, y


@dataclass(frozen=True)
class Circle(Component):
    """A round obstacle, for `Arena.with_obstacles`.

    Parameters
    ----------
    centre : tuple of float
        x and y of its centre [length].
    radius : float
        [length], above 0.

    Raises
    ------
    TypeError, ValueError
        If the centre is not two finite numbers, or the radius not a number above 0 within the limits of lengths.
    """

    centre: Annotated[tuple[float, float], Allowed(check=_checked_place, unit="length")]
    radius: Length

    @property
    def bounds(self) -> tuple[Points, Points]:
        """The lower left and the upper right corner of the box around it, each of shape (2,)."""
        return np.array(self.centre) - self.radius, np.array(self.centre) + self.radius

    @property
    def finest(self) -> float:
        """Its diameter [length]."""
        return 2.0 * self.radius

    @property
    def faces(self) -> Walls:
        """Its wall, seen from outside."""
        return Walls(np.empty((0, 4)), np.array([[*self.centre, self.radius]]))

    def covers(self, position: npt.ArrayLike, slack: float = 0.0) -> npt.NDArray[np.bool_]:
        """Return for each position, shape (..., 2), whether it is inside by more than `slack` [length]."""
        off = np.asarray(position, float) - self.centre
        return np.asarray(np.hypot(off[..., 0], off[..., 1]) < self.radius - slack)

    @property
    def boundary(self) -> Points:
        """A polygon that looks like it, as vertices for drawing, shape (k, 2) [length]."""
        return round_boundary(self.centre, self.radius)


_MOST_SHOWN = 6


class Polygon(WalledArena):
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
        self.vertices = checked_vertices(vertices)
        self.vertices.flags.writeable = False

    @cached_property
    def walls(self) -> Walls:
        return Walls(walls_of(self.vertices), np.empty((0, 3)))

    @property
    def near_walls(self) -> Walls:
        """The walls."""
        return self.walls

    @property
    def faces(self) -> Walls:
        """The walls seen from outside, if it is an obstacle."""
        return Walls(self.walls.segments[:, [2, 3, 0, 1]], self.walls.discs)

    @cached_property
    def finest(self) -> float:
        """The least length of a wall, or distance between walls that are not next to each other [length]."""
        segments = self.walls.segments
        lengths = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
        return float(min([lengths.min(), *(gap.min() for _, _, gap in gaps(self.vertices) if len(gap))]))

    @cached_property
    def _slack(self) -> float:
        return ROUNDING * float(np.abs(self.vertices).max())

    @property
    def size(self) -> tuple[float, ...]:
        return walls_size(self.walls, self.period, self._slack)

    @cached_property
    def area(self) -> float:
        return signed_area(self.vertices)

    @property
    def bounds(self) -> tuple[Points, Points]:
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @cached_property
    def sight(self) -> Sight:
        if is_convex(self.vertices):
            return open_sight()
        return Sight(*self.walls, np.zeros(2), 10.0 * self._slack)

    @property
    def boundary(self) -> Points:
        return self.vertices

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        position = np.asarray(position, float)
        inside = is_within(position, self.vertices)
        outside = ~inside
        inside[outside] = distance_to_walls(position[outside], self.walls.segments) <= self._slack
        return inside

    def covers(self, position: npt.ArrayLike, slack: float = 0.0) -> npt.NDArray[np.bool_]:
        """Return for each position, shape (..., 2), whether it is inside by more than `slack` [length]."""
        position = np.asarray(position, float)
        inside = is_within(position, self.vertices)
        inside[inside] = distance_to_walls(position[inside], self.walls.segments) > slack
        return inside

    @cached_property
    def _triangles(self) -> tuple[Points, Points]:
        """Triangles that it consists of, shape (t, 3, 2), and their shares of the area, summed up, shape (t,)."""
        found = triangles(self.vertices)
        areas = np.array([signed_area(triangle) for triangle in found])
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


Floats = npt.NDArray[np.float64]


class Region(NamedTuple):
    """An area: what is inside all of some shapes and inside none of others.

    Attributes
    ----------
    box : ndarray, shape (2, 2), float64
        The lowest and the highest corner of the box around it.
    discs : ndarray, shape (discs, 4), float64
        Discs: centre, radius, and 1 for one that is an obstacle, else 0.
    corners : ndarray, shape (corners, 2), float64
        The corners of all polygons, one polygon after the other.
    polygons : ndarray, shape (polygons, 3), int64
        For each polygon: its first corner, that after its last, and 1 for an obstacle, else 0.
    slack : float
        So far a body may be beyond a wall through rounding [length].
    """

    box: Annotated[Floats, 2, 2]
    discs: Annotated[Floats, ".discs", 4]
    corners: Annotated[Floats, ".corners", 2]
    polygons: Annotated[npt.NDArray[np.int64], ".polygons", 3]
    slack: float


@kernel
def _is_within(corners: Any, first: int, last: int, x: float, y: float) -> bool:
    """Whether a place is inside a polygon."""
    inside = False
    before = last - 1
    for at in range(first, last):
        x_0 = corners[before, 0]
        y_0 = corners[before, 1]
        x_1 = corners[at, 0]
        y_1 = corners[at, 1]
        if (y_0 > y) != (y_1 > y) and x < x_0 + (y - y_0) * ((x_1 - x_0) / (y_1 - y_0)):
            inside = not inside
        before = at
    return inside


@kernel
def _distance_to_walls(corners: Any, first: int, last: int, x: float, y: float) -> float:
    """Return the distance of a place to the nearest wall of a polygon."""
    nearest = math.inf
    before = last - 1
    for at in range(first, last):
        edge_x = corners[at, 0] - corners[before, 0]
        edge_y = corners[at, 1] - corners[before, 1]
        off_x = x - corners[before, 0]
        off_y = y - corners[before, 1]
        share = (off_x * edge_x + off_y * edge_y) / (edge_x * edge_x + edge_y * edge_y)
        share = min(max(share, 0.0), 1.0)
        gap_x = off_x - share * edge_x
        gap_y = off_y - share * edge_y
        nearest = min(nearest, gap_x * gap_x + gap_y * gap_y)
        before = at
    return math.sqrt(nearest)


@kernel
def is_in_region(region: Any, x: float, y: float) -> bool:
    """Whether a place is in a region; NaN is not."""
    box, slack = region.box, region.slack
    if not (
        box[0, 0] - slack <= x <= box[1, 0] + slack and box[0, 1] - slack <= y <= box[1, 1] + slack
    ):
        return False
    for d in range(region.discs.shape[0]):
        off_x = x - region.discs[d, 0]
        off_y = y - region.discs[d, 1]
        radius = region.discs[d, 2]
        if region.discs[d, 3] != 0.0:
            if math.sqrt(off_x * off_x + off_y * off_y) < radius - slack:
                return False
        elif off_x * off_x + off_y * off_y > (radius + slack) * (radius + slack):
            return False
    for p in range(region.polygons.shape[0]):
        first = region.polygons[p, 0]
        last = region.polygons[p, 1]
        is_obstacle = region.polygons[p, 2] != 0
        # On the right side, or so near to the wall that rounding may have put it on the other.
        if _is_within(region.corners, first, last, x, y) == is_obstacle and not (
            _distance_to_walls(region.corners, first, last, x, y) <= slack
        ):
            return False
    return True


def region_of(arena: Arena) -> Region:
    """Return where bodies may be in an arena; for one of a user, the box around it."""
    slack = arena._slack if isinstance(arena, (Obstructed, Polygon)) else 0.0
    inner, images = (arena.arena, arena._images) if isinstance(arena, Obstructed) else (arena, [])
    discs: list[tuple[float, float, float, float]] = []
    rings: list[tuple[Floats, bool]] = []
    # A class derived from one of these may have another `contains`.
    if type(inner) is Disc:
        discs.append((0.0, 0.0, inner.radius, 0.0))
    elif type(inner) is Polygon:
        rings.append((inner.vertices, False))
    for obstacle, shift in images:
        if type(obstacle) is Circle:
            discs.append((*(np.array(obstacle.centre) + shift).tolist(), obstacle.radius, 1.0))
        elif type(obstacle) is Polygon:
            rings.append((obstacle.vertices + shift, True))
    ends = np.cumsum([len(corners) for corners, _ in rings]).tolist()
    polygons = [
        (end - len(corners), end, int(is_obstacle)) for (corners, is_obstacle), end in zip(rings, ends, strict=True)
    ]
    corners = np.concatenate([np.zeros((0, 2)), *(corners for corners, _ in rings)])
    return Region(
        np.array(arena.bounds, float), np.array(discs, float).reshape(-1, 4), corners,
        np.array(polygons, np.int64).reshape(-1, 3), float(slack),
    )  # fmt: skip
