"""Random schedules: agents come, go, fail, are repaired and move, in any order, in worlds that are run and stepped.

`Schedule` is a hypothesis machine. A test adds operations in a subclass, as rules that call `self.all`, and checks in
`check`; what it adds to a world is made in `build`.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from naive.conditions import lists_by_hand, shares_by_hand

from teamsight import Disc, Robot, Sensor, Target, Torus, World
from teamsight.policies import Centroid, RandomWalk

SENSORS = {"none": None, "all": Sensor(4.0, 0.05, 0.1, 0.2, 0.5, 2), "false": Sensor(false_positives=1.0)}
#: Arena, numbers of robots, rovers and targets, and range. In the last, bodies are sorted into cells.
SETTINGS = {
    "disc": (Disc(2.0), 4, 2, 5, 1.0), "torus": (Torus(4.0, 4.5), 5, 3, 4, 1.2), "cells": (Torus(9.0, 9.0), 45, 5, 40, 0.9),
}  # fmt: skip
ends = st.tuples(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))


class Schedule(RuleBasedStateMachine):
    """Three worlds alike: one is run, one stepped, one does both; after everything they are equal to the last bit."""

    def build(self, setting: str, awareness: str, sensor: str, seed: int) -> World:
        """Return a new world."""
        arena, robots, rovers, targets, reach = SETTINGS[setting]
        world = World(arena, rng=seed)
        far: dict[str, Any] = {"sensing_range": reach, "awareness_range": reach, "speed": 0.1}
        first = world.add(Robot, robots, policy=Centroid(), awareness=awareness, **far)
        second = world.add(Robot, rovers, policy="a-cmommt", awareness=awareness, name="rovers", **far)
        herd = world.add(Target, targets, policy=RandomWalk(0.1), **far)
        for group in (first, second):
            world.senses(group, herd, sensor=SENSORS[sensor])
            if SENSORS[sensor]:
                group.sensors["teammates"] = SENSORS[sensor]
        world.senses(herd, first)
        world.recording.record_positions(every=2)
        return world

    @initialize(
        setting=st.sampled_from(list(SETTINGS)), awareness=st.sampled_from(["ring", "nearest", "pairwise", "shared"]),
        sensor=st.sampled_from(list(SENSORS)), seed=st.integers(0, 999),
    )  # fmt: skip
    def begin(self, setting: str, awareness: str, sensor: str, seed: int) -> None:
        self.worlds = [self.build(setting, awareness, sensor, seed) for _ in range(3)]
        self.saved = self.state_of(self.worlds[0])
        # What is expected of each completed step: the observed fraction and the mean number of neighbours.
        self.shares: list[tuple[float, float]] = []
        self.saved_shares: list[tuple[float, float]] = []
        # By group and member, what is not as at the start: "" for an agent that is inactive, else a channel.
        self.faults: dict[tuple[int, int], set[str]] = {}
        self.saved_faults: dict[tuple[int, int], set[str]] = {}

    def all(self, deed: Callable[[World], Any]) -> None:
        """Do the same with all worlds."""
        for world in self.worlds:
            deed(world)

    def agent(self, data: st.DataObject) -> tuple[int, int] | None:
        """Return the group and the row of some agent."""
        places = [(g, row) for g, group in enumerate(self.worlds[0].groups) for row in range(len(group))]
        return data.draw(st.sampled_from(places)) if places else None

    @rule(data=st.data(), active=st.booleans())
    def switch(self, data: st.DataObject, active: bool) -> None:
        if place := self.agent(data):
            self.all(lambda world: setattr(world.groups[place[0]][place[1]], "active", active))
            self.note(place, "", is_there=active)

    def note(self, place: tuple[int, int], part: str, *, is_there: bool) -> None:
        """Note what an agent's condition should be from now on."""
        member = int(self.worlds[0].groups[place[0]].bodies.member[place[1]])
        faults = self.faults.setdefault((place[0], member), set())
        (faults.discard if is_there else faults.add)(part)

    @rule(data=st.data(), works=st.booleans())
    def sensor(self, data: st.DataObject, works: bool) -> None:
        if place := self.agent(data):
            channel = data.draw(st.sampled_from(list(self.worlds[0].groups[place[0]].channels)))

            def deed(world: World) -> None:
                agent = world.groups[place[0]][place[1]]
                (agent.repair_sensor if works else agent.break_sensor)(channel)
                assert agent.sensor_works(channel) == works

            self.all(deed)
            self.note(place, channel, is_there=works)

    @rule(data=st.data(), place=ends)
    def move(self, data: st.DataObject, place: tuple[float, float]) -> None:
        if found := self.agent(data):
            self.all(lambda world: setattr(world.groups[found[0]][found[1]], "position", place))

    @rule(group=st.integers(0, 2), count=st.integers(1, 3))
    def arrive(self, group: int, count: int) -> None:
        if len(self.worlds[0].groups[group]) < 60:
            far = {"sensing_range": 1.0, "awareness_range": 0.8, "speed": 0.1}
            self.all(lambda world: world.groups[group].add(count, **far))

    @rule(data=st.data())
    def leave(self, data: st.DataObject) -> None:
        if place := self.agent(data):
            self.all(lambda world: world.groups[place[0]][place[1]].remove())

    @rule(data=st.data(), delay=st.sampled_from([0.0, 0.5, 2.0, 3.25]), active=st.booleans())
    def plan(self, data: st.DataObject, delay: float, active: bool) -> None:
        if place := self.agent(data):

            def event(world: World) -> None:
                group = world.groups[place[0]]
                if place[1] < len(group):
                    group[place[1]].active = active
                    if world is self.worlds[0]:
                        self.note(place, "", is_there=active)

            self.all(lambda world: world.clock.at(world.clock.now + delay, lambda: event(world)))

    @rule()
    def save(self) -> None:
        # Closures on the clock cannot be saved.
        self.saved = pickle.loads(pickle.dumps(self.state_of(self.worlds[0])))
        self.saved_shares, self.saved_faults = list(self.shares), copy.deepcopy(self.faults)

    def state_of(self, world: World) -> Any:
        """Return the state of a world, without what is planned."""
        return world.state(pending="drop")

    @rule()
    def restore(self) -> None:
        # Those who have come since leave, and those who have left come back.
        self.all(lambda world: world.restore(self.saved))
        self.shares, self.faults = list(self.saved_shares), copy.deepcopy(self.saved_faults)

    @rule(seed=st.one_of(st.none(), st.integers(0, 9)))
    def reset(self, seed: int | None) -> None:
        self.all(lambda world: world.reset(seed))
        self.shares, self.faults = [], {}

    @rule(steps=st.integers(1, 6))
    def advance(self, steps: int) -> None:
        run, stepped, mixed = self.worlds
        run.run(steps)
        for _ in range(steps):
            before = {agent.unique_id: agent.position.copy() for agent in stepped.agents}
            stepped.step()
            still = [agent for agent in stepped.agents if not agent.active]
            assert all((agent.position == before[agent.unique_id]).all() for agent in still)
            assert not any(agent.group.bodies.moved[agent.row].any() for agent in still)
            self.shares.append(shares_by_hand(stepped))
        mixed.step()
        mixed.run(steps - 1)

    def check(self, world: World) -> None:
        """Check one world."""
        assert len(world.recording.history) == len(self.shares) == world.tick
        for number, group in enumerate(world.groups):
            check_rows(group)
            for row, member in enumerate(group.bodies.member.tolist()):
                faults = {"" for active in group.active[[row]] if not active}
                faults |= {name for name, channel in group.channels.items() if not channel.works[row]}
                assert faults == self.faults.get((number, member), set())
            assert world.arena.contains(group.position).all()
            check_relayed(world, group)
            for channel in group.channels:
                check_lists(world, group, channel)

    @precondition(lambda self: hasattr(self, "worlds"))
    @invariant()
    def are_sound_and_alike(self) -> None:
        # The first world searches again, the others have changed their lists.
        self.worlds[0]._engine.is_seen = False
        found = [facts(world) for world in self.worlds]
        assert found[0] == found[1] == found[2]
        self.check(self.worlds[0])
        history = self.worlds[0].recording.history
        wanted = np.array(self.shares).reshape(-1, 2)
        assert np.allclose(history[["observed", "mean_neighbours"]], wanted, rtol=1e-12, atol=0, equal_nan=True)
        there = wanted[:, 0][~np.isnan(wanted[:, 0])]
        assert np.isclose(self.worlds[0].observed_fraction, there.mean() if len(there) else np.nan, equal_nan=True)

    def teardown(self) -> None:
        for world in getattr(self, "worlds", []):
            world.close()


def facts(world: World) -> list[Any]:
    """Return all that can be read of a world, to the last bit."""
    seen: list[Any] = [world.tick, repr((world.observed, world.mean_degree)), world.max_neighbours]
    seen += [repr((world.observed_fraction, world.recording.mean_neighbours)), len(world.agents), repr(world)]
    for group in world.groups:
        arrays = [group.position, group.heading, group.bodies.moved, group.active, group.identity]
        for channel in group.channels:
            arrays += [*group.neighbours(channel), group.channels[channel].works]
        if len(group):
            percept = group[0].percept
            arrays += [percept.targets.distance, percept.teammates.distance, percept.relayed.distance, group[0].situation]
        seen += [np.asarray(array).tobytes() for array in arrays]
    tables = world.recording.history, world.recording.trajectory, world.datacollector.get_model_vars_dataframe()
    return [*seen, *(table[name].to_numpy(float).tobytes() for table in tables for name in table if name != "group")]


def check_rows(group: Any) -> None:
    """Check that rows, agents and arrays of a group belong together."""
    size = len(group)
    assert [agent.row for agent in group] == list(range(size))
    assert [agent.unique_id for agent in group] == group.bodies.identity.tolist()
    assert len(set(group.bodies.member.tolist())) == size
    assert [agent.active for agent in group] == group.active.tolist()
    assert {len(array) for array in (group.active, *(channel.works for channel in group.channels.values()))} == {size}


def check_lists(world: World, group: Any, channel: str) -> None:
    """Check that the lists of a group show all that they must, and nobody who is inactive."""
    active = {agent.unique_id for other in group.channels[channel].observed for agent in other if agent.active}
    relation, shown = group.relations[channel], group.neighbours(channel)
    for row, (certain, possible) in enumerate(lists_by_hand(world, group, channel)):
        in_range = {agent.unique_id for agent in relation.agents(relation.graph.start, relation.graph.identity, row)}
        assert certain <= in_range <= possible
        sensed = {agent.unique_id for agent in relation.agents(*relation.true_lists, row)}
        assert sensed <= in_range
        in_percept = set(shown.identity[shown.start[row] : shown.start[row + 1]].tolist())
        assert in_percept <= active
        if not (group.active[row] and group.channels[channel].works[row]):
            assert not in_percept
        elif group.channels[channel].sensor is None:
            assert sensed == in_range == in_percept


def check_relayed(world: World, group: Any) -> None:
    """Check that nobody who is inactive is relayed, or relays."""
    if len(group):
        assert group[0].percept is not None
        relayed = group.percept.relayed
        assert set(relayed.identity.tolist()) <= {agent.unique_id for agent in world.agents if agent.active}
        assert not np.diff(relayed.start)[~group.active].any()
