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
from teamsight.core.angles import ANGLE_MARGIN, direction_after, near_angle
from teamsight.core.component import Allowed, Component, NonNegative, Positive
from teamsight.core.kernel import Entry, Packed, Record, inlined, kernel, plain, scratch
from teamsight.core.table import Field
from teamsight.world.arena import states_walls
from teamsight.world.noise import Stream, philox, stream_number
from teamsight.world.occlusion import BODIES_AT_ONCE, Opaque, lines_of, no_bodies
from teamsight.world.walls import ROUNDING, Walls, is_behind, joined, repeated

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
# In place of the index of the own body.
_NOBODY, _WALLS = -1, -2


class Round(NamedTuple):
    """Round things.

    Attributes
    ----------
    x, y, radius : ndarray, shape (k,), float64
        Their centres and radii [length].
    """

    x: Annotated[Floats, ".things"]
    y: Annotated[Floats, ".things"]
    radius: Annotated[Floats, ".things"]


class LidarArrays(NamedTuple):
    """The record of the lidar of n robots.

    Attributes
    ----------
    position, heading, active, member
        As in `BODIES`.
    readings : ndarray, shape (n, rays), float64
        What is written: distances [length].
    turned : ndarray, shape (2, rays), float64
        Cosine and sine of the angle of each ray from the heading.
    way : ndarray, shape (2, rays), float64
        Room for the directions of the rays of a robot: unit vectors.
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
    round : Round
        The discs that are seen from outside.
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
    turned: Annotated[Floats, 2, "rays"]
    way: Annotated[Floats, 2, "rays"]
    first: float
    per_radian: float
    turn: float
    range: float
    range_noise: float
    segments: Annotated[Floats, ".segments", 4]
    discs: Annotated[Floats, ".discs", 3]
    slack: float
    round: Round
    opaque: Opaque
    own: int
    tick: Annotated[Integers, 1]
    key: Annotated[npt.NDArray[np.uint64], 2]
    salt: Annotated[npt.NDArray[np.uint64], 2]
    stream: int


LIDAR = Record(LidarArrays)
lidar_at = LIDAR.at


@kernel
def _meet_round(
    here: Any, i: int, things: Any, span: tuple[int, int], from_x: float, from_y: float, own: int
) -> None:
    """Let the rays of robot `i`, from (from_x, from_y), end at round things, but for that of index `own`.

    `span` is the first and their number, a multiple of `BODIES_AT_ONCE` of at most `CHUNK`; if `own` is `_WALLS`, they
    are obstacles. Which rays may meet each is computed from near angles, in SIMD lanes; whether they do, exactly.
    """
    first, count = span
    are_walls = own == _WALLS
    # The angle at which each is seen, from the first ray on, and at least half the angle that it takes up [rays].
    middle = scratch(CHUNK, np.float64)
    half = scratch(CHUNK, np.float64)
    ahead_x = here.heading[i, 0]
    ahead_y = here.heading[i, 1]
    last = here.way.shape[1] - 1.0
    # The number as the compiler needs it, which then leaves no lanes over.
    lanes = np.uint64(count // BODIES_AT_ONCE) * np.uint64(BODIES_AT_ONCE)
    for k in range(lanes):
        at = np.uint64(first) + k
        x = things.x[at] - from_x
        y = things.y[at] - from_y
        radius = things.radius[at]
        reach = here.range + radius
        gap = x * x + y * y - radius * radius
        bearing = near_angle(y * ahead_x - x * ahead_y, x * ahead_x + y * ahead_y) - here.first
        bearing = bearing if bearing >= 0.0 else bearing + FULL_TURN
        # The tangent of half the angle, which is larger than that.
        wide = radius / math.sqrt(gap if gap > 1e-300 else 1e-300)
        wide = ((wide if wide < 0.5 * math.pi else 0.5 * math.pi) + ANGLE_MARGIN) * here.per_radian
        centre = bearing * here.per_radian
        middle[k] = centre
        # Whether there is a ray within it, or within that of the next turn. Things of radius 0 are points.
        is_between = (abs(centre - np.rint(centre)) <= wide) & (centre - wide <= last)
        is_seen = is_between | (centre + wide >= here.turn) | (gap <= 0.0)
        is_near = (radius > 0.0) & (gap + radius * radius <= reach * reach * _BEYOND) & (np.int64(at) != own)
        half[k] = wide if is_seen & is_near else -1.0
    for k in range(lanes):
        if half[k] >= 0.0:
            at = np.uint64(first) + k
            x = things.x[at] - from_x
            y = things.y[at] - from_y
            _meet_disc(here, i, x, y, things.radius[at], middle[k], half[k], are_walls)


@kernel
def _meet_disc(
    here: Any, i: int, x: float, y: float, radius: float, middle: float, half: float, is_wall: bool
) -> None:
    """Let the rays of robot `i` end at a disc, whose centre is at (x, y) from it, if they are within this angle."""
    row = here.readings[i]
    way = here.way
    gap = x * x + y * y - radius * radius
    if gap <= 0.0:
        # Inside of an obstacle is only what rounding has put there, which is on its wall.
        for j in range(row.shape[0]):
            row[j] = row[j] if is_wall and x * way[0, j] + y * way[1, j] <= 0.0 else 0.0
        return
    last = way.shape[1] - 1.0
    # Usually in this turn only: those within the next have numbers that are a turn smaller, and so on.
    for turn in range(-1 if middle + half >= here.turn else 0, 2 if middle - half + here.turn <= last else 1):
        low = min(max(middle - half + turn * here.turn, 0.0), last + 1.0)
        high = min(middle + half + turn * here.turn, last)
        first = int(low)
        for j in range(first + (first < low), int(high) + 1 if high >= low else 0):
            along = x * way[0, j] + y * way[1, j]
            across = x * way[1, j] - y * way[0, j]
            depth = radius * radius - across * across
            if along > 0.0 and depth >= 0.0:
                row[j] = min(row[j], gap / (along + math.sqrt(depth)))


@kernel
def _meet_hollow_disc(here: Any, i: int, x: float, y: float, radius: float) -> None:
    """Let the rays of robot `i` end at the wall around a disc in which it is, whose centre is at (x, y) from it."""
    away_2 = x * x + y * y
    room = radius - here.range
    if room > 0.0 and away_2 * _BEYOND < room * room:
        return
    row = here.readings[i]
    way = here.way
    gap = max(radius * radius - away_2, 0.0)
    for j in range(np.uint64(row.shape[0])):
        along = x * way[0, j] + y * way[1, j]
        distance = along + math.sqrt(along * along + gap)
        row[j] = distance if distance < row[j] else row[j]


@kernel
def _meet_wall(here: Any, i: int, x_0: float, y_0: float, x_1: float, y_1: float) -> None:
    """Let the rays of robot `i` end at a wall, whose ends are seen from the robot.

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
    row = here.readings[i]
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


@inlined
def _filled_up(near: Any, count: int) -> int:
    """Fill whole lanes up with things of radius 0; return their number then."""
    while count % BODIES_AT_ONCE != 0:
        near.x[count] = 0.0
        near.y[count] = 0.0
        near.radius[count] = 0.0
        count += 1
    return count


@kernel
def _meet_bodies(here: Any, i: int, near: Any) -> None:
    """Let the rays of robot `i` end at the bodies of others; `near` is room for some."""
    opaque = here.opaque
    grid = opaque.grid
    across = int(grid[0])
    up = int(grid[1])
    x = here.position[i, 0]
    y = here.position[i, 1]
    reach = here.range + grid[6]
    count = 0
    first, last = lines_of(x - reach, x + reach, grid[2], grid[4], across, opaque.period[0])
    lowest, highest = lines_of(y - reach, y + reach, grid[3], grid[5], up, opaque.period[1])
    for column in range(first, last + 1):
        # Cells beyond the grid are images of others.
        from_x = x - (column // across) * opaque.period[0]
        for line in range(lowest, highest + 1):
            from_y = y - (line // up) * opaque.period[1]
            if across * up == 1:
                for k in range(0, opaque.x.shape[0], CHUNK):
                    span = k, min(opaque.x.shape[0] - k, CHUNK)
                    _meet_round(here, i, opaque, span, from_x, from_y, here.own + i)
                continue
            j = opaque.cells[(line % up) * across + column % across]
            while j >= 0:
                if j != here.own + i:
                    near.x[count] = opaque.x[j] - from_x
                    near.y[count] = opaque.y[j] - from_y
                    near.radius[count] = opaque.radius[j]
                    count += 1
                    if count == CHUNK:
                        _meet_round(here, i, near, (0, count), 0.0, 0.0, _NOBODY)
                        count = 0
                j = opaque.next_one[j]
    if count > 0:
        _meet_round(here, i, near, (0, _filled_up(near, count)), 0.0, 0.0, _NOBODY)


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


def _measure(address: int) -> int:
    """Write the readings of all robots of a group."""
    here: Any = lidar_at(address)
    turned, way = here.turned, here.way
    near = Round(scratch(CHUNK, np.float64), scratch(CHUNK, np.float64), scratch(CHUNK, np.float64))
    for i in range(here.position.shape[0]):
        row = here.readings[i]
        for j in range(row.shape[0]):
            row[j] = here.range
        if not here.active[i]:
            continue
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
        for k in range(here.discs.shape[0]):
            if here.discs[k, 2] < 0.0:
                _meet_hollow_disc(here, i, here.discs[k, 0] - x, here.discs[k, 1] - y, -here.discs[k, 2])
        for k in range(0, here.round.x.shape[0], CHUNK):
            _meet_round(here, i, here.round, (k, min(here.round.x.shape[0] - k, CHUNK)), x, y, _WALLS)
        for k in range(here.segments.shape[0]):
            _meet_wall(
                here, i, here.segments[k, 0] - x, here.segments[k, 1] - y, here.segments[k, 2] - x,
                here.segments[k, 3] - y,
            )  # fmt: skip
        if here.opaque.x.shape[0] > 0:
            _meet_bodies(here, i, near)
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


def _round(walls: Walls) -> Floats:
    """Return x, y and radius of the discs that are seen from outside, filled up for SIMD lanes, shape (3, k)."""
    discs = walls.discs[walls.discs[:, 2] > 0.0]
    found = np.zeros((3, -(-len(discs) // BODIES_AT_ONCE) * BODIES_AT_ONCE))
    found[:, : len(discs)] = discs.T
    return found


def bound_lidar(group: Group, data: WorldData, opaque: Opaque | None) -> Packed[LidarArrays]:
    """Return the argument of `MEASURE` for a group that has a lidar; `opaque` are the bodies, if some have a radius."""
    lidar, bodies, arena = group.lidar, group.bodies, data.arena
    assert lidar is not None
    walls = repeated(joined([arena.walls]), arena.period, arena.bounds)
    largest = max(float(np.abs(part).max(initial=0.0)) for part in (np.array(arena.bounds), *walls))
    spacing = max(lidar.spacing, _FINEST)
    turned = np.array([plain(direction_after)(turn) for turn in lidar.turns.tolist()]).T
    return LIDAR.pack(LidarArrays(
        bodies.position, bodies.heading, bodies.active, bodies.member, bodies.lidar,
        np.ascontiguousarray(turned), np.zeros((2, lidar.rays)), float(lidar.bearings[0]), 1.0 / spacing,
        FULL_TURN / spacing, float(lidar.range), float(lidar.range_noise), walls.segments, walls.discs,
        10.0 * ROUNDING * largest, Round(*_round(walls)), opaque or no_bodies(),
        sum(map(len, data.groups[: group.number])), data.moment, data.key, salt_of("rays of lidar"),
        stream_number(Stream.SENSOR, group.number),
    ))  # fmt: skip
