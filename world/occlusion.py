"""Occlusion: bodies that have a radius block the sight of others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Packed, Record, inlined, kernel
from teamsight.core.table import Table
from teamsight.world.arena import Arena
from teamsight.world.walls import image, images, is_entered

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

# The number of bodies is filled up to a multiple of this, for SIMD lanes.
_LANES = 8
# With more bodies than these, those near a line of sight are found in cells.
_FEW = 64


class Opaque(NamedTuple):
    """The bodies that block sight, where they are now; it can be part of a `Record`.

    Attributes
    ----------
    x, y, radius : ndarray, shape (b,), float64
        Their positions and radii [length]. A body of radius 0 blocks nothing. The last ones, infinitely far
        away, fill lanes up.
    identity : ndarray, shape (b,), int64
        Their identities: nobody is hidden by its own body, or by that of the observer.
    next_one : ndarray, shape (b,), int64
        The next body in the same cell; −1 after the last.
    cells : ndarray, shape (b,), int64
        The first body in each cell, row by row; −1 for none.
    grid : ndarray, shape (7,), float64
        The number of cells along x and y, the lower left corner and the sides of a cell [length], and the largest
        radius, with a margin for rounding [length]. With one cell, `cells` is not used.
    period : ndarray, shape (2,), float64
        The period of the arena [length]; 0 along an axis that does not repeat.
    """

    x: Annotated[Floats, ".bodies"]
    y: Annotated[Floats, ".bodies"]
    radius: Annotated[Floats, ".bodies"]
    identity: Annotated[Integers, ".bodies"]
    next_one: Annotated[Integers, ".bodies"]
    cells: Annotated[Integers, ".bodies"]
    grid: Annotated[Floats, 7]
    period: Annotated[Floats, 2]

    @classmethod
    def of(cls, size: int, period: tuple[float, float] = (0.0, 0.0)) -> Opaque:
        """Return room for so many bodies."""
        size = -(-size // _LANES) * _LANES
        (x, y), radius, (identity, next_one, cells) = (
            np.full((2, size), np.inf), np.zeros(size), np.zeros((3, size), np.int64)
        )  # fmt: skip
        return cls(x, y, radius, identity, next_one, cells, np.zeros(7), np.array(period, float))


@cache
def no_bodies() -> Opaque:
    """Return bodies that are none."""
    return Opaque.of(0)


class OpaqueGroup(NamedTuple):
    """The record of the bodies of a group; see `BODIES`."""

    position: Annotated[Floats, "n", 2]
    radius: Annotated[Floats, "n"]
    active: Annotated[Flags, "n"]
    identity: Annotated[Integers, "n"]


class GatheringArrays(NamedTuple):
    """The record of `GATHER_BODIES`: the groups, the bodies to write, and the arena's lower corner and extent."""

    groups: list[Packed[OpaqueGroup]]
    opaque: Opaque
    low: Annotated[Floats, 2]
    extent: Annotated[Floats, 2]


GROUP, GATHERING = Record(OpaqueGroup), Record(GatheringArrays)
group_at, gathering_at = GROUP.at, GATHERING.at


def gathering(groups: Sequence[Table], arena: Arena) -> Packed[GatheringArrays]:
    """Return the argument of `GATHER_BODIES` for the bodies of these groups."""
    low, high = arena.bounds
    records = [GROUP.pack(OpaqueGroup(one.position, one.radius, one.active, one.identity)) for one in groups]
    opaque = Opaque.of(sum(map(len, groups)), arena.period)
    return GATHERING.pack(GatheringArrays(records, opaque, np.array(low, float), np.asarray(high, float) - low))


def _gather(address: int) -> int:
    """Write where the bodies are, and in which cells; those that are inactive have no radius."""
    here: Any = gathering_at(address)
    opaque = here.opaque
    grid = opaque.grid
    at = 0
    widest = 0.0
    for number in range(here.groups.shape[0]):
        group = group_at(here.groups[number])
        for i in range(group.position.shape[0]):
            opaque.x[at] = group.position[i, 0]
            opaque.y[at] = group.position[i, 1]
            opaque.radius[at] = group.radius[i] if group.active[i] else 0.0
            opaque.identity[at] = group.identity[i]
            widest = max(widest, opaque.radius[at])
            at += 1
    across = 1
    up = 1
    if at > _FEW:
        # About one body a cell.
        width = math.sqrt(here.extent[0] * here.extent[1] / at)
        across = min(max(math.floor(here.extent[0] / width), 1), at)
        up = min(max(math.floor(here.extent[1] / width), 1), at // across)
    grid[0] = across
    grid[1] = up
    for axis in range(2):
        grid[2 + axis] = here.low[axis]
        grid[4 + axis] = here.extent[axis] / grid[axis]
    grid[6] = widest + 1e-9 * (here.extent[0] + here.extent[1])
    if at <= _FEW:
        return 0
    for cell in range(across * up):
        opaque.cells[cell] = -1
    for j in range(at):
        if opaque.radius[j] > 0.0:
            cell_x = min(max(math.floor((opaque.x[j] - grid[2]) / grid[4]), 0), across - 1)
            cell_y = min(max(math.floor((opaque.y[j] - grid[3]) / grid[5]), 0), up - 1)
            opaque.next_one[j] = opaque.cells[cell_y * across + cell_x]
            opaque.cells[cell_y * across + cell_x] = j
    return 0


GATHER_BODIES = Entry(_gather)


@inlined
def _hides(x: float, y: float, way_x: float, way_y: float, j: int, mine: int, other: int, opaque: Any) -> bool:
    """Whether body `j`, or an image of it, lies on the line of sight and is that of neither end."""
    if opaque.identity[j] == mine or opaque.identity[j] == other:
        return False
    middle_x = x + 0.5 * way_x
    middle_y = y + 0.5 * way_y
    for across in range(images(opaque.period[0])):
        for up in range(images(opaque.period[1])):
            centre_x = opaque.x[j] + image(opaque.x[j], middle_x, opaque.period[0], across)
            centre_y = opaque.y[j] + image(opaque.y[j], middle_y, opaque.period[1], up)
            if is_entered(x, y, way_x, way_y, centre_x, centre_y, opaque.radius[j]):
                return True
    return False


@inlined
def _count_hiding(x: float, y: float, way_x: float, way_y: float, mine: int, other: int, opaque: Any) -> int:
    """Return how many bodies `_hides` is true of, where nothing repeats: a loop for SIMD lanes."""
    xs, ys, radius, identity = opaque.x, opaque.y, opaque.radius, opaque.identity
    length_2 = way_x * way_x + way_y * way_y
    length_2 = length_2 if length_2 > 0.0 else 1.0
    hiding = 0
    for j in range(np.uint64(xs.shape[0])):
        to_x = xs[j] - x
        to_y = ys[j] - y
        share = (to_x * way_x + to_y * way_y) / length_2
        share = share if share > 0.0 else 0.0
        share = share if share < 1.0 else 1.0
        off_x = to_x - share * way_x
        off_y = to_y - share * way_y
        is_on = off_x * off_x + off_y * off_y < radius[j] * radius[j]
        hiding += 1 if is_on & (identity[j] != mine) & (identity[j] != other) else 0
    return hiding


@kernel
def lines_of(low: float, high: float, corner: float, wide: float, count: int, period: float) -> tuple[int, int]:
    """Return the first and the last line of cells in an interval; numbers beyond the grid are of images."""
    first = math.floor((low - corner) / wide)
    last = math.floor((high - corner) / wide)
    if period > 0.0:
        return first, last
    return min(max(first, 0), count - 1), min(max(last, 0), count - 1)


@kernel
def is_hidden(x: float, y: float, way_x: float, way_y: float, mine: int, other: int, opaque: Any) -> bool:
    """Whether a body lies on the line of sight from (x, y) to (x + way_x, y + way_y).

    Parameters
    ----------
    x, y : float
        Where the observer is [length].
    way_x, way_y : float
        The shortest way to the centre of what it looks at [length].
    mine, other : int
        The identities of both, whose bodies hide nothing.
    opaque : Opaque
        The bodies.
    """
    grid = opaque.grid
    across = int(grid[0])
    up = int(grid[1])
    if across * up == 1 and opaque.period[0] == 0.0 and opaque.period[1] == 0.0:
        return _count_hiding(x, y, way_x, way_y, mine, other, opaque) > 0
    if across * up == 1:
        for j in range(opaque.x.shape[0]):
            if opaque.radius[j] > 0.0 and _hides(x, y, way_x, way_y, j, mine, other, opaque):
                return True
        return False
    reach = grid[6]
    left = x + min(way_x, 0.0) - reach
    right = x + max(way_x, 0.0) + reach
    first, last = lines_of(left, right, grid[2], grid[4], across, opaque.period[0])
    for column in range(first, last + 1):
        # The part of the way from which a body in this column can be near.
        begin = 0.0
        end = 1.0
        if way_x != 0.0:
            one = (grid[2] + column * grid[4] - reach - x) / way_x
            two = (grid[2] + (column + 1) * grid[4] + reach - x) / way_x
            begin = min(max(min(one, two), 0.0), 1.0)
            end = min(max(max(one, two), 0.0), 1.0)
        low = y + min(begin * way_y, end * way_y) - reach
        high = y + max(begin * way_y, end * way_y) + reach
        lowest, highest = lines_of(low, high, grid[3], grid[5], up, opaque.period[1])
        for row in range(lowest, highest + 1):
            j = opaque.cells[(row % up) * across + column % across]
            while j >= 0:
                if _hides(x, y, way_x, way_y, j, mine, other, opaque):
                    return True
                j = opaque.next_one[j]
    return False
