"""Arenas of a user's own whose wall or placement leaks are named while the world runs."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from teamsight import Robot, World
from teamsight.core.kernel import kernel
from teamsight.policies import RandomWalk
from teamsight.world.arena import Arena


@kernel
def _no_wall(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    return x + step_x, y + step_y, heading_x, heading_y


@kernel
def _no_number(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    if x + step_x > 0.5 * size[0]:
        return np.nan, y, heading_x, heading_y
    return min(max(x + step_x, -size[0]), size[0]), min(max(y + step_y, -size[1]), size[1]), heading_x, heading_y


class Room(Arena):
    """A square of side 2 around the origin."""

    confine = _no_wall
    reach = 1.0

    @property
    def size(self) -> tuple[float, float]:
        return 1.0, 1.0

    @property
    def area(self) -> float:
        return 4.0

    @property
    def bounds(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        return np.full(2, -1.0), np.full(2, 1.0)

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        return np.asarray(np.all(np.abs(np.asarray(position, float)) <= self.reach, axis=-1))

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> npt.NDArray[np.float64]:
        share = np.stack([np.asarray(u, float), np.asarray(v, float)], axis=-1)
        return (2.0 * share - 1.0) * (1.0 - margin)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"


class Nowhere(Room):
    """Its wall leads to what is no number."""

    confine = _no_number


@kernel
def _square(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    return min(max(x + step_x, -1.0), 1.0), min(max(y + step_y, -1.0), 1.0), heading_x, heading_y


class Cross(Room):
    """Its corners are outside, but neither its wall nor its bounds say so."""

    confine = _square

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        return super().contains(position) & (np.abs(np.asarray(position, float)).sum(axis=-1) <= 0.3)


class Scattered(Room):
    """Places robots outside."""

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> npt.NDArray[np.float64]:
        return super().place(u, v, margin) * 3.0


def advance(world: World, path: str) -> None:
    world.run(300) if path == "run" else [world.step() for _ in range(300)]


@pytest.mark.short
@pytest.mark.parametrize("path", ["run", "step"])
@pytest.mark.parametrize("arena", [Room(), Nowhere()], ids=repr)
def test_a_wall_that_leaks_is_named_and_nobody_is_left_outside(arena: Arena, path: str) -> None:
    world = World(arena, rng=1)
    robots = world.add(Robot, 6, policy=RandomWalk(0.05), speed=0.05, placement=np.zeros((6, 2)))
    for _ in range(3):
        with pytest.raises(ValueError, match=re.escape(repr(arena)) + r": confine left an agent of robots outside at tick \d+; .*check_arena\(\)"):
            advance(world, path)
        assert 5 < world.tick < 300
        assert len(world.recording.history) == world.tick == world.steps
        assert arena.contains(robots.position).all()
    other = World(arena, rng=1)
    others = other.add(Robot, 6, policy=RandomWalk(0.05), speed=0.05, placement=np.zeros((6, 2)))
    other.run(world.tick)
    assert np.array_equal(robots.position, others.position)
    assert np.array_equal(robots.heading, others.heading)
    assert np.array_equal(robots.bodies.moved, others.bodies.moved)
    world.reset()
    world.run(2)
    assert world.tick == 2


@pytest.mark.parametrize("path", ["run", "step"])
def test_a_wall_that_leaks_within_the_box_is_named_after_the_call(path: str) -> None:
    world = World(Cross(), rng=1)
    world.add(Robot, 6, policy="random-walk", speed=0.05, placement=np.zeros((6, 2)))
    for _ in range(3):
        with pytest.raises(ValueError, match=r"Cross\(\): an agent of robots is at \(.*outside according to contains\(\).*check_arena"):
            advance(world, path)
        assert world.tick == world.steps == len(world.recording.history) > 0


def test_a_placement_that_leaks_is_named_when_the_group_is_added() -> None:
    world = World(Scattered(), rng=1)
    with pytest.raises(ValueError, match=r"Scattered\(\).*place\(\).*check_arena"):
        world.add(Robot, 20, policy="random-walk", speed=0.05)
    assert world.groups == ()
