"""Teammates that are known late: what they sensed and where they faced is as old as where they were."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight import Disc, Robot, Sensor, Target, World
from teamsight.agents.engine.detection import RelayReadings
from tests.sensed_worlds import assert_one_answer, herd, percept_of, shown

DELAY = 3


def _world(**sensor: float) -> World:
    world = World(Disc(2.5), rng=3)
    robots = world.add(Robot, 8, policy="random-walk", awareness="shared")
    world.senses(robots, world.add(Target, 10, policy="random-walk", speed=0.1))
    if sensor:
        robots.sensors["teammates"] = Sensor(**sensor)  # type: ignore[arg-type]
    return world


def test_relayed_targets_and_teammates_are_equally_old() -> None:
    exact, late = _world(), _world(delay=DELAY)
    seen = []
    entries = 0
    for tick in range(20):
        percept = percept_of(exact.groups[0])
        seen.append([shown(percept.teammates), shown(percept.relayed), percept.relayed.start.tolist()])
        percept = percept_of(late.groups[0])
        entries += len(percept.relayed.identity)
        found = [shown(percept.teammates), shown(percept.relayed), percept.relayed.start.tolist()]
        assert found == (seen[tick - DELAY] if tick >= DELAY else [[{}] * 8, [{}] * 8, [0] * 9])
        for world in (exact, late):
            world.step()
    assert entries > 50


def test_situations_show_what_teammates_sensed_relative_to_their_heading_then() -> None:
    exact, late = _world(), _world(delay=DELAY)
    seen = []
    for tick in range(12):
        seen.append([robot.situation[16:] for robot in exact.groups[0]])
        found = [robot.situation[16:] for robot in late.groups[0]]
        if tick >= DELAY:
            np.testing.assert_array_equal(found, seen[tick - DELAY])
            assert np.min(found) < 1
        else:
            assert np.min(found) == 1
        for world in (exact, late):
            world.step()


def test_a_teammate_that_is_missed_relays_nothing() -> None:
    world = _world(missed=0.5)
    world.run(20)
    robots = world.groups[0]
    percept = percept_of(robots)
    targets = shown(percept.targets)
    row_of = {robot.unique_id: robot.row for robot in robots}
    for i in range(len(robots)):
        mine = percept.teammates.identity[percept.teammates.start[i] : percept.teammates.start[i + 1]]
        wanted = [target for mate in mine.tolist() for target in targets[row_of[mate]]]
        begin, end = percept.relayed.start[i : i + 2]
        assert percept.relayed.identity[begin:end].tolist() == wanted
    missed = [{mate.unique_id for mate in robot.neighbours} - set(shown(percept.teammates)[robot.row]) for robot in robots]
    assert any(missed)


@pytest.mark.parametrize("sensors", [{"teammates": Sensor(delay=4, missed=0.2), "targets": Sensor(delay=1)}])
def test_all_paths_give_one_result(sensors: dict[str, Sensor]) -> None:
    assert_one_answer(lambda: herd(sensors))


def test_who_leaves_and_who_joins_is_known_late() -> None:
    world, robots = (made := _world(delay=DELAY)), made.groups[0]
    world.run(10)
    gone = robots[2]
    before = shown(percept_of(robots).relayed)
    gone.remove()
    after = shown(percept_of(robots).relayed)
    # Of the others nothing changes, and what has left is dropped with what it sensed.
    assert sum(map(len, before)) >= sum(map(len, after))
    robots.add(2)
    world.run(DELAY - 1)
    world.run(5)
    assert len(percept_of(robots).relayed.start) == 10


def test_the_delay_can_be_switched_in_a_run() -> None:
    world, exact = _world(delay=DELAY), _world()
    robots = world.groups[0]
    for each in (world, exact):
        each.run(10)
    del robots.sensors["teammates"]
    assert shown(percept_of(robots).relayed) == shown(percept_of(exact.groups[0]).relayed)
    assert not any(isinstance(kept, RelayReadings) for kept in robots.readings.values())
    robots.sensors["teammates"] = Sensor(delay=2)
    world.run(4)
    exact.run(2)
    assert shown(percept_of(robots).relayed) == shown(percept_of(exact.groups[0]).relayed)
