"""Worlds in arenas that a user wrote: both paths give one result, and distances are those of the arena."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from arenas import Cylinder, Ellipse, Hall
from scipy.spatial import cKDTree

from teamsight import CMOMMT, Box, Circle, Disc, Polygon, Robot, Target, Torus, World
from teamsight.analysis.delta.resample import neighbours_over_time
from teamsight.analysis.neighbour_graph import over_trajectory
from teamsight.policies import ACmommt, RandomWalk
from teamsight.world import Arena

ELL = Polygon([(0, 0), (6, 0), (6, 3), (3, 3), (3, 6), (0, 6)])
COURT = ELL.with_obstacles(Circle((2, 2), 0.5), Polygon([(5, 0), (4, 1), (4.5, 2)]))
PILLARS = Torus(6.0, 5.0).with_obstacles(Circle((3, 2.5), 1), Polygon([(-1, -1), (0, -1), (-1, 1)]))
ARENAS: list[Arena] = [
    Cylinder(5.0, 3.0), Cylinder(2.0, 9.0), Ellipse(3.0, 2.0), Hall(6, 5, 0.4), Ellipse(3, 2), ELL, COURT, PILLARS,
]  # fmt: skip


def world_in(arena: Arena, seed: int, size: int = 8, placement: str = "uniform") -> World:
    world = World(arena, rng=seed)
    robots = world.add(
        Robot, size, policy=ACmommt(), awareness="shared", sensing_range=1.0, awareness_range=1.0, speed=0.3,
        placement=placement,
    )  # fmt: skip
    world.senses(robots, world.add(Target, 12, policy=RandomWalk(0.3), speed=0.2))
    return world


def seen(world: World) -> list[Any]:
    arrays = [
        array
        for group in world.groups
        for array in (group.position, group.heading, group.bodies.moved, *group.neighbours("targets"))
    ]
    return [array.tobytes() for array in (*arrays, *world.groups[0].neighbours("teammates"))] + [world.observed_fraction]


@pytest.mark.parametrize(("arena", "placement"), [*((arena, "uniform") for arena in ARENAS), (ELL, "spread")], ids=str)
def test_two_paths_one_result(arena: Arena, placement: str) -> None:
    seed = int(np.random.default_rng().integers(2**31))
    one, other = world_in(arena, seed, placement=placement), world_in(arena, seed, placement=placement)
    one.run(50)
    for _ in range(50):
        other.step()
    assert seen(one) == seen(other), seed
    assert all(arena.contains(group.position).all() for group in one.groups), seed
    assert one.observed_fraction > 0, seed


@pytest.mark.parametrize("arena", [COURT, PILLARS], ids=str)
def test_a_world_among_obstacles_is_saved_restored_and_reset(arena: Arena) -> None:
    seed = int(np.random.default_rng().integers(2**31))
    world = world_in(arena, seed)
    world.run(20)
    saved = world.state()
    world.run(20)
    after = seen(world)
    # An equal arena, made anew.
    other = world_in(type(arena)(arena.arena, arena.obstacles), seed)  # type: ignore[attr-defined, call-arg]
    other.restore(saved)
    other.run(20)
    assert seen(other) == after, seed
    world.reset()
    world.run(40)
    assert seen(world) == after, seed
    wrong = world_in(arena.with_obstacles(Circle((1, 0.5), 0.2)), seed)
    with pytest.raises(ValueError, match=r"restore\(…\): the state is of a world in Obstructed"):
        wrong.restore(saved)


def test_a_thousand_steps_among_obstacles_keep_everybody_free() -> None:
    world = world_in(COURT, 1, 30)
    for _ in range(20):
        world.run(50)
        assert all(COURT.contains(group.position).all() for group in world.groups)


def test_placements_in_an_obstacle_are_refused() -> None:
    world = World(Box(4, 4).with_obstacles(Circle((0, 0), 1)), rng=1)
    robots = world.add(Robot, 1, policy="stationary", placement=[[1.5, 0]])
    with pytest.raises(ValueError, match=r"position=\(0\.5, 0\.0\): must be two finite numbers inside the arena, Box"):
        robots[0].position = (0.5, 0)
    assert robots.position.tolist() == [[1.5, 0]]


def test_the_analyses_take_the_same_neighbours_from_what_was_recorded() -> None:
    arena = Cylinder(6.0, 2.0)
    seed = int(np.random.default_rng().integers(2**31))
    world = world_in(arena, seed, 12)
    world.recording.record_positions(1)
    largest, mean = [], []
    for _ in range(40):
        world.step()
        degree = world.groups[0].neighbours("teammates").degree
        largest.append(int(degree.max()))
        mean.append(float(degree.mean()))
    track = world.recording.trajectory
    track = (
        track[(track["group"] == world.groups[0].name) & (track["time"] > 0)]
        .drop(columns="group")
        .rename(columns={"identity": "robot"})
    )
    track = track.astype({"robot": "category"}).sort_values(["robot", "time"])
    graphs = over_trajectory(track, 1.0, arena, cliques=False)
    assert graphs["max_degree"].tolist() == largest, seed
    counts = neighbours_over_time(track, 1.0, arena=arena)
    assert counts.over_time["max_degree"].tolist() == largest, seed
    assert counts.over_time["mean_degree"].tolist() == pytest.approx(mean), seed
    # A robot that crosses the seam covers no more than its speed there either.
    assert counts.move <= 0.3 + 1e-9, seed


@pytest.mark.parametrize("size", [20, 200])
def test_neighbours_on_a_cylinder_are_those_of_scipy(size: int) -> None:
    arena = Cylinder(7.0, 4.0)
    seed = int(np.random.default_rng().integers(2**31))
    world = world_in(arena, seed, size)
    crossed = False
    for _ in range(10):
        before = world.groups[0].position.copy()
        world.step()
        position, moved = world.groups[0].position, world.groups[0].bodies.moved
        # Along y the wall turns back what would have gone on; along x nobody goes farther than its speed.
        crossed |= bool((np.abs(position - before)[:, 0] > 1.0).any())
        assert np.abs(moved).max() <= 0.3 + 1e-12, seed
        tree = cKDTree((position + [3.5, 2.0]) % [7.0, 5.0], boxsize=arena.period)
        teammates = world.groups[0].neighbours("teammates")
        assert len(teammates.distance) == 2 * len(tree.query_pairs(1.0)), seed
    assert crossed or size < 200, seed


@pytest.mark.parametrize(("shape", "kind"), [("disc", Disc), ("square", Box), ("torus", Torus)])
def test_the_shape_of_an_arena_keeps_its_area(shape: str, kind: type) -> None:
    model = CMOMMT(40, 40, 2.0, arena_shape=shape, seed=4)
    assert type(model.arena) is kind
    assert model.arena.area == pytest.approx(4 * np.pi, rel=1e-12)
    model.run(30)
    model.step()
    places = np.concatenate([model.robots.position, model.targets.position])
    assert model.arena.contains(places).all()
    # In the corners of the square there are bodies, where the disc has none; and the disc reaches beyond its sides.
    assert (np.hypot(*places.T) > 2.0).any() == (shape != "disc")
    with pytest.raises(AttributeError, match="is fixed when the model is built"):
        model.arena_shape = "disc"


def test_wrong_shapes_of_an_arena_are_refused() -> None:
    with pytest.raises(ValueError, match="arena_shape='hexagon': unknown; known are disc, square, torus"):
        CMOMMT(arena_shape="hexagon")
    with pytest.raises(ValueError, match="range=1: on a torus a range must be at most half of the shorter side, here 0.886"):
        CMOMMT(radius=1.0, arena_shape="torus")
