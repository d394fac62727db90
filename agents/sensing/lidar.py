"""Lidar: how far each robot of a group sees along rays, up to the nearest wall, obstacle or body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.sensing.sensor import FULL_TURN, checked_view, normals, salt_of
from teamsight.core import checks
from teamsight.core.angles import ANGLE_MARGIN, angle_of_ratio, direction_after
from teamsight.core.component import Allowed, Component, NonNegative, Positive
from teamsight.core.kernel import Entry, Packed, Record, below_64, inlined, kernel, lowest_bit, plain, scratch
from teamsight.core.kernel.intrinsics import near_eight
from teamsight.core.table import Field
from teamsight.world.arena import states_walls
from teamsight.world.noise import Stream, philox, stream_number
from teamsight.world.occlusion import Opaque, lines_of, no_bodies
from teamsight.world.walls import ROUNDING, is_behind, joined, repeated

if TYPE_CHECKING:
    from teamsight.agents.group import Group
    from teamsight.agents.world_data import WorldData

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: The most rays of a robot.
MOST_RAYS = 10_000
# A reading is that of the nearest thing; those that are farther than the range by more than this share are left out.
_BEYOND = 1.0 + 1e-9
# Angles are computed to within `ANGLE_MARGIN`, which covers all rays if they are nearer to each other than this [rad].
_FINEST = 1e-10


@dataclass(frozen=True)
class Lidar(Component):
    """A sensor that measures distances along rays from the centre of a robot to the nearest wall, obstacle or body.

    A group has it as ``world.add(…, lidar=Lidar(…))``; its readings are ``percept.lidar``, shape (n, rays).

    Parameters
    ----------
    rays : int, default 32
        The number of rays.
    range : float, default 1
        How far they reach [length]. A ray that meets nothing within it reads the range.
    field_of_view : float, default 2π
        The angle that the rays cover, centred on the heading [rad]; above 0, at most 2π.
    range_noise : float, default 0
        Standard deviation of distances [length]. Noisy readings saturate at 0 and at the range; a ray that meets
        nothing has no noise.

    Raises
    ------
    TypeError, ValueError
        If an option has the wrong type or is outside its limits.

    Notes
    -----
    Rays are numbered anticlockwise, from the right end of the field of view to its left end; `bearings` has their
    angles. The first and the last are at the ends; with a full turn the first is straight behind, and the last is one
    step before it, so that no ray is there twice. A single ray is straight ahead.

    Rays meet all active bodies with a `radius`, of whatever group and whatever the `contact` of the world, but not the
    robot's own; agents without one are points, and no ray meets them. A robot whose centre is inside of another body
    reads 0. An inactive robot reads the range.
    """

    rays: Annotated[int, Allowed(least=1, most=MOST_RAYS)] = 32
    range: Annotated[Positive, Allowed(unit="length")] = 1.0
    field_of_view: Annotated[
        float,
        Allowed(above=0, most=FULL_TURN, check=partial(checked_view, cure="for one ray use rays=1"), unit="rad"),
    ] = FULL_TURN
    range_noise: Annotated[NonNegative, Allowed(unit="length")] = 0.0

    @property
    def spacing(self) -> float:
        """The angle from one ray to the next [rad]."""
        if self.field_of_view >= FULL_TURN or self.rays == 1:
            return FULL_TURN / self.rays
        return self.field_of_view / (self.rays - 1)

    @property
    def bearings(self) -> Floats:
        """The angle of each ray from the heading, anticlockwise, shape (rays,) [rad]."""
        return FULL_TURN * self.turns

    @property
    def turns(self) -> Floats:
        """The same in full turns, from which directions are computed, since quarters of a turn are exact."""
        if self.rays == 1:
            return np.zeros(1)
        number = np.arange(self.rays)
        if self.field_of_view >= FULL_TURN:
            return number / self.rays - 0.5
        return (number / (self.rays - 1) - 0.5) * (self.field_of_view / FULL_TURN)

    @property
    def field(self) -> Field:
        """The column of the readings."""
        return Field("lidar", shape=(self.rays,), fill=float(self.range), reset="fill", unit="length")


#: The number of round things that are processed at once.
CHUNK = 64
LANES = 8
#: Room for these, and for what fills up the lanes.
ROOM = CHUNK + LANES


class Near(NamedTuple):
    """Round things that are noted, bodies or obstacles: room for `ROOM`.

    Attributes
    ----------
    x, y, radius : ndarray, shape (ROOM,), float64
        Their centres as seen from the robot, and their radii [length].
    """

    x: Floats
    y: Floats
    radius: Floats


class LidarArrays(NamedTuple):
    """The record of the lidar of n robots.

    Attributes
    ----------
    position, heading, active, member
        As in `BODIES`.
    readings : ndarray, shape (n, rays), float64
        What is written: distances [length].
    turned : ndarray, shape (2, rays + LANES), float64
        Cosine and sine of the angle of each ray from the heading; 0 after the last ray.
    way, row : ndarray, shape (2, rays + LANES) and (rays + LANES,), float64
        Room for the directions of the rays of a robot, unit vectors, and for their distances.
    first : float
        The angle of the first ray from the heading [rad].
    per_radian, turn : float
        Rays in a radian, and in a full turn.
    range, range_noise : float
        As in `Lidar`.
    segments, discs : ndarray, shape (s, 4) and (d, 3), float64
        Walls and obstacles, with all images that are near; see `Walls`.
    slack : float
        A robot beyond a wall by at most this distance is on the wall [length].
    opaque : Opaque
        The bodies; none if all are points.
    own : int
        The index of the body of the first robot among them.
    tick, key, salt, stream
        What the noise depends on; see `View`.
    """

    position: Annotated[Floats, "n", 2]
    heading: Annotated[Floats, "n", 2]
    active: Annotated[npt.NDArray[np.bool_], "n"]
    member: Annotated[Integers, "n"]
    readings: Annotated[Floats, "n", "rays"]
    turned: Annotated[Floats, 2, f"rays + {LANES}"]
    way: Annotated[Floats, 2, f"rays + {LANES}"]
    row: Annotated[Floats, f"rays + {LANES}"]
    first: float
    per_radian: float
    turn: float
    range: float
    range_noise: float
    segments: Annotated[Floats, ".segments", 4]
    discs: Annotated[Floats, ".discs", 3]
    slack: float
    opaque: Opaque
    own: int
    tick: Annotated[Integers, 1]
    key: Annotated[npt.NDArray[np.uint64], 2]
    salt: Annotated[npt.NDArray[np.uint64], 2]
    stream: int


LIDAR = Record(LidarArrays)
lidar_at = LIDAR.at


@inlined
def _rays_of(here: Any, i: int, near: Any, lanes: Any, begin: Any, end: Any, gap: Any, miss: Any) -> None:
    """Compute in SIMD lanes, from near angles, which rays of robot `i` may meet each round thing.

    Written are the first and the last of them, the squared distance less the squared radius, and what is below 0 where
    some ray may meet it.
    """
    ahead_x = here.heading[i, 0]
    ahead_y = here.heading[i, 1]
    last = here.readings.shape[1] - 1.0
    for k in range(lanes):
        x = near.x[k]
        y = near.y[k]
        radius = near.radius[k]
        ahead = x * ahead_x + y * ahead_y
        left = y * ahead_x - x * ahead_y
        wide = abs(ahead)
        high = abs(left)
        larger = wide if wide > high else high
        smaller = high if wide > high else wide
        away_2 = x * x + y * y
        gap[k] = away_2 - radius * radius
        edge = math.sqrt(gap[k] if gap[k] > 1e-300 else 1e-300)
        # One division for two quotients: the ratio, and the tangent of half the angle, which is larger than that.
        inverse = 1.0 / (larger * edge)
        bearing = angle_of_ratio(smaller * edge * inverse, left, ahead) - here.first
        bearing = bearing if bearing >= 0.0 else bearing + FULL_TURN
        tangent = radius * larger * inverse
        half = ((tangent if tangent < 0.5 * math.pi else 0.5 * math.pi) + ANGLE_MARGIN) * here.per_radian
        middle = bearing * here.per_radian
        # There is a ray within it, or within that of another turn; then any ray may be.
        is_between = (abs(middle - np.rint(middle)) <= half) & (middle - half <= last)
        is_at_seam = (middle + half >= here.turn) | (middle - half + here.turn <= last) | (gap[k] <= 0.0)
        low = np.rint(middle - half - 0.5)
        high = np.rint(middle + half + 0.5)
        begin[k] = 0.0 if is_at_seam | (low < 0.0) else low
        end[k] = last if is_at_seam | (high > last) else high
        # Of radius 0 are points.
        longest = here.range + radius
        is_near = (radius > 0.0) & (away_2 <= longest * longest * _BEYOND)
        miss[k] = np.float32(-1.0) if (is_between | is_at_seam) & is_near else np.float32(1.0)
    for k in range(lanes, np.uint64(CHUNK)):
        miss[k] = np.float32(1.0)


@kernel
def _meet_near(here: Any, i: int, near: Any, count: int, are_walls: bool) -> None:
    """Let the rays of robot `i` end at the round things that are noted, `count` bodies or obstacles.

    Which rays may meet each is computed from near angles; whether they do, exactly.
    """
    begin = scratch(CHUNK, np.float64)
    end = scratch(CHUNK, np.float64)
    gap = scratch(CHUNK, np.float64)
    miss = scratch(CHUNK, np.float32)
    # A number of whole lanes, as the compiler sees; it leaves none over.
    lanes = np.uint64((count + LANES - 1) // LANES) * np.uint64(LANES)
    for k in range(np.uint64(count), np.uint64(count) + np.uint64(LANES)):
        near.radius[k] = 0.0
    _rays_of(here, i, near, lanes, begin, end, gap, miss)
    row = here.row
    way = here.way
    word = below_64(miss, np.uint64(0), np.float32(0.0))
    while word != 0:
        k, word = lowest_bit(word)
        first = np.uint64(begin[k])
        if gap[k] <= 0.0:
            _stop_inside(here, near.x[k], near.y[k], are_walls)
            continue
        x = near.x[k]
        y = near.y[k]
        radius = near.radius[k]
        # Whole lanes, usually one, since a branch for each ray would be mispredicted.
        rays = (np.uint64(end[k] - begin[k]) // np.uint64(LANES) + np.uint64(1)) * np.uint64(LANES)
        for j in range(first, first + rays):
            along = x * way[0, j] + y * way[1, j]
            across = x * way[1, j] - y * way[0, j]
            depth = radius * radius - across * across
            distance = gap[k] / (along + math.sqrt(depth if depth > 0.0 else 0.0))
            is_met = (along > 0.0) & (depth >= 0.0) & (distance < row[j])
            row[j] = distance if is_met else row[j]


@kernel
def _stop_inside(here: Any, x: float, y: float, is_wall: bool) -> None:
    """Let all rays end in a disc, whose centre is at (x, y) from the robot, which is inside.

    Inside of an obstacle is only what rounding has put there, which is on its wall.
    """
    for j in range(here.readings.shape[1]):
        here.row[j] = here.row[j] if is_wall and x * here.way[0, j] + y * here.way[1, j] <= 0.0 else 0.0


@inlined
def _note(near: Any, count: int, x: float, y: float, radius: float) -> int:
    """Note a round thing, whose centre is at (x, y) from the robot, as number `count`; return the next number."""
    near.x[count] = x
    near.y[count] = y
    near.radius[count] = radius
    return count + 1


@kernel
def _meet_hollow_disc(here: Any, i: int, x: float, y: float, radius: float) -> None:
    """Let the rays of robot `i` end at the wall around a disc in which it is, whose centre is at (x, y) from it."""
    away_2 = x * x + y * y
    room = radius - here.range
    if room > 0.0 and away_2 * _BEYOND < room * room:
        return
    row = here.row
    way = here.way
    gap = max(radius * radius - away_2, 0.0)
    for j in range(np.uint64(row.shape[0])):
        along = x * way[0, j] + y * way[1, j]
        distance = along + math.sqrt(along * along + gap)
        row[j] = distance if distance < row[j] else row[j]


@kernel
def _wall_beyond(here: Any, k: int, is_end: bool) -> int:
    """Return the wall that continues wall `k` at its end, or at its beginning, if an obstacle has a corner there.

    −1 if there is none, or the corner is one of the free area, whose walls both stop what leads behind them.
    """
    walls = here.segments
    x = walls[k, 2 if is_end else 0]
    y = walls[k, 3 if is_end else 1]
    for j in range(walls.shape[0]):
        if walls[j, 0 if is_end else 2] == x and walls[j, 1 if is_end else 3] == y:
            first, then = (k, j) if is_end else (j, k)
            turn = (walls[first, 2] - walls[first, 0]) * (walls[then, 3] - walls[then, 1]) - (
                walls[first, 3] - walls[first, 1]
            ) * (walls[then, 2] - walls[then, 0])
            return j if turn < 0.0 else -1
    return -1


@kernel
def _meet_corner(here: Any, k: int, other: int) -> None:
    """Let the rays end of a robot at the corner of an obstacle, those that lead behind both of its walls."""
    walls = here.segments
    for j in range(here.row.shape[0]):
        x, y = here.way[0, j], here.way[1, j]
        is_met = (walls[k, 2] - walls[k, 0]) * y < (walls[k, 3] - walls[k, 1]) * x
        is_met &= (walls[other, 2] - walls[other, 0]) * y < (walls[other, 3] - walls[other, 1]) * x
        here.row[j] = 0.0 if is_met else here.row[j]


@kernel
def _meet_wall(here: Any, k: int, x_0: float, y_0: float, x_1: float, y_1: float) -> None:
    """Let the rays of a robot end at wall `k`, whose ends are seen from the robot.

    A ray meets it if one end is to its right and the other to its left. Walls that have an end in common compute the
    same numbers for it, so no ray slips between them.
    """
    edge_x = x_1 - x_0
    edge_y = y_1 - y_0
    length_2 = edge_x * edge_x + edge_y * edge_y
    area = x_0 * y_1 - y_0 * x_1
    if is_behind(area, length_2, here.slack):
        return
    if area > 0.0 and area * area > here.range * here.range * length_2 * _BEYOND:
        return
    at_0 = x_0 * x_0 + y_0 * y_0 <= here.slack * here.slack
    if at_0 or x_1 * x_1 + y_1 * y_1 <= here.slack * here.slack:
        other = _wall_beyond(here, k, not at_0)
        if other >= 0:
            _meet_corner(here, k, other)
            return
    row = here.row
    way = here.way
    area = max(area, 0.0)
    for j in range(np.uint64(row.shape[0])):
        right = way[0, j] * y_0 - way[1, j] * x_0
        left = way[0, j] * y_1 - way[1, j] * x_1
        one = way[0, j] * x_0 + way[1, j] * y_0
        other = way[0, j] * x_1 + way[1, j] * y_1
        # Along the wall rounding moves the place where they meet, but it lies between the ends.
        nearer = one if one < other else other
        farther = other if one < other else one
        distance = area / (left - right)
        distance = distance if distance > nearer else nearer
        distance = distance if distance < farther else farther
        distance = distance if distance > 0.0 else 0.0
        is_met = (right <= 0.0) & (left >= 0.0) & (left > right) & (distance < row[j])
        row[j] = distance if is_met else row[j]


@kernel
def _meet_obstacles(here: Any, i: int, near: Any) -> None:
    """Let the rays of robot `i` end at round obstacles and at round walls."""
    count = 0
    for k in range(here.discs.shape[0]):
        x = here.discs[k, 0] - here.position[i, 0]
        y = here.discs[k, 1] - here.position[i, 1]
        if here.discs[k, 2] < 0.0:
            _meet_hollow_disc(here, i, x, y, -here.discs[k, 2])
        else:
            count = _note(near, count, x, y, here.discs[k, 2])
        if count == CHUNK or (count > 0 and k == here.discs.shape[0] - 1):
            _meet_near(here, i, near, count, True)
            count = 0


@kernel
def _meet_all(here: Any, i: int, near: Any, x: float, y: float) -> None:
    """Let the rays of robot `i`, which is at (x, y), end at bodies of which all are compared."""
    opaque = here.opaque
    reach = here.range + opaque.grid[6]
    limit = reach * reach * _BEYOND
    own = np.uint64(here.own + i)
    for begin in range(np.uint64(0), np.uint64(opaque.x.shape[0]), np.uint64(CHUNK)):
        word = np.uint64(0)
        for k in range(begin, min(begin + np.uint64(CHUNK), np.uint64(opaque.x.shape[0])), np.uint64(LANES)):
            word |= near_eight(opaque.x, opaque.y, k, x, y, limit) << (k - begin)
        count = 0
        while word != 0:
            bit, word = lowest_bit(word)
            j = begin + bit
            # Its own is noted as a point, which is no branch.
            radius = opaque.radius[j] if j != own else 0.0
            count = _note(near, count, opaque.x[j] - x, opaque.y[j] - y, radius)
        if count > 0:
            _meet_near(here, i, near, count, False)


@kernel
def _meet_bodies(here: Any, i: int, near: Any) -> None:
    """Let the rays of robot `i` end at the bodies of others."""
    opaque = here.opaque
    grid = opaque.grid
    across = int(grid[0])
    up = int(grid[1])
    x = here.position[i, 0]
    y = here.position[i, 1]
    if across * up == 1 and opaque.period[0] == 0.0 and opaque.period[1] == 0.0:
        _meet_all(here, i, near, x, y)
        return
    reach = here.range + grid[6]
    first, last = lines_of(x - reach, x + reach, grid[2], grid[4], across, opaque.period[0])
    lowest, highest = lines_of(y - reach, y + reach, grid[3], grid[5], up, opaque.period[1])
    count = 0
    for column in range(first, last + 1):
        # Cells beyond the grid are images of others.
        from_x = x - (column // across) * opaque.period[0]
        for line in range(lowest, highest + 1):
            from_y = y - (line // up) * opaque.period[1]
            if across * up == 1:
                _meet_all(here, i, near, from_x, from_y)
                continue
            j = opaque.cells[(line % up) * across + column % across]
            while j >= 0:
                if j != here.own + i:
                    count = _note(near, count, opaque.x[j] - from_x, opaque.y[j] - from_y, opaque.radius[j])
                j = opaque.next_one[j]
                if count == CHUNK:
                    _meet_near(here, i, near, count, False)
                    count = 0
    if count > 0:
        _meet_near(here, i, near, count, False)


@kernel
def _disturb(here: Any, i: int) -> None:
    """Add the noise of the rays of robot `i`."""
    row = here.readings[i]
    for j in range(row.shape[0]):
        if row[j] < here.range:
            first, second, _, _ = philox(
                np.uint64(here.tick[0]), np.uint64(here.member[i]), np.uint64(j), np.uint64(here.stream),
                here.key[0] ^ here.salt[0], here.key[1] ^ here.salt[1],
            )  # fmt: skip
            row[j] = min(max(row[j] + here.range_noise * normals(first, second)[0], 0.0), here.range)


@kernel
def _look(here: Any, i: int, near: Any) -> None:
    """Write how far the rays of robot `i` go; `near` is room."""
    turned, way = here.turned, here.way
    x = here.position[i, 0]
    y = here.position[i, 1]
    ahead_x = here.heading[i, 0]
    ahead_y = here.heading[i, 1]
    # A policy's heading is a unit vector to within 1e-6.
    scale = 1.0 / math.sqrt(ahead_x * ahead_x + ahead_y * ahead_y)
    ahead_x *= scale
    ahead_y *= scale
    for j in range(np.uint64(way.shape[1])):
        way[0, j] = turned[0, j] * ahead_x - turned[1, j] * ahead_y
        way[1, j] = turned[1, j] * ahead_x + turned[0, j] * ahead_y
    _meet_obstacles(here, i, near)
    for k in range(here.segments.shape[0]):
        _meet_wall(
            here, k, here.segments[k, 0] - x, here.segments[k, 1] - y, here.segments[k, 2] - x,
            here.segments[k, 3] - y,
        )  # fmt: skip
    if here.opaque.x.shape[0] > 0:
        _meet_bodies(here, i, near)


def _measure(address: int) -> int:
    """Write the readings of all robots of a group."""
    here: Any = lidar_at(address)
    near = Near(scratch(ROOM, np.float64), scratch(ROOM, np.float64), scratch(ROOM, np.float64))
    for i in range(here.position.shape[0]):
        row = here.row
        for j in range(np.uint64(row.shape[0])):
            row[j] = here.range
        if here.active[i]:
            _look(here, i, near)
        readings = here.readings[i]
        for j in range(np.uint64(readings.shape[0])):
            readings[j] = row[j]
        if here.range_noise > 0.0:
            _disturb(here, i)
    return 0


MEASURE = Entry(_measure)


def lidar_of(value: Any, data: WorldData) -> Lidar | None:
    """Return the lidar that a user gives to a group.

    Raises
    ------
    TypeError, ValueError
        If it is no lidar, its range is too long for the arena, or the arena does not say where its walls are.
    """
    if value is None:
        return None
    if not isinstance(value, Lidar):
        shown = f"{value.__name__}: is a class; give an object" if isinstance(value, type) else checks.shown(value)
        raise TypeError(f"lidar={shown}: must be a Lidar, such as Lidar(rays=32, range=2.0)")
    data.limits.range("lidar.range", value.range)
    if not states_walls(data.arena):
        raise TypeError(
            f"lidar={value}: {type(data.arena).__name__} does not say where its walls are; define `walls`, the "
            "segments and discs at which its confine reflects, or use Polygon"
        )
    return value


def bound_lidar(group: Group, data: WorldData, opaque: Opaque | None) -> Packed[LidarArrays]:
    """Return the argument of `MEASURE` for a group that has a lidar; `opaque` are the bodies, if some have a radius."""
    lidar, bodies, arena = group.lidar, group.bodies, data.arena
    assert lidar is not None
    walls = repeated(joined([arena.walls]), arena.period, arena.bounds)
    largest = max(float(np.abs(part).max(initial=0.0)) for part in (np.array(arena.bounds), *walls))
    spacing = max(lidar.spacing, _FINEST)
    turned = np.zeros((2, lidar.rays + LANES))
    turned[:, : lidar.rays] = np.array([plain(direction_after)(turn) for turn in lidar.turns.tolist()]).T
    return LIDAR.pack(LidarArrays(
        bodies.position, bodies.heading, bodies.active, bodies.member, bodies.lidar,
        turned, np.zeros_like(turned), np.zeros(len(turned[0])), float(lidar.bearings[0]), 1.0 / spacing,
        FULL_TURN / spacing, float(lidar.range), float(lidar.range_noise), walls.segments, walls.discs,
        10.0 * ROUNDING * largest, opaque or no_bodies(),
        sum(map(len, data.groups[: group.number])), data.moment, data.key, salt_of("rays of lidar"),
        stream_number(Stream.SENSOR, group.number),
    ))  # fmt: skip
