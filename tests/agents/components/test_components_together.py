"""All components together, in random schedules of what else happens: one result on all paths, and sound bookkeeping."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import Disc, Robot, Target, World
from teamsight.agents.components import (
    Arrivals,
    Batteries,
    ChargingPlaces,
    Departures,
    Failures,
    SensorDropouts,
    UnreliableAwareness,
    Weibull,
)
from teamsight.policies import SeekCharger

SOURCES = (
    Failures(25, Weibull(6, 2)), Failures(60, 10), Batteries(2.0, 0.5, per_tick=0.01, low_level=1.2),
    ChargingPlaces([(0, 0), (1, 1)], rate=0.2, radius=0.4, policy=SeekCharger()), SensorDropouts(20, 5),
    SensorDropouts(30, 8, "targets"), UnreliableAwareness(2, 0.2, begins=5, ends=40), Arrivals(9.0, 40.0, most=12),
    Departures(90.0), UnreliableAwareness(1, 0.3, begins=20, ends=60),
)  # fmt: skip


def build(seed: int, order: list[int]) -> World:
    world = World(Disc(2.5), rng=seed)
    team = world.add(Robot, 7, policy="a-cmommt", awareness="shared")
    world.senses(team, world.add(Target, 6, policy="random-walk", speed=0.075))
    for index in order:
        world.attach(SOURCES[index], team)
    return world


def fingerprint(world: World) -> list[Any]:
    parts: list[Any] = [world.tick, world.events.to_csv(), world.recording.history.to_csv()]
    for group in world.groups:
        parts += [group.position.tobytes(), group.active.tolist(), group.identity.tolist(), group.speed.tolist()]
        parts += [[type(agent.policy).__name__ for agent in group]]
    return parts + [world.groups[0].columns["battery"].tolist()]


def check(world: World) -> None:
    robots = world.groups[0]
    assert world._data.arena.contains(robots.position).all()
    charge = np.asarray(robots.columns["battery"])
    assert ((charge >= 0) & (charge <= 2.0)).all()
    (places,) = (one for one in world.sources if isinstance(one, ChargingPlaces))
    there = [agent for k in range(2) for agent in places.queue(k) + places.charging(k)]
    assert len(there) == len(set(there)) <= len(robots)
    assert all(len(places.charging(k)) <= 1 for k in range(2))
    assert all(agent.speed == 0.0 for agent in there)
    # No ghost in the graph.
    away = {agent.unique_id for agent in robots if not agent.active}
    assert not any({mate.unique_id for mate in agent.neighbours} & away for agent in robots)
    failures = [one for one in world.sources if isinstance(one, Failures)]
    assert all(not agent.active for source in failures for agent in source.failed)


deeds = st.one_of(
    st.tuples(st.just("run"), st.integers(1, 25)),
    st.tuples(st.just("add"), st.integers(1, 2)),
    st.tuples(st.just("remove"), st.integers(0, 20)),
    st.tuples(st.just("drain"), st.integers(0, 20)),
    st.tuples(st.just("save"), st.just(0)),
    st.tuples(st.just("restore"), st.just(0)),
    st.tuples(st.just("reset"), st.integers(0, 3)),
)


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 999),
    order=st.permutations(range(10)).filter(lambda order: order.index(2) < order.index(3)),
    schedule=st.lists(deeds, max_size=9),
)
def test_components_in_random_schedules_give_one_result_on_all_paths(
    seed: int, order: list[int], schedule: list[tuple[str, int]]
) -> None:
    worlds = [build(seed, order) for _ in range(2)]
    saved = None
    for deed, number in [*schedule, ("run", 20)]:
        robots = [world.groups[0] for world in worlds]
        if deed == "run":
            worlds[0].run(number)
            for _ in range(number):
                worlds[1].step()
        elif deed == "save":
            saved = pickle.loads(pickle.dumps(worlds[0].state()))
            # One built anew goes on in the same way.
            worlds[0].run(15)
            worlds[1].run(15)
            resumed = build(seed, order)
            resumed.restore(saved)
            resumed.run(15)
            assert fingerprint(resumed) == fingerprint(worlds[0])
        elif deed == "restore" and saved is not None:
            for world in worlds:
                world.restore(saved)
        for world, group in zip(worlds, robots, strict=True):
            if deed == "add":
                group.add(number, speed=0.1)
            elif deed == "remove" and len(group) > 1:
                group[number % len(group)].remove()
            elif deed == "drain" and len(group):
                group[number % len(group)].battery = 0.01  # type: ignore[attr-defined]
            elif deed == "reset":
                world.reset(number)
            check(world)
        assert fingerprint(worlds[0]) == fingerprint(worlds[1])
