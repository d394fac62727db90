"""Obstacles that come and go in a run: both paths give one result, and no body is ever in one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Box, Circle, Disc, Failures, Polygon, Robot, Sensor, Target, Torus, World
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.world import Arena

FENCE = Polygon([(-1, 0.5), (1, 0.5), (1, 0.9), (-1, 0.9)])
PILLAR = Circle((1.5, -1.0), 0.4)


def world_in(arena: Arena, seed: int, *, contact: str = "pass", radius: float = 0.0) -> World:
    """Return a world whose bodies all start in the lower left quarter, away from `FENCE` and `PILLAR`."""
    world, places = World(arena, contact=contact, rng=seed), np.random.default_rng(seed)
    lower = np.stack([*map(np.ravel, np.meshgrid(np.linspace(-2.4, -0.4, 5), np.linspace(-2.0, -0.4, 4)))], axis=1)
    places.shuffle(lower)
    robots = world.add(
        Robot, 8, policy="a-cmommt", awareness="shared", speed=0.3, position=lower[:8], sensing_range=1.2, radius=radius
    )  # fmt: skip
    targets = world.add(Target, 8, policy="random-walk", speed=0.2, position=lower[8:16], radius=radius)
    world.senses(robots, targets, sensor=Sensor(range_noise=0.1))
    return world


def seen(world: World) -> list[Any]:
    arrays = [array for group in world.groups for array in (group.position, group.heading, *group.neighbours("targets"))]
    return [array.tobytes() for array in arrays] + [world.observed_fraction]


@pytest.mark.parametrize("contact", ["pass", "slide"])
@pytest.mark.parametrize("arena", [Disc(4.0), Box(6, 6), Torus(6, 6), Box(6, 6).with_obstacles(PILLAR)], ids=str)
def test_two_paths_one_result_and_nobody_is_inside(arena: Arena, contact: str) -> None:
    radius, seed = 0.0 if contact == "pass" else 0.1, int(np.random.default_rng().integers(2**31))
    one, other = (world_in(arena, seed, contact=contact, radius=radius) for _ in range(2))
    for world in (one, other):
        world.arena = world.arena.with_obstacles(FENCE)
    one.run(40)
    for _ in range(40):
        other.step()
    assert seen(one) == seen(other), seed
    for group in one.groups:
        assert one.arena.contains(group.position).all(), seed
    one.arena = other.arena = arena
    one.run(20)
    for _ in range(20):
        other.step()
    assert seen(one) == seen(other), seed


def test_they_block_motion_and_sight_from_the_next_step_on() -> None:
    world = World(Box(6, 6), rng=1)
    robots = world.add(Robot, 1, policy=lambda percept, rng: (0.0, 0.2), position=(0, 0), heading=(0, 1), speed=0.2, sensing_range=5)
    targets = world.add(Target, 1, policy="stationary", position=(0, 2))
    world.senses(robots, targets)
    world.step()
    assert robots[0].observed_targets == [targets[0]]
    world.arena = world.arena.with_obstacles(FENCE)
    assert robots[0].observed_targets == []
    world.run(10)
    # It is reflected at 0.5 and comes back.
    assert robots[0].position[1] < 0
    world.arena = Box(6, 6)
    assert robots[0].observed_targets == [targets[0]]


def test_it_is_the_world_that_was_built_with_them() -> None:
    arena = Box(6, 6).with_obstacles(FENCE, PILLAR)
    built, changed = world_in(arena, 3), world_in(Box(6, 6), 3)
    changed.arena = changed.arena.with_obstacles(FENCE)
    changed.arena = changed.arena.with_obstacles(PILLAR)
    built.run(60)
    changed.run(60)
    assert seen(built) == seen(changed)


def test_bodies_keep_out_and_other_arenas_are_refused() -> None:
    world = world_in(Box(6, 6), 1, contact="stop", radius=0.2)
    world.step()
    robot = world.groups[0][0]
    robot.position = (2.0, 2.0)
    before = seen(world)
    with pytest.raises(ValueError, match=r"Robot .* at \(2, 2\) would be in an obstacle; move it first.* or make the obstacle smaller"):
        world.arena = world.arena.with_obstacles(Circle((2.3, 2.0), 0.4))
    # Its centre is outside, but not its body.
    with pytest.raises(ValueError, match="would be in an obstacle"):
        world.arena = world.arena.with_obstacles(Circle((2.5, 2.0), 0.4))
    for wrong in (Box(7, 6), Disc(3.0), Box(6, 7).with_obstacles(FENCE), None, FENCE):
        with pytest.raises(ValueError, match=r"arena=.*only the obstacles in .* can be changed in a run"):
            world.arena = wrong  # type: ignore[assignment]
    assert world.arena == Box(6, 6)
    assert seen(world) == before
    world.arena = world.arena.with_obstacles(Circle((2.7, 2.0), 0.4))
    with pytest.raises(ValueError, match="position="):
        robot.position = (2.7, 2.0)


def test_a_reset_goes_back_and_a_state_needs_the_same_obstacles() -> None:
    # A robot begins where the obstacle comes, so a reset among it would place it inside.
    world = World(Box(6, 6), rng=1)
    world.add(Robot, 1, policy="random-walk", position=(0, 0), speed=0.2)
    world.run(10)
    first = world.groups[0].position.copy()
    world.groups[0][0].position = (2, 2)
    saved = world.state()
    world.arena = world.arena.with_obstacles(Circle((0, 0), 0.5))
    with pytest.raises(ValueError, match=r"set the obstacles of that time first, as in world\.arena"):
        world.restore(saved)
    world.reset()
    assert world.arena == Box(6, 6)
    assert world.groups[0].position.tolist() == [[0, 0]]
    world.run(10)
    assert (world.groups[0].position == first).all()
    world.restore(saved)
    assert world.groups[0].position.tolist() == [[2, 2]]


def test_worlds_are_not_reused_with_the_obstacles_of_a_run_before() -> None:
    worlds = ReusedWorlds()
    parameters = {"robots": 4, "targets": 4, "radius": 4.0}
    for radius in (4.0, 3.0):
        world = worlds.begin(CMOMMT, parameters | {"radius": radius}, 5)
        assert world.arena == Disc(radius)
        world.run(5)
        far = np.array([[radius - 0.05, 0.0]])
        if not (np.hypot(*(np.concatenate([group.position for group in world.groups]) - far).T) < 0.05).any():
            world.arena = world.arena.with_obstacles(Circle(far[0].tolist(), 0.02))
        worlds.rest()
    again = worlds.begin(CMOMMT, parameters, 5)
    again.run(5)
    fresh = CMOMMT(**parameters, rng=5)
    fresh.run(5)
    assert again.arena == Disc(4.0)
    assert seen(again) == seen(fresh)


def test_failures_and_pictures_go_on() -> None:
    model = CMOMMT(robots=5, targets=5, events=Failures(20, 5), rng=2)
    replay = model.record()
    model.run(30)
    places = np.concatenate([group.position for group in model.groups])
    x, y = next((x, y) for x in np.linspace(-3, 3, 20) for y in (0.0, 1.0) if np.hypot(*(places - (x, y)).T).min() > 0.2)
    model.arena = model.arena.with_obstacles(Circle((x, y), 0.1))
    model.run(30)
    assert len(replay.frames) == 61
    assert len(replay.scene.obstacles) == 1
