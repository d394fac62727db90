"""Users' processes wait for events of the world: observations, contacts, and conditions in Python."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Sensor, World

Process = Generator[Any, Any, None]
DIVISIONS: dict[str, Callable[[World, int], Any]] = {
    "run": lambda world, steps: world.run(steps),
    "step": lambda world, steps: [world.step() for _ in range(steps)],
    "parts": lambda world, steps: [world.run(3), world.step(), world.run(steps - 4)],
}
divisions = pytest.mark.parametrize("advance", DIVISIONS.values(), ids=DIVISIONS.keys())


def team() -> CMOMMT:
    return CMOMMT(rng=5, robots=4, targets=4, radius=2.0, policy="random-walk", robot_speed=0.3)


def script(model: CMOMMT, wait: Callable[[], Any], wait_again: Callable[[], Any], shown: Callable[[Any], Any]) -> list:
    """Let a process wait for one thing and its contrary in turn, and return its log."""
    log: list[Any] = []

    def follow() -> Process:
        while True:
            value = yield wait()
            log.append((model.tick, "begun", shown(value)))
            value = yield wait_again()
            log.append((model.tick, "ended", shown(value)))

    model.clock.process(follow())
    return log


def changes(model: CMOMMT, is_so: Callable[[], Any], steps: int) -> list[tuple[int, str, Any]]:
    """Return the same log from looking at the world after each step."""
    log, was = [], None
    for _ in range(steps):
        now = is_so()
        if bool(now) != bool(was):
            log.append((model.tick, "begun" if now else "ended", now))
        was = now
        model.step()
    return log


@pytest.mark.short
@divisions
def test_a_target_is_observed_and_lost_when_it_is(advance: Callable[[World, int], Any]) -> None:
    model, twin = team(), team()
    target, other = model.targets[0], twin.targets[0]
    until = model.until
    log = script(model, lambda: until.observed(target), lambda: until.lost(target), lambda value: value)
    advance(model, 300)
    expected = changes(twin, lambda: [robot.unique_id for robot in other.observers], 300)
    assert len(expected) > 3
    assert [entry[:2] for entry in log] == [entry[:2] for entry in expected]
    for (_, what, value), (*_, names) in zip(log, expected, strict=True):
        assert value is target if what == "ended" else [robot.unique_id for robot in value] == names
    assert np.array_equal(model.robots.position, twin.robots.position)


@pytest.mark.short
@divisions
def test_a_contact_with_one_or_any_teammate_begins_and_ends_when_it_does(advance: Callable[[World, int], Any]) -> None:
    model, twin = team(), team()
    robots, until = model.robots, model.until
    log = script(
        model, lambda: until.contact(robots[0], robots[2]), lambda: until.contact_ended(robots[0], robots[2]),
        lambda value: value is robots[2],
    )  # fmt: skip
    any_log = script(model, lambda: until.contact(robots[1]), lambda: until.contact_ended(robots[1]), lambda value: value)
    advance(model, 300)
    expected = changes(twin, lambda: twin.robots[2] in twin.robots[0].neighbours, 300)
    assert log == [(tick, what, True) for tick, what, _ in expected]
    assert len(log) > 3
    twin = team()
    expected = changes(twin, lambda: twin.robots[1].neighbours, 300)
    assert [entry[:2] for entry in any_log] == [entry[:2] for entry in expected]
    assert [value and value.unique_id for *_, value in any_log] == [
        found[0].unique_id if found else None for *_, found in expected
    ]
    assert len(any_log) > 3


@pytest.mark.short
@divisions
def test_contacts_in_other_channels_are_what_is_sensed(advance: Callable[[World, int], Any]) -> None:
    model, twin = team(), team()
    for world in (model, twin):
        world.robots.sensors["targets"] = Sensor(missed=0.3)
    robot, target = model.robots[0], model.targets[1]
    log = script(
        model, lambda: model.until.contact(robot, target, "targets"),
        lambda: model.until.contact_ended(robot, target, "targets"), lambda value: value is target,
    )  # fmt: skip
    advance(model, 300)
    expected = changes(twin, lambda: twin.targets[1] in twin.robots[0].observed_targets, 300)
    assert log == [(tick, what, True) for tick, what, _ in expected]
    assert len(log) > 3


@pytest.mark.short
@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
@divisions
def test_a_condition_in_python_is_tested_after_each_step(advance: Callable[[World, int], Any]) -> None:
    model, twin = team(), team()
    log = script(
        model, lambda: model.until(lambda: model.observed > 0.5), lambda: model.until(lambda: model.observed <= 0.5),
        lambda value: value,
    )  # fmt: skip
    advance(model, 300)
    expected = changes(twin, lambda: twin.observed > 0.5, 300)
    assert log == [(tick, what, True) for tick, what, _ in expected]
    assert len(log) > 3

