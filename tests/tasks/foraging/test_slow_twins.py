"""Carrying, consuming and grazing, and the motor schemas, against their slow twins, step by step on random worlds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from naive import foraging as naive

from teamsight import TASKS, Box, Robot, World
from teamsight.core.angles import direction
from teamsight.core.kernel import plain
from teamsight.tasks.foraging import Attractor, Carrying, Consuming, Grazing, Home

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
SIDE = 12.0
RULES = {"carry": Carrying(3.0, 1.0, 3.0), "consume": Consuming(3.0, 0.3), "graze": Grazing(SIDE, 0.75, 1.1, 2.0)}
EVENTS = ("run", "step", "off", "on", "leave", "lose", "come", "faster", "empty")


def _world(name: str | None, numbers: tuple[int, int, int], seed: int) -> World:
    """Return robots, attractors and homes that walk at random; without a name nothing happens between them."""
    world = World(Box(SIDE, SIDE), rng=seed)
    robots = world.add(Robot, numbers[0], policy="random-walk", speed=np.linspace(0.5, 1.5, numbers[0]), name="robots")
    things = world.add(Attractor, numbers[1], policy="random-walk", speed=0.2, name="attractors")
    home = world.add(Home, numbers[2], policy="stationary", name="home")
    groups = {"carry": {"attractors": things, "home": home}, "consume": {"attractors": things}, "graze": {}}
    if name is not None:
        world.interact(RULES[name], robots=robots, **groups[name])
    return world


def _change(world: Any, event: str) -> None:
    robots, things, home = world.groups
    if event in ("off", "on"):
        robots[0].active = things[-1].active = home[0].active = event == "on"
    elif event == "leave" and len(robots) > 1:
        robots[0].remove()
    elif event == "lose" and len(things) > 1:
        things[0].remove()
    elif event == "come":
        robots.add(1, speed=0.7)
        things.add(1)
    elif event == "empty" and "mass" in things.columns:
        things[-1].mass = 0.0
    elif event == "faster":
        robots[-1].speed = 1.25


def _moved(world: Any, still: Any) -> list[np.ndarray]:
    """Return where the bodies of a world will have gone before anything happens, by a world where nothing does."""
    for mine, other in zip(world.groups, still.groups, strict=True):
        for name in ("position", "heading", "speed"):
            getattr(other.bodies, name)[:] = getattr(mine.bodies, name)
    still._engine.is_seen = False
    still.step()
    return [group.bodies.position.copy() for group in still.groups]


def _things(group: Any, place: np.ndarray) -> list[naive.Thing]:
    bodies, columns = group.bodies, group.columns.arrays()
    found = []
    for row in range(len(group)):
        one = naive.Thing(
            int(bodies.identity[row]), tuple(place[row]), tuple(bodies.position[row]), bool(bodies.active[row]),
            float(bodies.speed[row]),
        )  # fmt: skip
        known = {"own_speed": "free_speed", "slow_speed": "slow_speed", "holds": "attractor", "mass": "mass"}
        for attribute, column in known.items():
            if column in columns:
                setattr(one, attribute, columns[column][row].item())
        found.append(one)
    return found


def _check(world: Any, things: list[list[naive.Thing]], scores: dict[str, float]) -> None:
    for group, expected in zip(world.groups, things, strict=True):
        assert group.bodies.position == pytest.approx(np.array([one.place for one in expected]), abs=1e-9)
        assert group.bodies.speed == pytest.approx([one.speed for one in expected], abs=1e-9)
    robots, attractors, _ = things
    # Those of this step; in `reward` they add up for robots that do not decide.
    rewards, ended = world.groups[0].bodies.last_rewards.T
    assert rewards == pytest.approx([one.reward for one in robots], abs=1e-9)
    assert ended.tolist() == [one.has_ended for one in robots]
    if "attractor" in world.groups[0].columns:
        assert world.groups[0].attractor.tolist() == [one.holds for one in robots]
        assert world.groups[0].attached.tolist() == [int(one.holds > 0) for one in robots]
        assert world.groups[1].mass.values == pytest.approx([one.mass for one in attractors], abs=1e-9)
    last = world.recording.history.iloc[-1]
    for name, value in scores.items():
        assert last[name] == pytest.approx(value, abs=1e-9)


def _step(world: Any, *, is_run: bool) -> None:
    world.run(1) if is_run else world.step()


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    name=st.sampled_from(["carry", "consume"]), numbers=st.tuples(*3 * [st.integers(1, 5)]), seed=st.integers(0, 9999),
    events=st.lists(st.sampled_from(EVENTS), min_size=5, max_size=40),
)  # fmt: skip
def test_carrying_and_consuming(name: str, numbers: tuple[int, int, int], seed: int, events: list[str]) -> None:
    world, still = _world(name, numbers, seed), _world(None, numbers, seed)
    for event in events:
        for one in (world, still):
            _change(one, event)
        places = _moved(world, still)
        things = [_things(group, place) for group, place in zip(world.groups, places, strict=True)]
        scores = getattr(naive, name)(*things, RULES[name])
        _step(world, is_run=event == "run")
        _check(world, things, scores)


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(robots=st.integers(1, 4), seed=st.integers(0, 9999), events=st.lists(st.sampled_from(EVENTS), max_size=25))
def test_grazing(robots: int, seed: int, events: list[str]) -> None:
    world, still = _world("graze", (robots, 2, 1), seed), _world(None, (robots, 2, 1), seed)
    placed: Any = world._data.interactions[0]
    ground, whole = placed.state.ints.copy(), placed.state.floats[0, 0]
    for event in events:
        for one in (world, still):
            _change(one, event)
        places = _moved(world, still)
        things = [_things(group, place) for group, place in zip(world.groups, places, strict=True)]
        grazed, probes = naive.graze(ground, things[0], RULES["graze"], whole)
        _step(world, is_run=event == "run")
        _check(world, things, {"grazed": grazed})
        assert (placed.state.ints == ground).all()
        found = np.stack([world.groups[0].probe_x, world.groups[0].probe_y], axis=-1)
        # Two cells may be equally near.
        assert np.hypot(*found.T) == pytest.approx(np.hypot(*np.array(probes).T), abs=1e-9)


def _seen(percept: Any, policy: Any, i: int) -> naive.Seen:
    def listed(sensed: Any) -> list[tuple[int, Any]]:
        rows = range(sensed.start[i], sensed.start[i + 1])
        return [(int(sensed.identity[k]), sensed.offset[k].copy()) for k in rows]

    home = percept.channels.home
    columns = {name: getattr(percept.columns, name) for name in policy.columns}
    offset = home.offset[home.start[i]].copy() if home.start[i + 1] > home.start[i] else np.zeros(2)
    number = int(percept.identity[i])
    return naive.Seen(number, offset, listed(percept.teammates), listed(percept.targets), columns, percept.speed[i])


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    task=st.sampled_from(["forage", "consume", "graze"]), seed=st.integers(0, 9999), robots=st.integers(1, 6),
    communication=st.sampled_from(["none", "state", "goal"]), first=st.integers(0, 60),
)  # fmt: skip
def test_the_schemas(task: str, seed: int, robots: int, communication: str, first: int) -> None:
    team = {"policy": "schemas", "communication": communication, "awareness": "pairwise"}
    world: Any = TASKS[task].build(team, rng=seed, robots=robots, side=30.0, sensing_range=8.0, communication_range=12.0)
    world.run(first)
    group, policy = world.robots, world.robots.policy
    for _ in range(12):
        world._engine.perceive(group)
        percept, state = group.percept, group.policy_state
        seen = [_seen(percept, policy, i) for i in range(robots)]
        left, kept = state.ints[:, 0, 0].copy(), state.floats[:, 0, 3:5].copy()
        columns = [{name: array.copy() for name, array in one.columns.items()} for one in seen]
        tick = world.tick
        world.step()
        drawn = group.noise(tick)[0]
        for i, one in enumerate(seen):
            one.columns = columns[i]
            mode, goal, shown = naive.mode_and_goal(policy, one)
            random = np.array(plain(direction)(drawn[i])) if left[i] <= 0 else kept[i]
            total, distance = naive.action(policy, one, mode, goal, random)
            assert state.floats[i, 0, 0] == mode
            assert state.floats[i, 0, 1:3] == pytest.approx(shown, abs=1e-9)
            assert state.floats[i, 0, 3:5] == pytest.approx(random, abs=1e-12)
            assert group.action.distance[i] == pytest.approx(distance, abs=1e-6)
            if distance > 1e-3:
                assert group.action.heading[i] == pytest.approx(total / np.hypot(*total), abs=1e-4)
