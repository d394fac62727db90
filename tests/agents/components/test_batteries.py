"""Batteries: exact bookkeeping, and what happens when they are low or empty."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import Disc, Robot, Target, World
from teamsight.agents import AgentLeftError
from teamsight.agents.components import Batteries, Failures, Times
from teamsight.agents.events import EventSource


def make(*sources: EventSource, robots: int = 6, seed: int = 1) -> World:
    world = World(Disc(3.0), rng=seed)
    team = world.add(Robot, robots, policy="a-cmommt", awareness="pairwise")
    world.senses(team, world.add(Target, 6, policy="random-walk", speed=0.075))
    for source in sources:
        world.attach(source, team)
    return world


def times(world: World, what: str) -> dict[int, float]:
    log = world.events
    return {row.agent: row.time for row in log[log["what"] == what].itertuples()}


@settings(max_examples=15, deadline=None)
@given(
    capacity=st.floats(0.5, 5), per_distance=st.floats(0, 2), per_tick=st.floats(0, 0.1),
    per_decision=st.floats(0.001, 0.1), seed=st.integers(0, 2**31), steps=st.lists(st.integers(1, 9), max_size=8),
)  # fmt: skip
def test_the_charge_is_the_capacity_less_the_drains(
    capacity: float, per_distance: float, per_tick: float, per_decision: float, seed: int, steps: list[int]
) -> None:
    batteries = Batteries(capacity, per_distance, per_tick, per_decision)
    world, twin = make(batteries, seed=seed), make(batteries, seed=seed)
    robots = twin.groups[0]
    charge = [capacity] * 6
    for count in steps:
        world.run(count)
        for _ in range(count):
            twin.step()
            for i in range(6):
                x, y = robots.bodies.moved[i].tolist()
                drain = per_tick + per_decision + per_distance * math.sqrt(x * x + y * y)
                charge[i] -= drain if robots[i].active else 0.0
                charge[i] = charge[i] if charge[i] > 1e-9 * capacity else 0.0
            assert robots.battery.tolist() == charge  # type: ignore[attr-defined]
        # One call of many steps gives the same, and so do the events.
        assert world.groups[0].battery.tolist() == charge  # type: ignore[attr-defined]
        assert world.events.equals(twin.events)


def test_only_decisions_drain_per_decision() -> None:
    world = make()
    robots = world.groups[0]
    robots.cycle = 4
    world.attach(Batteries(10.0, 0.0, per_tick=0.125, per_decision=0.5), robots)
    charge, seen = 10.0, []
    for tick in range(12):
        charge -= 0.125 + (0.5 if tick % 4 == 0 else 0.0)
        world.step()
        seen.append(robots.battery.tolist() == [charge] * 6)  # type: ignore[attr-defined]
    assert all(seen)
    world.reset()
    world.run(12)
    assert robots.battery.tolist() == [charge] * 6  # type: ignore[attr-defined]


def test_an_empty_battery_stops_a_robot_until_it_is_charged() -> None:
    world = make(Batteries(1.0, 0.0, per_tick=0.1, low_level=0.35))
    robots = world.groups[0]
    robots[1].battery = 0.5
    world.run(30)
    assert not robots.active.any()
    assert times(world, "low") == {robot.unique_id: 2.0 if robot.row == 1 else 7.0 for robot in robots}
    assert times(world, "empty") == {robot.unique_id: 5.0 if robot.row == 1 else 10.0 for robot in robots}
    robots[2].battery = 0.25
    world.run(2)
    assert robots.active.tolist() == [robot.row == 2 for robot in robots]
    world.run(3)
    assert not robots.active.any()
    assert (world.events["what"] == "low").sum() == 6


def test_a_robot_that_has_failed_with_an_empty_battery_needs_both() -> None:
    world = make(Batteries(1.0, 0.0, per_tick=0.1), Failures(Times([5]), Times([20])))
    robots = world.groups[0]
    world.run(11)
    # A robot that has failed drains nothing.
    assert robots.battery.tolist() == [pytest.approx(0.5)] * 6  # type: ignore[attr-defined]
    robots[0].battery = 0.0
    world.run(15)
    assert robots.active.tolist() == [robot.row != 0 for robot in robots]
    robots[0].battery = 0.5
    world.sources[0].release(0)  # type: ignore[attr-defined]
    assert robots.active.all()


def test_processes_wait_for_batteries() -> None:
    world = make(Batteries(1.0, 0.0, per_tick=0.1))
    (batteries,) = world.sources
    robots = world.groups[0]
    seen = []

    def process(world: World):  # type: ignore[no-untyped-def]
        robot = yield batteries.low(robots[3])  # type: ignore[attr-defined]
        seen.append((world.clock.now, robot))
        robot = yield batteries.empty(robots[3])  # type: ignore[attr-defined]
        seen.append((world.clock.now, robot))
        yield batteries.empty(robots[3])  # type: ignore[attr-defined]
        seen.append((world.clock.now, robot))

    world.clock.process(process(world))
    world.run(30)
    assert seen == [(8.0, robots[3]), (10.0, robots[3]), (10.0, robots[3])]
    with pytest.raises(ValueError, match=r"Target.*has none of these batteries; give an agent of 'robots'"):
        batteries.low(world.groups[1][0])  # type: ignore[attr-defined]


def test_agents_that_come_and_leave_keep_their_charge() -> None:
    world = make(Batteries(1.0, 0.0, per_tick=0.1))
    robots = world.groups[0]
    world.run(4)
    robots.add(2)
    robots.add(1, battery=0.25)
    robots[1].remove()
    world.run(3)
    np.testing.assert_allclose(robots.battery, [0.3] * 5 + [0.7, 0.7, 0.0], atol=1e-12)  # type: ignore[attr-defined]
    world.run(1)
    assert robots.active.tolist() == [True] * 7 + [False]


def test_state_reset_and_paths_give_one_result() -> None:
    def made() -> World:
        return make(Batteries(4.0, per_distance=0.5, per_tick=0.02), Failures(60, 10), seed=4)

    one = made()
    one.run(150)
    assert {"low", "empty", "failed", "repaired"} <= set(one.events["what"])
    other = made()
    other.run(70)
    saved = pickle.loads(pickle.dumps(other.state()))
    other.run(20)
    other.restore(saved)
    other.run(80)
    third = made()
    third.restore(saved)
    third.run(80)
    fourth = made()
    fourth.run(31)
    fourth.reset()
    for _ in range(150):
        fourth.step()
    for world in (other, third, fourth):
        assert one.events.equals(world.events)
        assert one.groups[0].position.tobytes() == world.groups[0].position.tobytes()
        assert one.groups[0].battery.tolist() == world.groups[0].battery.tolist()  # type: ignore[attr-defined]


def test_detaching_leaves_nothing_behind() -> None:
    world = make(Batteries(1.0, 0.0, per_tick=0.1))
    world.run(20)
    (batteries,) = world.sources
    world.detach(batteries)
    robots = world.groups[0]
    assert robots.active.all()
    assert "battery" not in robots.columns
    world.run(20)
    world.attach(Batteries(2.0), robots)
    assert robots.battery.tolist() == [2.0] * 6  # type: ignore[attr-defined]


def test_wrong_values_are_refused() -> None:
    with pytest.raises(ValueError, match=r"per_distance=0, .*: nothing drains the batteries; give one"):
        Batteries(5, 0)
    with pytest.raises(ValueError, match=r"low_level=5: must be less than the capacity, 5"):
        Batteries(5, low_level=5)
    world = make(Batteries(5))
    with pytest.raises(ValueError, match=r"'battery': the group 'robots' has this column"):
        world.attach(Batteries(5), world.groups[0])
    assert len(world.sources) == 1
    world.run(1)


def test_states_from_before_and_after_it_was_attached() -> None:
    world = make()
    robots = world.groups[0]
    world.run(3)
    without = world.state()
    batteries = world.attach(Batteries(2.0, 0.0, per_tick=0.125), robots)
    world.run(3)
    attached = world.state()
    world.restore(without)
    assert "battery" not in robots.columns
    world.run(10)
    world.restore(attached)
    assert world.sources == (batteries,)
    assert robots.battery.tolist() == [1.625] * 6  # type: ignore[attr-defined]
    robots.add(1)
    world.run(1)
    assert robots.battery.tolist() == [1.5] * 6 + [1.875]  # type: ignore[attr-defined]
    world.run(20)
    assert not robots.active.any()


@pytest.mark.short
def test_waiting_for_the_battery_of_a_robot_that_leaves_raises_an_error() -> None:
    world = make(Batteries(1000))
    robots, (batteries,) = world.groups[0], world.sources
    gone, errors = robots[1], []

    def wait(event: Any) -> Any:
        try:
            yield event
        except AgentLeftError as error:
            errors.append((world.tick, str(error)))

    for event in (batteries.low(gone), batteries.empty(gone), world.until.battery_empty(gone)):  # type: ignore[attr-defined]
        world.clock.process(wait(event))
    # Nobody waits for this one, which must not stop the run.
    batteries.low(robots[2])  # type: ignore[attr-defined]
    world.clock.at(5, gone.remove)
    world.clock.at(6, robots[2].remove)
    world.run(10)
    assert [tick for tick, _ in errors] == [5, 5, 5]
    assert all("has left the world, and its battery with it" in text for _, text in errors)


@pytest.mark.short
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -3, 10.5, np.float64(1e9)])
def test_a_charge_that_no_battery_has_is_refused_and_changes_nothing(value: float) -> None:
    world = make(Batteries(10.0))
    robots: Any = world.groups[0]
    world.run(2)
    before = robots.battery.tolist()

    def in_place() -> None:
        robots.battery += value - robots.battery[0] if value == value else value

    def assign(name: str, given: Any) -> None:
        (robots if name == "battery" else robots[0]).battery = given

    for change in (
        lambda: assign("robot", value), lambda: assign("battery", value), lambda: assign("battery", [value, *[1.0] * 5]),
        lambda: robots.battery.__setitem__(slice(2, 4), value), in_place, lambda: np.add.at(robots.battery, [1], 100 * value),
        lambda: robots.add(1, battery=value),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r"battery=\S+: must be at least 0 and at most the capacity, 10; give min"):
            change()
        assert (robots.battery.tolist(), len(robots)) == (before, 6)
    robots[0].battery = 10
    robots.battery[1:3] = 0
    world.restore(world.state())
    with pytest.raises(ValueError, match="battery="):
        robots[0].battery = value
    world.detach(world.sources[0])
    robots.add_column("battery", 0.0)
    robots[0].battery = -1.0
