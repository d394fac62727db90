"""Closed forms of forage, consume and graze: what is carried, eaten and grazed, and how fast."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import Box, Robot, Target, World
from teamsight.tasks import TASKS
from teamsight.tasks.foraging import (
    Attractor,
    Carrying,
    Consume,
    Consuming,
    Forage,
    Graze,
    Grazing,
    Home,
    area,
    completion,
    scattered,
)
from teamsight.world.check import check_interaction
from tests.interactions import fingerprint

NAMES = ("forage", "consume", "graze")


@pytest.mark.parametrize("interaction", [Carrying(), Consuming(), Grazing(side=4.0, obstacles=((0.0, 0.0, 1.0),))])
def test_interactions_keep_their_contract(interaction: Any) -> None:
    check_interaction(interaction)


@settings(max_examples=12, deadline=None)
@given(
    name=st.sampled_from(NAMES), seed=st.integers(0, 999), robots=st.integers(1, 9),
    communication=st.sampled_from(["none", "state", "goal"]), parts=st.lists(st.integers(1, 40), max_size=4),
)  # fmt: skip
def test_both_paths_give_one_result(name: str, seed: int, robots: int, communication: str, parts: list[int]) -> None:
    team = {"policy": "schemas", "communication": communication, "awareness": "pairwise"}
    worlds = [TASKS[name].build(team, rng=seed, robots=robots, communication_range=15.0, side=32.0) for _ in range(2)]
    for number, steps in enumerate(parts):
        worlds[0].run(steps)
        if number % 2:
            worlds[1].run(steps)
        else:
            for _ in range(steps):
                worlds[1].step()
    assert fingerprint(worlds[0]) == fingerprint(worlds[1])


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 999), robots=st.integers(1, 12), mass=st.floats(0.5, 40.0))
def test_mass_is_conserved_and_nothing_is_delivered_twice(seed: int, robots: int, mass: float) -> None:
    world: Any = Forage(robots, attractors=6, mass=mass, side=30.0, rng=seed)
    before = world.attractors.mass.values.copy()
    for _ in range(120):
        world.step()
        history, masses = world.recording.history, world.attractors.mass.values
        assert set(masses) <= {0.0, mass}
        assert (masses <= before).all()
        assert masses.sum() + history["delivered_mass"].sum() == pytest.approx(6 * mass)
        assert history["delivered"].sum() == (masses == 0.0).sum()
        done = masses == 0.0
        assert (np.hypot(*world.attractors.bodies.position[done].T) <= 3.0).all()
        assert not world.attractors.robots_at_it.values[before == 0.0].any()
        before = masses.copy()


def carriers(count: int, mass: float = 5.0) -> World:
    """Return a world with robots at one attractor, which go to the right; home is far away."""
    world = World(Box(400, 20), rng=1)
    robots = world.add(
        Robot, count, policy=lambda percept, rng: (0.0, percept.speed), position=(-100.0, 0.0), heading=(1.0, 0.0),
        speed=2.0,
    )  # fmt: skip
    load = world.add(Attractor, 1, policy="stationary", speed=0.0, position=(-100.0, 0.0), name="attractors")
    load.add_column("mass", mass)
    home = world.add(Home, 1, policy="stationary", position=(0.0, 0.0), speed=0.0, name="home")
    world.interact(Carrying(reach=5.0), robots=robots, attractors=load, home=home)
    return world


@pytest.mark.parametrize(("count", "mass"), [(1, 5.0), (2, 5.0), (3, 5.0), (1, 20.0), (4, 20.0)])
def test_speed_falls_with_mass_and_rises_with_carriers(count: int, mass: float) -> None:
    world: Any = carriers(count, mass)
    world.step()
    expected = 2.0 / (1.0 + mass / (5.0 * count))
    assert world.groups[0].speed == pytest.approx(np.full(count, expected))
    start = world.groups[1].bodies.position[0, 0]
    for _ in range(5):
        world.step()
    assert world.groups[1].bodies.position[0, 0] - start == pytest.approx(5 * expected)
    assert (world.groups[0].bodies.position == world.groups[1].bodies.position).all()


def test_carriers_are_rewarded_and_released_at_home() -> None:
    world: Any = carriers(2)
    world.step()
    while not world.recording.history["delivered"].sum():
        world.step()
    assert world.groups[0].bodies.reward.tolist() == [1.0, 1.0]
    assert world.groups[0].bodies.ended.all()
    assert world.groups[0].speed == pytest.approx([2.0, 2.0])
    assert not world.groups[0].attached.values.any()
    # The first step, at full speed, and then steps of 4/3 until less than 3 from home.
    assert world.tick == 1 + math.ceil((98.0 - 3.0) / (4.0 / 3.0))


@pytest.mark.parametrize(("count", "mass"), [(1, 1.0), (1, 5.0), (1, 10.0), (2, 10.0), (4, 3.0)])
def test_the_time_to_consume_is_proportional_to_mass(count: int, mass: float) -> None:
    world: Any = World(Box(20, 20), rng=1)
    robots = world.add(Robot, count, policy="stationary", position=(1.0, 1.0))
    meal = world.add(Target, 1, policy="stationary", position=(1.0, 1.0), name="attractors")
    meal.add_column("mass", mass)
    world.interact(Consuming(rate=0.125), robots=robots, attractors=meal)
    world.run(200)
    assert completion(world, "finished", 1) == mass / (0.125 * count)
    assert world.recording.history["consumed"].sum() == pytest.approx(mass)


def test_ground_is_grazed_once_and_not_under_obstacles() -> None:
    world: Any = Graze(6, side=24.0, rng=2)
    ground = world._data.interactions[0].state.ints
    fresh = int(ground.sum())
    assert fresh / ground.size == pytest.approx(0.85, abs=0.02)
    world.run(200)
    grazed = world.recording.history["grazed"].sum()
    assert grazed == pytest.approx(1 - ground.sum() / fresh)
    assert 0.5 < grazed <= 1.0 + 1e-12
    world.reset()
    assert world._data.interactions[0].state.ints.sum() == fresh


def test_a_robot_in_the_open_grazes_a_strip() -> None:
    world: Any = World(Box(20, 20), rng=1)
    robots = world.add(
        Robot, 1, policy=lambda percept, rng: (0.0, 1.0), position=(-8.5, 0.5), heading=(1.0, 0.0), speed=1.0
    )
    world.interact(Grazing(side=20.0, reach=1.2), robots=robots)
    world.run(10)
    # Three rows: of each place the centre and its four neighbours are within 1.2.
    assert world.recording.history["grazed"].sum() * 400 == pytest.approx(3 * 10 + 2)
    assert robots.probe_x[0] > 0.0


@settings(max_examples=20, deadline=None)
@given(layout=st.integers(0, 10_000), share=st.sampled_from([0.05, 0.15, 0.2]))
def test_obstacles_cover_their_share_and_leave_gaps(layout: int, share: float) -> None:
    circles = np.array(scattered(64.0, share, layout, 5.0))
    assert (np.pi * circles[:, 2] ** 2).sum() / 64.0**2 == pytest.approx(share, rel=0.01)
    gap = np.hypot(*(circles[:, None, :2] - circles[None, :, :2]).T) - circles[:, None, 2] - circles[None, :, 2]
    assert (gap[~np.eye(len(circles), dtype=bool)] >= 1.5).all()
    assert (np.hypot(circles[:, 0], circles[:, 1]) - circles[:, 2] > 5.0).all()
    assert len(area(64.0, scattered(64.0, share, layout, 5.0)).obstacles) == len(circles)  # type: ignore[attr-defined]


def test_whole_numbers_of_any_type_are_the_layout() -> None:
    assert Forage(1, rng=1, layout=2.0)._circles == Forage(1, rng=1, layout=2)._circles  # type: ignore[arg-type]


def test_too_many_obstacles_are_refused() -> None:
    with pytest.raises(ValueError, match=r"obstacles=0\.5.*0\.3"):
        Consume(obstacles=0.5)
    with pytest.raises(ValueError, match=r"find no room .* side 8; take a smaller share"):
        Consume(obstacles=0.3, side=8.0)


def test_what_did_not_end_is_infinite() -> None:
    world = Forage(1, rng=1)
    world.run(2)
    assert TASKS["forage"].measure(world) == {"completion_time": math.inf, "delivered": 0.0}
