"""The space of a world, against mesa's own spaces with the same agents at the same places."""

from __future__ import annotations

import random
from typing import Any

import mesa
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mesa.experimental.continuous_space import ContinuousSpace

from teamsight import CMOMMT, Box, Disc, Robot, Target, Torus, World
from teamsight.world.arena import Arena

ARENAS = [Box(4.0, 3.0), Torus(4.0, 3.0)]


def world_in(arena: Arena, seed: int = 1, robots: int = 7) -> World:
    world = World(arena, rng=seed)
    world.add(Robot, robots, policy="stationary")
    world.add(Target, 5, policy="random-walk")
    return world


def newer(world: World) -> Any:
    """Return mesa's newer space with an agent at the place of each of the world's."""
    low, high = world.arena.bounds
    space = ContinuousSpace(np.stack([low, high], axis=1), torus=world.space.torus, random=random.Random(1))
    for row in range(len(world.space.active_agents)):
        space._add_agent(_Place(row))
    space.agent_positions[:] = world.space.agent_positions
    return space


class _Place:
    """An agent of mesa's spaces."""

    def __init__(self, row: int) -> None:
        self.row, self.pos = row, None


def older(world: World) -> Any:
    """Return mesa's older space with an agent at the place of each of the world's."""
    (x0, y0), (x1, y1) = world.arena.bounds
    space = mesa.space.ContinuousSpace(x1, y1, world.space.torus, x0, y0)
    for row, place in enumerate(world.space.agent_positions):
        space.place_agent(_Place(row), tuple(place))
    return space


def rows(world: World, agents: list[Any]) -> list[int]:
    return [world.space.active_agents.index(agent) for agent in agents]


@pytest.mark.parametrize("arena", ARENAS, ids=str)
@given(seed=st.integers(0, 1000), x=st.floats(-2.0, 2.0), y=st.floats(-1.5, 1.5), radius=st.floats(0.0, 5.0))
def test_distances_and_neighbours_are_those_of_mesa(arena: Arena, seed: int, x: float, y: float, radius: float) -> None:
    world, point = world_in(arena, seed), np.array([x, y])
    theirs = newer(world)
    far, among = world.space.calculate_distances(point)
    np.testing.assert_allclose(far, theirs.calculate_distances(point)[0], atol=1e-12)
    assert among == world.space.active_agents
    np.testing.assert_allclose(
        world.space.calculate_difference_vector(point), theirs.calculate_difference_vector(point), atol=1e-12
    )
    if np.abs(far - radius).min() > 1e-9:
        agents, distances = world.space.get_agents_in_radius(point, radius)
        found, lengths = theirs.get_agents_in_radius(point, radius)
        assert rows(world, agents) == [agent.row for agent in found]
        np.testing.assert_allclose(distances, lengths, atol=1e-12)
        for center in (True, False):
            found = older(world).get_neighbors(point, radius, center)
            assert rows(world, world.space.get_neighbors(point, radius, center)) == [agent.row for agent in found]
    agents, distances = world.space.get_k_nearest_agents(point, 4)
    found, _ = theirs.get_k_nearest_agents(point, 4)
    assert sorted(rows(world, agents)) == sorted(agent.row for agent in found)
    assert list(distances) == sorted(distances)


@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_the_box_and_ways_are_those_of_mesa(arena: Arena) -> None:
    space, theirs, before = world_in(arena).space, newer(world_in(arena)), older(world_in(arena))
    for name in ("x_min", "x_max", "y_min", "y_max", "width", "height", "torus"):
        assert getattr(space, name) == getattr(theirs, name) == getattr(before, name)
    for name in ("dimensions", "size", "center", "ndims"):
        np.testing.assert_array_equal(getattr(space, name), getattr(theirs, name))
    one, two = (-1.9, 1.4), (1.7, -1.0)
    assert space.get_distance(one, two) == pytest.approx(before.get_distance(one, two))
    assert space.get_heading(one, two) == pytest.approx(before.get_heading(one, two))
    assert isinstance(space.get_heading(np.array(one), two), np.ndarray)
    for point in [(0.0, 0.0), (2.5, 0.0), (0.0, -1.6)]:
        assert space.in_bounds(point) == theirs.in_bounds(point) == (not before.out_of_bounds(point))
        assert space.out_of_bounds(point) == before.out_of_bounds(point)
        if space.torus:
            np.testing.assert_allclose(space.torus_correct(point), theirs.torus_correct(point), atol=1e-12)
            np.testing.assert_allclose(space.torus_adj(point), before.torus_adj(point), atol=1e-12)
        else:
            np.testing.assert_array_equal(space.torus_correct(point), point)


def test_an_agent_has_the_methods_of_mesas_agents() -> None:
    world = world_in(Torus(4.0, 3.0))
    robot = world.groups[0][2]
    agents, distances = robot.get_neighbors_in_radius(1.5)
    assert agents
    assert robot not in agents
    for agent, distance in zip(agents, distances, strict=True):
        assert distance == world.space.get_distance(robot.position, agent.position) <= 1.5
    nearest, distances = robot.get_nearest_neighbors(3)
    assert len(nearest) == 3
    assert robot not in nearest
    assert list(distances) == sorted(world.space.get_distance(robot.position, a.position) for a in world.agents)[1:4]
    assert len(robot.get_nearest_neighbors(50)[0]) == 11


def test_agents_at_the_same_place_do_not_hide_each_other() -> None:
    world = World(Disc(1.0), rng=1)
    group = world.add(Robot, 3, policy="stationary", placement=np.zeros((3, 2)))
    for robot in group:
        agents, distances = robot.get_nearest_neighbors(2)
        assert set(agents) == set(group) - {robot}
        assert list(distances) == [0.0, 0.0]
    assert world.space.get_neighbors((0, 0), 0.5, include_center=False) == []


def test_the_space_is_never_stale() -> None:
    model = CMOMMT(robots=3, targets=4, radius=2.0, rng=5)
    space = model.space
    assert space is model.space
    for change in (lambda: model.run(7), model.robots[1].remove, lambda: model.reset(3)):
        change()
        np.testing.assert_array_equal(
            space.agent_positions, np.concatenate([model.robots.position, model.targets.position])
        )
        assert list(space.agents) == space.active_agents == list(model.robots) + list(model.targets)
    with pytest.raises(ValueError, match="read-only"):
        space.agent_positions[0] = 0.0


def test_agents_move_by_mesas_methods() -> None:
    world = world_in(Torus(4.0, 3.0))
    robot = world.groups[0][0]
    world.space.move_agent(robot, (2.5, 0.25))
    np.testing.assert_allclose(robot.pos, [-1.5, 0.25])
    world.space.place_agent(robot, (0.5, 0.25))
    np.testing.assert_allclose(robot.pos, [0.5, 0.25])


def test_what_cannot_be_is_refused() -> None:
    world, other = world_in(Disc(2.0)), world_in(Disc(2.0))
    robot, space = world.groups[0][0], world.space
    before = robot.position.copy()
    with pytest.raises(ValueError, match=r"pos=\(3, 0\).*outside the arena.*Disc.*point inside"):
        space.move_agent(robot, (3, 0))
    np.testing.assert_array_equal(robot.position, before)
    with pytest.raises(TypeError, match=r"agent\.remove\(\)"):
        space.remove_agent(robot)
    with pytest.raises(TypeError, match=r"agent=.*world\.add"):
        space.move_agent(other.groups[0][0], (0, 0))
    with pytest.raises(TypeError, match=r"agent=.*world\.add"):
        space.get_nearest_neighbors(None)
    with pytest.raises(ValueError, match="point=.*two finite numbers"):
        space.get_agents_in_radius((1, 2, 3))
    with pytest.raises(ValueError, match="radius=-1.*at least 0"):
        space.get_agents_in_radius((0, 0), -1)
    with pytest.raises(ValueError, match="metric.*torus.*leave it out"):
        world_in(Torus(4, 3)).space.calculate_distances((0, 0), metric="cityblock")
    far, _ = space.calculate_distances((0, 0), metric="cityblock")
    np.testing.assert_allclose(far, np.abs(space.agent_positions).sum(axis=1))


def test_a_space_of_ones_own_stays_possible() -> None:
    class Mine(World):
        def __init__(self) -> None:
            super().__init__(Disc(3.0), rng=1)
            self.space: Any = mesa.space.ContinuousSpace(3, 3, False, -3, -3)

    model = Mine()
    assert type(model.space) is mesa.space.ContinuousSpace
    robot = model.add(Robot, 2, policy="stationary")[0]
    assert len(robot.get_nearest_neighbors()[0]) == 1


def test_a_world_without_agents_has_a_space() -> None:
    space = World(Disc(1.0)).space
    assert space.agent_positions.shape == (0, 2)
    assert len(space.agents) == 0
    assert space.get_agents_in_radius((0, 0), 1)[0] == space.get_k_nearest_agents((0, 0), 3)[0] == []
    assert "0 agents" in repr(space)
