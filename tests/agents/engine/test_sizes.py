"""Records follow agents who come and leave, and the world is as if all had been bound again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Batteries, Box, Cycle, Failures, Robot, Sensor, Target, Torus, World
from teamsight.agents.engine.binding import Binding

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one", "ignore:no group senses another")


def cmommt(**settings: Any) -> CMOMMT:
    return CMOMMT(robots=3, targets=6, radius=4.0, rng=7, **settings)


def two_teams(arena: Any) -> World:
    world = World(arena, rng=3)
    first = world.add(Robot, 2, policy="a-cmommt", awareness="ring", sensing_range=2.0, awareness_range=3.0, name="first")
    prey = world.add(Target, 4, policy="evasive", sensing_range=1.5)
    rivals = world.add(Robot, 3, policy="centroid", team="rivals", sensing_range=2.0, awareness_range=2.5, name="rivals")
    more = world.add(Robot, 2, policy="centroid", awareness="shared", sensing_range=1.0, awareness_range=3.0, name="more")
    for group in (first, rivals, more):
        world.senses(group, prey)
    world.senses(prey, first)
    world.senses(rivals, first, as_="foes", counts=False)
    return world


def with_failures(**settings: Any) -> CMOMMT:
    world = cmommt(**settings)
    world.attach(Failures(40, 10), world.robots)
    return world


def with_batteries() -> CMOMMT:
    world = cmommt()
    world.attach(Batteries(30), world.robots)
    return world


def logged() -> CMOMMT:
    world = cmommt()
    world.log_contacts(world.robots, "targets")
    world.count_observations()
    return world


def walk(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    return rng.uniform(-1, 1), 0.1 * len(percept.targets.distance)


WORLDS: dict[str, Callable[[], World]] = {
    "default": lambda: cmommt(policy="a-cmommt"),
    "shared": lambda: cmommt(policy="a-cmommt", awareness="shared"),
    "ring": lambda: cmommt(policy="a-cmommt", awareness="ring", delta=4),
    "cycle": lambda: cmommt(policy="a-cmommt", cycle=Cycle(3, phase="random", jitter=0.5, delay=2)),
    "square": lambda: cmommt(policy="p-cmommt", range_shape="square"),
    "failures": with_failures,
    "failures and cycle": lambda: with_failures(cycle=Cycle(4)),
    "batteries": with_batteries,
    "contacts": logged,
    "python": lambda: cmommt(policy=walk),
    "two teams in a box": lambda: two_teams(Box(9, 7)),
    "two teams on a torus": lambda: two_teams(Torus(20, 16)),
    # Here records are bound again each time.
    "late": lambda: cmommt(policy="a-cmommt", sensor=Sensor(delay=2, missed=0.2)),
}


def changed(world: World, tick: int) -> None:
    """Let some come and others leave."""
    first, second = world.groups[0], world.groups[1]
    if tick % 3 != 2:
        first.add(1)
    if tick % 4 == 1:
        second.add(2)
    if tick % 5 == 3 and len(first) > 1:
        first[tick % len(first)].remove()
    if tick % 7 == 4 and len(second) > 2:
        second[1].remove()
        world.groups[-1].add(1)


def seen(world: World, advance: Callable[[World, int], Any]) -> tuple[Any, ...]:
    for tick in range(24):
        world.clock.at(2.5 * tick + 1, lambda tick=tick: changed(world, tick))
    advance(world, 80)
    places = [(g.position.tobytes(), g.identity.tobytes(), g.action.heading.tobytes(), g.decided_at.tobytes()) for g in world.groups]
    near = [[one.unique_id for one in agent.neighbours] for agent in world.groups[0]]
    here = [agent.situation.tolist() for agent in world.groups[0]]
    events = world.events.to_csv() if len(world.events) else ""
    return places, near, here, world.recording.history.to_numpy().tobytes(), world.observed_fraction, world.mean_degree, events


def in_steps(world: World, steps: int) -> None:
    for _ in range(steps):
        world.step()


@pytest.mark.short
@pytest.mark.parametrize("name", WORLDS)
def test_following_is_binding_again(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    world = WORLDS[name]()
    followed = seen(world, lambda world, steps: world.run(steps))
    assert (world._engine.fits > 15) == (name != "late")
    assert seen(WORLDS[name](), in_steps) == followed
    monkeypatch.setattr(Binding, "follow", lambda binding, group: False)
    assert seen(WORLDS[name](), lambda world, steps: world.run(steps)) == followed


def test_lists_grow_after_records_have_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lists are made anew for the agents that there are then, not for those of the last binding."""
    found = []
    for is_followed in (True, False):
        if not is_followed:
            monkeypatch.setattr(Binding, "follow", lambda binding, group: False)
        world = World(Box(60, 60), rng=1)
        robots = world.add(
            Robot, 20, policy="a-cmommt", awareness="shared", sensing_range=3.0, awareness_range=5.0,
            position=[(0.01 * i, 0) for i in range(20)],
        )
        targets = world.add(Target, 200, policy="stationary", speed=0.0)
        world.senses(robots, targets)
        world.run(1)
        targets.add(1)
        world.run(1)
        new = targets.add(100, position=[(0.01 * i, 0.5) for i in range(100)])
        world.run(1)
        robots.add(1, position=(0.3, 0.2))
        world.run(1)
        found.append((
            [len(agent.observed_targets) for agent in robots], [len(agent.neighbours) for agent in robots],
            len(new[0].observers), world.observed, robots.position.tobytes(), robots.action.heading.tobytes(),
        ))  # fmt: skip
    assert found[0] == found[1]
    assert found[0][2] > 15


@pytest.mark.parametrize("name", WORLDS)
def test_lists_with_little_room_grow_while_records_follow(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("teamsight.world.search.first_room", lambda observers, observed: 3)
    monkeypatch.setattr("teamsight.world.search.MOST_PAIRS", 30)
    followed = seen(WORLDS[name](), lambda world, steps: world.run(steps))
    monkeypatch.setattr(Binding, "follow", lambda binding, group: False)
    assert seen(WORLDS[name](), lambda world, steps: world.run(steps)) == followed


def test_only_the_group_that_changes_forgets_its_actions() -> None:
    world = cmommt(policy="a-cmommt")
    world.run(2)
    world.targets.add(1)
    world.run(2)
    before = world.robots.action.distance.tolist()
    world.targets.add(1)
    assert world._engine.fits
    assert world.robots.action.distance.tolist() == before
    assert any(before)


def test_an_empty_group_fills_again() -> None:
    world = cmommt(policy="a-cmommt")
    world.run(3)
    for _ in range(2):
        for agent in world.robots:
            agent.remove()
        world.run(2)
        assert np.isnan(world.mean_degree)
        world.robots.add(3)
        world.run(2)
    assert world._engine.fits > 3
    assert len(world.robots) == 3
    assert world.observed > 0


def test_longer_ranges_than_cells_are_wide_are_bound_again() -> None:
    """Agents who come with a longer range would not find all in cells made for shorter ones."""
    ways = []
    for is_first in (True, False):
        world = World(Box(60, 60), rng=1)
        robots = world.add(Robot, 150, policy="random-walk", awareness_range=2.0)
        world.run(1)
        robots.add(1, awareness_range=2.0)
        world.run(1)
        if is_first:
            robots.add(1, awareness_range=30.0, position=(30, 30))
            world.run(1)
        else:
            world._engine.is_bound = False
            robots.add(1, awareness_range=30.0, position=(30, 30))
            world._engine.is_bound = False
            world.run(1)
        ways.append((world.max_neighbours, len(robots[-1].neighbours)))
    assert ways[0] == ways[1]
    assert ways[0][1] > 20
