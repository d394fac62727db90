"""Lidar: readings are what a direct computation says, in all arenas and on every path, and closed forms hold."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from arenas import Cylinder
from chance import fresh_seed
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import lidar as naive

from teamsight import CMOMMT, Box, Circle, Disc, Failures, Lidar, Polygon, Robot, Target, Torus, World, check_policy
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.core.angles import direction_after
from teamsight.core.kernel import inlined, plain
from teamsight.policies import Action, CompiledPolicy, Policy
from teamsight.world.walls import ROUNDING, Walls

_STAR = [(0, -2), (0.5, -0.5), (2, 0), (0.5, 0.5), (0, 2), (-0.5, 0.5), (-2, 0), (-0.5, -0.5)]
_OBSTACLES = Circle((0.7, 0.2), 0.4), Polygon([(-1.5, -1), (-0.5, -1), (-1, 0)]), Polygon([(-1, 1), (1, 1), (0, 1.2)])


@dataclass(frozen=True)
class Pipe(Cylinder):
    """An arena of a user's, which repeats along x and says where its walls are."""

    @property
    def walls(self) -> Walls:
        x, y = self.around / 2, self.height / 2
        return Walls(np.array([(-x, -y, x, -y), (x, y, -x, y)]), np.empty((0, 3)))


ARENAS = [
    Disc(2.0), Box(4.0, 3.0), Torus(4.0, 5.0), Polygon(_STAR), Polygon([(0, 0), (3, 0), (0, 2)]),
    Box(4.0, 4.0).with_obstacles(*_OBSTACLES), Disc(2.2).with_obstacles(*_OBSTACLES),
    Pipe(4.0, 1.5), Torus(4.0, 5.0).with_obstacles(*_OBSTACLES, Circle((1.9, -2.4), 0.5), Polygon([(1.5, 1), (2.6, 1.2), (2, 2.8)])),
]  # fmt: skip


def _expected(world: World) -> np.ndarray[Any, Any]:
    """Return the readings of all robots by the slow twin."""
    robots, arena = world.groups[0], world.arena
    lidar, sides = robots.lidar, (np.array(arena.bounds), *arena.walls)
    assert lidar is not None
    # Images of walls reach to half a period beyond the arena, and more.
    slack = 10 * ROUNDING * max(float(np.abs(part).max(initial=0.0)) for part in sides)
    bodies = [
        (tuple(place), float(radius), number)
        for group in world.groups
        for place, radius, number, active in zip(
            group.position.tolist(), group.radius, group.identity.tolist(), group.active, strict=True
        )
        if active
    ]
    readings = np.full((len(robots), lidar.rays), lidar.range)
    turned = [plain(direction_after)(turn) for turn in lidar.turns.tolist()]
    for i, agent in enumerate(robots):
        if not agent.active:
            continue
        others = [body for body in bodies if body[2] != agent.unique_id]
        ahead = robots.heading[i].tolist()
        scale = 1.0 / math.sqrt(ahead[0] * ahead[0] + ahead[1] * ahead[1])
        ahead = [ahead[0] * scale, ahead[1] * scale]
        for j, (x, y) in enumerate(turned):
            way = (x * ahead[0] - y * ahead[1], y * ahead[0] + x * ahead[1])
            readings[i, j] = naive.reading(
                tuple(robots.position[i].tolist()), way, lidar.range, arena, others, slack
            )
    return readings


def _world(arena: Any, lidar: Lidar, size: int, rng: np.random.Generator, *, whole: bool = False) -> World:
    """Return a world of robots with a lidar among bodies that may overlap."""
    world = World(arena, rng=int(rng.integers(2**32)))
    position = arena.place(*rng.random((2, size)))
    if whole:
        # On the lines of walls and cells, and at the same places.
        rounded = np.rint(position * 2) / 2
        position = np.where(arena.contains(rounded)[:, None], rounded, position)
    heading = rng.integers(-2, 3, (size, 2)) + 1e-3 if whole else rng.normal(size=(size, 2))
    radius = rng.choice([0.0, 0.02, 0.2, 0.6], size)
    robots = world.add(
        Robot, size, policy="random-walk", position=position, heading=heading, lidar=lidar, radius=radius, speed=0.3
    )
    world.senses(robots, world.add(Target, 6, policy="random-walk", radius=[0.0, 0.0, 0.1, 0.1, 0.3, 0.3]))
    return world


@given(
    seed=st.integers(0, 2**32), arena=st.sampled_from(ARENAS), size=st.sampled_from([1, 3, 12]),
    rays=st.sampled_from([1, 2, 3, 8, 32, 61]), reach=st.sampled_from([0.3, 1.0, 2.0, 6.0]),
    view=st.sampled_from([math.tau, 6.2, 3.0, 0.5, 1e-6]), whole=st.booleans(),
)  # fmt: skip
def test_readings_are_what_the_slow_twin_says(
    seed: int, arena: Any, size: int, rays: int, reach: float, view: float, whole: bool
) -> None:
    assume(reach <= 2.0 or not any(arena.period))
    world = _world(arena, Lidar(rays, reach, view), size, np.random.default_rng(seed), whole=whole)
    for _ in range(3):
        np.testing.assert_array_equal(world.groups[0].percept.lidar, _expected(world))
        world.run(2)


def _robot(arena: Any, lidar: Lidar, position: Any, heading: Any = (1.0, 0.0), **options: Any) -> World:
    """Return a world with a single robot that stays."""
    world = World(arena, rng=1)
    world.add(Robot, 1, policy="stationary", position=[position], heading=heading, lidar=lidar, **options)
    return world


def _read(world: World) -> Any:
    return world.groups[0].percept.lidar[0]


@pytest.mark.parametrize("rays", [1, 2, 7, 64])
def test_in_the_centre_of_a_disc_all_rays_read_its_radius(rays: int) -> None:
    world = _robot(Disc(2.3), Lidar(rays, 5.0), (0, 0), (0.3, -0.8))
    assert _read(world) == pytest.approx(np.full(rays, 2.3), rel=1e-15)


def test_off_the_centre_of_a_disc_it_is_the_chord() -> None:
    lidar = Lidar(16, 5.0)
    angle = lidar.bearings
    # By the law of cosines, seen from (1.2, 0) in a disc of radius 2.
    expected = -1.2 * np.cos(angle) + np.sqrt(4 - (1.2 * np.sin(angle)) ** 2)
    assert _read(_robot(Disc(2.0), lidar, (1.2, 0))) == pytest.approx(expected, rel=1e-14)


def test_in_a_box_it_is_the_nearest_of_four_sides() -> None:
    lidar, (x, y) = Lidar(36, 9.0), (0.7, -0.4)
    cosine, sine = np.cos(lidar.bearings), np.sin(lidar.bearings)
    with np.errstate(divide="ignore"):
        sides = [(2 - x) / cosine, (-2 - x) / cosine, (1.5 - y) / sine, (-1.5 - y) / sine]
    expected = np.min([np.where(side > 0, side, np.inf) for side in sides], axis=0)
    assert _read(_robot(Box(4, 3), lidar, (x, y))) == pytest.approx(expected, rel=1e-14)


def test_nothing_within_the_range_reads_the_range() -> None:
    assert (_read(_robot(Box(4, 3), Lidar(9, 1.49), (0, 0))) == 1.49).all()
    assert (_read(_robot(Torus(4, 3), Lidar(9, 1.5), (0, 0))) == 1.5).all()


@pytest.mark.parametrize(("rays", "view", "degrees"), [
    (1, math.tau, [0]), (1, 1.0, [0]), (4, math.tau, [-180, -90, 0, 90]), (3, math.pi, [-90, 0, 90]),
    (2, math.radians(60), [-30, 30]), (5, math.tau, [-180, -108, -36, 36, 108]),
])  # fmt: skip
def test_rays_go_from_right_to_left(rays: int, view: float, degrees: list[float]) -> None:
    lidar = Lidar(rays, 2.0, view)
    assert np.degrees(lidar.bearings) == pytest.approx(degrees, abs=1e-12)
    # A disc at each of these angles is met by this ray alone, and by the opposite one of a hollow arena.
    for ray, angle in enumerate(lidar.bearings + 0.5):
        world = _robot(Torus(9, 9), lidar, (0, 0), (math.cos(0.5), math.sin(0.5)))
        world.add(Target, 1, policy="stationary", position=(math.cos(angle), math.sin(angle)), radius=0.25)
        expected = np.where(np.arange(rays) == ray, 0.75, 2.0)
        assert _read(world) == pytest.approx(expected, rel=1e-14)


def test_bodies_block_and_points_do_not() -> None:
    world = _robot(Box(9, 9), Lidar(4, 4.0), (0, 0), radius=0.3)
    one, _ = world.add(Target, 2, policy="stationary", position=[(2, 0), (0, 2)], radius=[0.5, 0.0])
    assert _read(world).tolist() == [4.0, 4.0, 1.5, 4.0]
    one.position = (0, -1)
    assert _read(world).tolist() == [4.0, 0.5, 4.0, 4.0]
    one.active = False
    assert _read(world).tolist() == [4.0, 4.0, 4.0, 4.0]


def test_a_robot_inside_of_a_body_reads_0_and_an_inactive_one_the_range() -> None:
    world = _robot(Box(9, 9), Lidar(4, 4.0), (0, 0))
    world.add(Target, 1, policy="stationary", position=(0.1, 0), radius=0.5)
    assert _read(world).tolist() == [0.0] * 4
    world.groups[0][0].active = False
    assert _read(world).tolist() == [4.0] * 4


def test_rays_wrap_on_a_torus_and_meet_images() -> None:
    world = _robot(Torus(6, 8), Lidar(4, 3.0), (2.5, -3.5))
    world.add(Target, 2, policy="stationary", position=[(-2.0, -3.5), (2.5, 2.9)], radius=0.5)
    assert _read(world) == pytest.approx([3.0, 1.1, 1.0, 3.0], rel=1e-14)


@pytest.mark.parametrize("gap", [1e-9, 1e-6, 1e-3, 0.03])
def test_a_body_that_nearly_touches_takes_up_half_the_view(gap: float) -> None:
    world = _robot(Torus(20, 20), Lidar(720, 4.0), (0, 0))
    world.add(Target, 1, policy="stationary", position=(1 + gap, 0), radius=1.0)
    readings = _read(world)
    np.testing.assert_array_equal(readings, _expected(world)[0])
    seen = np.abs(world.groups[0].lidar.bearings) < math.asin(1 / (1 + gap)) - 1e-6
    assert ((readings < 4.0) == seen).all()


@given(seed=st.integers(0, 2**32), share=st.floats(0.99, 1.01))
def test_things_at_the_end_of_the_range(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    heading = rng.normal(size=2)
    heading /= np.hypot(*heading)
    for arena in (Disc(2.0), Box(4.0, 4.0), Torus(9.0, 9.0).with_obstacles(Circle((3.0, 0.0), 1.0))):
        # From the middle the nearest wall is 2 away.
        way = heading if isinstance(arena, Disc) else (1.0, 0.0)
        world = _robot(arena, Lidar(3, 2.0 * share, 0.01), (0, 0), way)
        np.testing.assert_array_equal(_read(world), _expected(world)[0])
        assert (_read(world)[1] < 2.0 * share) == (2.0 * share > 2.0)
    world = _robot(Disc(3.0), Lidar(3, 2.0 * share, 0.01), heading, heading)
    np.testing.assert_array_equal(_read(world), _expected(world)[0])
    assert (_read(world)[1] < 2.0 * share) == (share > 1.0 + 1e-12)
    world = _robot(Torus(9.0, 9.0), Lidar(3, 2.0 * share, 0.01), (0, 0), heading)
    world.add(Target, 1, policy="stationary", position=2.5 * heading, radius=0.5)
    np.testing.assert_array_equal(_read(world), _expected(world)[0])


@given(
    seed=st.integers(0, 2**32),
    arena=st.sampled_from([one for one in ARENAS if not any(one.period)]),
)  # fmt: skip
def test_on_a_wall_no_ray_leaves_the_arena(seed: int, arena: Any) -> None:
    rng = np.random.default_rng(seed)
    low, high = arena.bounds
    points = low + (high - low) * rng.random((40, 2)) * 2 - 0.5 * (high - low)
    if arena.walls.segments.size:
        points = np.concatenate([points, arena.walls.segments[:, :2]])
    position = arena.inside(points)
    position = position[arena.contains(position)]
    lidar = Lidar(24, 50.0)
    world = World(arena, rng=1)
    robots = world.add(Robot, len(position), policy="stationary", position=position, lidar=lidar)
    readings = robots.percept.lidar
    np.testing.assert_array_equal(readings, _expected(world))
    # All arenas are smaller than the range.
    assert readings.max() < 8.0
    # On a wall half of what is around is free, and at the corner of an obstacle more.
    assert (readings.max(axis=1) > 0.01).all()
    angle = np.arctan2(*robots.heading.T[::-1])[:, None] + lidar.bearings
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    is_free = arena.contains(position[:, None] + 1e-5 * way)
    # Rays along a wall are a matter of rounding.
    assert ((readings > 1e-6) != is_free).sum() <= 4


_WAY = math.cos(math.pi / 8), math.sin(math.pi / 8)


def test_at_the_corner_of_an_obstacle_rays_end_that_lead_into_it() -> None:
    block = Polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    world = World(Box(9.0, 7.0).with_obstacles(block), rng=1)
    lidar = Lidar(8, 2.0)
    for place, inner in (((0, 0), 45), ((1, 0), 135), ((1, 1), -135), ((0, 1), -45)):
        robots = world.add(Robot, 1, policy="stationary", position=place, heading=_WAY, lidar=lidar)
        angles = (22.5 + np.degrees(lidar.bearings) - inner + 180) % 360 - 180
        assert list(robots.percept.lidar[0]) == [0.0 if abs(angle) < 45 else 2.0 for angle in angles]


@given(seed=st.integers(0, 2**32), arena=st.sampled_from(ARENAS))
def test_a_reading_is_where_the_free_area_ends(seed: int, arena: Any) -> None:
    lidar = Lidar(24, 2.0)
    position = arena.place(*np.random.default_rng(seed).random((2, 10)))
    robots = World(arena, rng=1).add(Robot, 10, policy="stationary", position=position, lidar=lidar)
    angle = np.arctan2(*robots.heading.T[::-1])[:, None] + lidar.bearings
    readings = robots.percept.lidar
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def is_free(share: float, more: float = 0.0) -> Any:
        ends = position[:, None] + (share * readings + more)[:, :, None] * way
        return arena.contains(arena.displacement(np.zeros(2), ends))

    # A ray that only touches a corner is a matter of rounding.
    assert all((~is_free(share)).sum() <= 2 for share in (0.1, 0.5, 0.9, 1 - 1e-9))
    ends = readings < lidar.range
    assert is_free(1.0, 1e-7)[ends].sum() <= 2
    assert ends.any() == (arena != Torus(4.0, 5.0))


_PILLARS = [Circle((x - 4.5, y - 3.5), 0.1) for x in range(10) for y in range(8)]


@pytest.mark.parametrize(("arena", "reach"), [
    (Torus(30.0, 20.0), 1.5), (Torus(3.0, 40.0), 1.5), (Box(12.0, 8.0), 1.5), (Box(12.0, 8.0), 20.0),
    (Box(12.0, 8.0).with_obstacles(*_PILLARS), 20.0),
], ids=str)  # fmt: skip
def test_many_bodies_and_obstacles(arena: Any, reach: float) -> None:
    # More than are compared one by one, and than are processed at once.
    world = _world(arena, Lidar(16, reach), 90, np.random.default_rng(fresh_seed()))
    np.testing.assert_array_equal(world.groups[0].percept.lidar, _expected(world))
    assert (world.groups[0].percept.lidar < reach).any()


def test_noise_depends_on_the_robot_the_ray_and_the_tick_alone() -> None:
    lidar = Lidar(8, 3.0, range_noise=0.05)

    def readings(one: Lidar, *, others: int = 0, ticks: int = 0) -> Any:
        world = World(Disc(2.0), rng=7)
        robots = world.add(Robot, 400 + others, policy="stationary", position=(0, 0), heading=(1, 0), lidar=one)
        world.run(ticks, progress=False)
        return robots.percept.lidar

    noise = readings(lidar) - 2.0
    assert abs(noise.mean()) < 5 * 0.05 / math.sqrt(noise.size)
    assert noise.std() == pytest.approx(0.05, rel=5 / math.sqrt(2 * noise.size))
    assert len(np.unique(noise)) == noise.size
    np.testing.assert_array_equal(readings(lidar, others=3)[:400], noise + 2.0)
    assert not np.array_equal(readings(lidar, ticks=1), noise + 2.0)
    # Readings saturate, and a ray that meets nothing has no noise.
    assert (readings(replace(lidar, range=1.5)) == 1.5).all()
    loud = readings(replace(lidar, range_noise=5.0))
    assert (loud.min(), loud.max()) == (0.0, 3.0)


@inlined
def _go_free(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        best = 0
        for j in range(percept.lidar.shape[1]):
            if percept.lidar[i, j] > percept.lidar[i, best]:
                best = j
        x, y = arrays.table[best, 0], arrays.table[best, 1]
        ahead_x, ahead_y = percept.heading[i, 0], percept.heading[i, 1]
        aim_x, aim_y = x * ahead_x - y * ahead_y, y * ahead_x + x * ahead_y
        length = math.sqrt(aim_x * aim_x + aim_y * aim_y)
        action.heading[i, 0] = aim_x / length
        action.heading[i, 1] = aim_y / length
        action.distance[i] = min(percept.speed[i], 0.5 * percept.lidar[i, best])


@dataclass(frozen=True)
class GoFree(CompiledPolicy):
    """Go where most is free."""

    lidar: Lidar
    kernel = _go_free

    @property
    def rays(self) -> int:  # type: ignore[override]
        return self.lidar.rays

    @property
    def table(self) -> Any:
        return np.stack([np.cos(self.lidar.bearings), np.sin(self.lidar.bearings)], axis=1).astype(np.float32)

    @property
    def parameters(self) -> tuple[float, ...]:
        return ()


class GoFreeSlowly(Policy):
    """The same in NumPy."""

    def __init__(self, lidar: Lidar) -> None:
        self.rays, self._table = lidar.rays, GoFree(lidar).table

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        best = np.argmax(percept.lidar, axis=1)
        x, y = self._table[best].astype(float).T
        ahead = percept.heading
        aim = np.stack([x * ahead[:, 0] - y * ahead[:, 1], y * ahead[:, 0] + x * ahead[:, 1]], axis=1)
        length = np.sqrt(aim[:, 0] * aim[:, 0] + aim[:, 1] * aim[:, 1])[:, None]
        reading = percept.lidar[np.arange(len(best)), best]
        return Action(aim / length, np.minimum(percept.speed, 0.5 * reading)), state


_LIDAR = Lidar(16, 2.0, 3.0, range_noise=0.02)


def _free(policy: Any, seed: int = 3, **options: Any) -> World:
    world = World(ARENAS[5], contact="slide", rng=seed)
    robots = world.add(Robot, 9, policy=policy, radius=0.08, lidar=_LIDAR, **options)
    world.senses(robots, world.add(Target, 4, policy="random-walk", radius=0.1))
    world.attach(Failures(12, 5), robots)
    return world


def test_kernels_and_numpy_read_the_same_on_every_path() -> None:
    check_policy(GoFree(_LIDAR))
    check_policy(GoFreeSlowly(_LIDAR))
    worlds = [_free(GoFree(_LIDAR)) for _ in range(4)] + [_free(GoFreeSlowly(_LIDAR))]
    for world in (worlds[0], worlds[4]):
        world.run(40)
    for _ in range(40):
        worlds[1].step()
    worlds[2].run(13)
    saved = worlds[2].state()
    worlds[2].run(30)
    worlds[2].restore(saved)
    worlds[2].run(27)
    worlds[3].run(5)
    worlds[3].reset()
    worlds[3].run(40)
    for world in worlds[1:]:
        for group, other in zip(world.groups, worlds[0].groups, strict=True):
            assert group.position.tobytes() == other.position.tobytes()
        assert world.groups[0].percept.lidar.tobytes() == worlds[0].groups[0].percept.lidar.tobytes()
    assert len(np.unique(worlds[0].groups[0].percept.lidar)) > 30


def test_reused_worlds_are_as_new_ones() -> None:
    given = {"robots": 5, "targets": 4, "robot_radius": 0.2, "target_radius": 0.1, "lidar": Lidar(9, 3.0)}
    worlds = ReusedWorlds()
    built = set()
    for radius, seed in ((2.0, 1), (2.0, 2), (3.0, 2), (1.5, 3)):
        world, new = (begin({**given, "radius": radius}, seed) for begin in (
            lambda options, rng: worlds.begin(CMOMMT, options, rng), lambda options, rng: CMOMMT(**options, rng=rng)
        ))  # fmt: skip
        for one in (world, new):
            assert isinstance(one, CMOMMT)
            one.run(7)
        built.add(id(world))
        assert world.groups[0].percept.lidar.tobytes() == new.groups[0].percept.lidar.tobytes()
        np.testing.assert_array_equal(new.groups[0].percept.lidar, _expected(new))
    assert len(built) == 1


def test_robots_that_come_and_leave_have_a_lidar() -> None:
    world = World(ARENAS[5], contact="slide", rng=2)
    robots = world.add(Robot, 9, policy="random-walk", radius=0.08, lidar=Lidar(16, 2.0))
    world.senses(robots, world.add(Target, 4, policy="random-walk"))
    world.run(3)
    robots.add(30, radius=0.02)
    robots[1].remove()
    world.groups[1].add(2, radius=0.1)
    for _ in range(3):
        np.testing.assert_array_equal(robots.percept.lidar, _expected(world))
        world.run(2)


def test_functions_for_one_robot_and_robots_of_ones_own_class_read_it() -> None:
    seen: list[Any] = []

    def rule(percept: Any, rng: Any) -> tuple[float, float]:
        seen.append(percept.lidar)
        return 0.0, 0.0

    check_policy(rule)
    seen.clear()
    world = _robot(Disc(2.0), Lidar(4, 5.0), (0, 0))
    world.groups[0].policy = rule
    world.run(1)
    assert seen[0] == pytest.approx([2.0] * 4)
    robot = world.groups[0][0]
    assert robot.percept.lidar == pytest.approx([2.0] * 4)
    assert "lidar" in robot.percept._repr_html_()
    assert robot.decide(robot.percept._replace(lidar=np.zeros(4)), np.random.default_rng()) == (0.0, 0.0)


def test_a_group_without_one_has_no_rays() -> None:
    world = World(Disc(2.0), rng=1)
    robots = world.add(Robot, 3, policy="random-walk")
    assert robots.lidar is None
    assert robots.percept.lidar.shape == (3, 0)
    assert robots[0].percept.lidar.shape == (0,)


@pytest.mark.parametrize(("given", "words"), [
    ({"rays": 0}, ["rays=0", "at least 1"]), ({"rays": 10_001}, ["10001", "10000"]), ({"rays": 2.5}, ["2.5"]),
    ({"range": -1.0}, ["range=-1", "above 0"]), ({"range": math.inf}, ["range", "inf"]),
    ({"field_of_view": 0}, ["field_of_view=0.0", "above 0", "rays=1"]),
    ({"field_of_view": -1}, ["field_of_view=-1.0", "above 0", "at most 2π", "rays=1"]),
    ({"field_of_view": 90}, ["field_of_view=90", "2π", "math.radians(90)"]),
    ({"range_noise": -0.1}, ["range_noise=-0.1", "at least 0"]),
])  # fmt: skip
def test_options_outside_their_limits(given: dict[str, Any], words: list[str]) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        Lidar(**given)
    assert all(word in str(error.value) for word in words), error.value


@pytest.mark.parametrize(("arena", "lidar", "words"), [
    (Torus(4, 6), Lidar(8, 2.5), ["range=2.5", "half", "2"]), (Disc(2), Lidar, ["class", "object"]),
    (Disc(2), 32, ["32", "Lidar"]), (Disc(2), Lidar(8, 2e9), ["2e+09", "1e+09"]),
    (Cylinder(4, 4), Lidar(8, 1.0), ["Cylinder", "walls"]),
])  # fmt: skip
def test_groups_refuse_what_does_not_fit(arena: Any, lidar: Any, words: list[str]) -> None:
    world = World(arena, rng=1)
    with pytest.raises((TypeError, ValueError)) as error:
        world.add(Robot, 3, policy="random-walk", lidar=lidar)
    assert all(word in str(error.value) for word in words), error.value
    assert not world.groups


def test_what_cannot_be_changed_or_does_not_fit_is_refused() -> None:
    world = _free("random-walk")
    with pytest.raises(AttributeError, match="world.add"):
        world.groups[0].lidar = Lidar(4)
    with pytest.raises(ValueError, match="reads 8 rays.* a lidar with 16; .*rays=8"):
        world.groups[0].policy = GoFree(Lidar(8))
    with pytest.raises(ValueError, match="reads 16 rays.* no lidar; .*rays=16"):
        World(Disc(2.0)).add(Robot, 2, policy=GoFree(_LIDAR))
    robot = _robot(Disc(2.0), Lidar(4, 5.0), (0, 0))
    with pytest.raises(ValueError, match=r"lidar=Lidar\(rays=4.*rays=5"):
        _robot(Disc(2.0), Lidar(5, 5.0), (0, 0)).restore(robot.state())
    with pytest.raises(ValueError, match=r"percept.lidar: has the shape \(2, 2\); it must be \(rays,\)"):
        one = robot.groups[0][0]
        one.group.policy = GoFree(Lidar(4))
        one.decide(one.percept._replace(lidar=np.zeros((2, 2))), np.random.default_rng())
