"""The contact log agrees with neighbour lists read after each step, on both paths, through all that changes groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Box, Robot, Sensor, Target, World
from teamsight.agents.events.contact_log import ContactLog, observations

Row = tuple[int, bool, int, int]


def rows(log: ContactLog) -> list[Row]:
    contacts = log.contacts
    arrays = (contacts.tick, contacts.begun, contacts.observer, contacts.observed)
    return list(zip(*(array.tolist() for array in arrays), strict=True))


class Twin:
    """The same log from sets of pairs that are read when the log looks: before the first step and after each."""

    def __init__(self, world: World, group: Any, channel: str) -> None:
        self.world, self.group, self.channel = world, group, channel
        self.seen: set[tuple[int, int]] = set()
        self.log: list[Row] = []

    def look(self) -> None:
        now = {
            (robot.unique_id, other.unique_id)
            for robot in self.group
            for other in (robot.neighbours if self.channel == "teammates" else robot.sensed(self.channel))
        }
        tick = self.world.tick
        self.log += [(tick, False, *pair) for pair in self.seen - now] + [(tick, True, *pair) for pair in now - self.seen]
        self.seen = now


def in_order(log: Iterable[Row]) -> list[Row]:
    return sorted(log, key=lambda row: (row[0], row[2], row[3], row[1]))


def team(sensor: Sensor | None = None, policy: Any = "random-walk") -> CMOMMT:
    model = CMOMMT(rng=4, robots=6, targets=5, radius=2.0, policy=policy, robot_speed=0.3, target_speed=0.2)
    if sensor:
        model.robots.sensors["targets"] = sensor
    return model


DIVISIONS: dict[str, Callable[[World], Any]] = {
    "run": lambda world: world.run(120),
    "step": lambda world: [world.step() for _ in range(120)],
    "parts": lambda world: [world.run(50), world.step(), world.run(69)],
}


@pytest.mark.short
@pytest.mark.parametrize("advance", DIVISIONS.values(), ids=DIVISIONS.keys())
@pytest.mark.parametrize(("channel", "sensor"), [("teammates", None), ("targets", None), ("targets", Sensor(missed=0.3))])
def test_the_log_is_what_the_neighbour_lists_show(advance: Any, channel: str, sensor: Sensor | None) -> None:
    model, other = team(sensor), team(sensor)
    log = model.log_contacts(model.robots, channel)
    twin = Twin(other, other.robots, channel)
    twin.look()
    for _ in range(120):
        other.step()
        twin.look()
    advance(model)
    found = rows(log)
    assert found == in_order(twin.log)
    assert len(found) > 20
    assert (log.contacts.since, log.contacts.until) == (0, 120)
    assert np.array_equal(model.robots.position, other.robots.position)
    assert model.contacts.tick.tolist() == [row[0] for row in found]


def test_the_log_works_with_a_policy_in_python() -> None:
    def ahead(percept: Any, rng: Any) -> tuple[float, float]:
        return rng.uniform(-1, 1), 0.3

    model, other = team(policy=ahead), team(policy=ahead)
    log, twin = model.log_contacts(model.robots), Twin(other, other.robots, "teammates")
    twin.look()
    for _ in range(40):
        other.step()
        twin.look()
    with pytest.warns(UserWarning, match="is Python"):
        model.run(40)
    assert rows(log) == in_order(twin.log)
    assert rows(log) != []


CHANGES = ("remove", "add", "move", "switch", "range", "crowd", "reset", "group", "off", "on")


@settings(max_examples=15, deadline=None)
@given(plan=st.lists(st.tuples(st.integers(0, 9), st.sampled_from(CHANGES), st.integers(0, 99)), max_size=8))
def test_the_log_survives_all_that_changes_groups(plan: list[tuple[int, str, int]]) -> None:
    worlds = [World(Box(4, 4), rng=2) for _ in range(2)]
    logs = []
    for world in worlds:
        robots = world.add(Robot, 4, policy="random-walk", speed=0.4)
        world.senses(robots, world.add(Target, 2, policy="stationary"))
        logs.append((world.log_contacts(robots), world.log_contacts(robots, "targets")))

    def change(world: World, what: str, pick: int) -> None:
        robots, others = world.groups[:2]
        group = (robots, others)[pick % 2]
        if what == "remove" and len(group) > 1:
            group[pick % len(group)].remove()
        elif what in ("add", "crowd"):
            group.add(20 if what == "crowd" else 1, awareness_range=1.0)
        elif what == "move":
            group[pick % len(group)].position = (pick % 4 - 1.5, 1)
        elif what == "switch":
            world.adjust(robots, policy="stationary" if pick % 2 else "random-walk")
        elif what == "range":
            world.adjust(robots, awareness_range=0.3 + pick / 40)
        elif what in ("off", "on"):
            group[pick % len(group)].active = what == "on"
        elif what == "reset":
            world.reset(pick)
        elif what == "group":
            world.add(Robot, 1, policy="stationary", name=f"more {len(world.groups)}")

    compiled, stepped = worlds
    twins = [Twin(stepped, stepped.groups[0], channel) for channel in ("teammates", "targets")]
    for steps, what, pick in [*plan, (5, "none", 0)]:
        compiled.run(steps)
        for _ in range(steps):
            for twin in twins:
                twin.look()
            stepped.step()
            for twin in twins:
                twin.look()
        for world in worlds:
            change(world, what, pick)
        if what == "reset":
            for twin in twins:
                twin.seen, twin.log = set(), []
    for twin, mine, other in zip(twins, *logs, strict=True):
        assert rows(mine) == rows(other)
        assert in_order(rows(mine)) == in_order(twin.log)


@pytest.mark.short
def test_a_state_holds_the_log() -> None:
    model = team()
    log = model.log_contacts(model.robots, "targets")
    model.run(60)
    saved = model.state()
    model.run(60)
    whole = rows(log)
    model.restore(saved)
    assert rows(log) == [row for row in whole if row[0] <= 60]
    model.run(60)
    assert rows(log) == whole
    other = team()
    copy = other.log_contacts(other.robots, "targets")
    other.restore(saved)
    other.run(60)
    assert rows(copy) == whole
    model.reset()
    model.run(120)
    assert rows(log) == whole


@pytest.mark.short
def test_a_state_brings_back_the_contacts_of_those_that_left() -> None:
    model = team()
    log = model.log_contacts(model.robots)
    model.run(60)
    saved = model.state()
    model.run(60)
    whole = rows(log)
    model.restore(saved)
    kept = [model.robots[1], model.robots[3]]
    for robot in kept:
        robot.remove()
    model.robots.add(2)
    model.run(10)
    model.restore(saved)
    model.run(60)
    assert rows(log) == whole


@pytest.mark.short
def test_a_log_that_begins_later_begins_with_the_present_contacts() -> None:
    model = team()
    model.run(50)
    log = model.log_contacts(model.robots)
    before = {(robot.unique_id, other.unique_id) for robot in model.robots for other in robot.neighbours}
    assert model.log_contacts(model.robots) is log
    model.run(1)
    assert {row[2:] for row in rows(log) if row[0] == 50} == before != set()
    assert log.contacts.since == 50
    model.detach(log)
    logged = rows(log)
    model.run(60)
    assert rows(log) == logged
    assert model._data.watchers == []
    assert len(model.contacts) == 0


@pytest.mark.short
def test_an_inactive_robot_has_no_contacts() -> None:
    world = World(Box(9, 9), rng=1)
    robots = world.add(Robot, 2, policy="stationary", position=[(0, 0), (0.5, 0)])
    log = world.log_contacts(robots)
    first, second = (robot.unique_id for robot in robots)
    world.clock.at(3, lambda: setattr(robots[0], "active", False))
    world.clock.at(7, lambda: setattr(robots[0], "active", True))
    world.run(10)
    both = [(first, second), (second, first)]
    assert rows(log) == [(tick, begun, *pair) for tick, begun in ((0, True), (3, False), (7, True)) for pair in both]


@pytest.mark.short
def test_observations_are_the_times_at_which_a_target_has_an_observer() -> None:
    model, other = team(), team()
    found = observations([model.log_contacts(model.robots, "targets")])
    assert len(found.tick) == 0
    model.run(120)
    found = observations([model.log_contacts(model.robots, "targets")])
    was, expected = dict.fromkeys((target.unique_id for target in other.targets), False), []
    for _ in range(121):
        for target in other.targets:
            if target.is_observed != was[target.unique_id]:
                was[target.unique_id] = target.is_observed
                expected.append((other.tick, target.is_observed, target.unique_id))
        other.step()
    assert list(zip(*(array.tolist() for array in found), strict=True)) == expected
    assert len(expected) > 10


@pytest.mark.short
def test_contacts_and_observations_are_rows_of_the_event_log_in_order() -> None:
    model = team()
    friends, sightings = model.log_contacts(model.robots), model.log_contacts(model.robots, "targets")
    gone = model.targets[2]
    model.clock.at(30.5, gone.remove)
    model.clock.at(40, lambda: model.log("inspected", model.robots[0]))
    model.run(120)
    events = model.events
    assert events.time.is_monotonic_increasing
    for log, channel in ((friends, "teammates"), (sightings, "targets")):
        mine = events[events.channel == channel]
        begun = mine.what == "contact begun"
        assert list(zip(mine.tick, begun, mine.agent, mine.other, strict=True)) == rows(log)
        assert set(mine.group) == {"robots"}
    seen = events[events.what.isin(["observed", "not observed"])]
    expected = observations([sightings])
    assert seen.agent.tolist() == expected.observed.tolist()
    assert (seen.what == "observed").tolist() == expected.begun.tolist()
    assert set(seen.group) == {"targets"}
    assert gone.unique_id in set(seen.agent)
    assert events[events.what == "inspected"].time.tolist() == [40.0]
    at = events.index[events.what == "inspected"][0]
    assert (events.time[at + 1 :] > 40).all()


@pytest.mark.short
def test_wrong_arguments_are_named() -> None:
    model = CMOMMT(rng=1)
    with pytest.raises(ValueError, match="channel='beacons': the group 'robots' has no such channel, but 'teammates', 'targets'"):
        model.log_contacts(model.robots, "beacons")
    with pytest.raises(ValueError, match="must be a group that was added to this world"):
        model.log_contacts(CMOMMT(rng=1).robots)
    with pytest.raises(AttributeError, match="contacts=3: cannot be set"):
        model.contacts = 3  # type: ignore[misc, assignment]
    assert model.sources == ()
    assert model._data.watchers == []


@pytest.mark.short
def test_a_model_can_be_made_with_a_contact_log() -> None:
    model = CMOMMT(rng=1, radius=2.0, events=[ContactLog()])
    model.run(10)
    assert model.log_contacts(model.robots) is model.sources[0]
    assert len(model.contacts) > 0


def test_a_log_that_a_state_brings_back_goes_on() -> None:
    world, twin = (CMOMMT(rng=3, robots=6, targets=6, radius=3.0) for _ in range(2))
    log = world.log_contacts(world.robots, "targets")
    whole = twin.log_contacts(twin.robots, "targets")
    world.run(20)
    state = world.state()
    world.detach(log)
    world.run(5)
    world.restore(state)
    world.run(60)
    twin.run(80)
    np.testing.assert_array_equal(log.rows, whole.rows)
