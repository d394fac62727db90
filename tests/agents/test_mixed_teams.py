"""Mixed teams: groups with different bodies, sensors, degrees, policies and events in one world, on all paths."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import pytest

from teamsight import Box, Circle, Cycle, Robot, Sensor, Target, World
from teamsight.agents.components import Batteries, Failures, SensorDropouts
from teamsight.policies import ACmommt, PerceptOfOne

STEPS = 60


class Alone(Robot):
    """Decides by itself what the policy of its group decides."""

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        return super().decide(percept, rng)


def zigzag(percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
    """Go to the nearest target if there is one, and otherwise about."""
    if len(percept.targets.distance):
        x, y = percept.targets.offset[np.argmin(percept.targets.distance)]
        return math.atan2(y, x) - math.atan2(percept.heading[1], percept.heading[0]), 0.05
    return rng.uniform(-0.5, 0.5), 0.1 + 0.01 * len(percept.teammates.distance)


def guard(world: World, robot: Any) -> Generator[Any, Any, None]:
    """Slow a robot down for a time after it has sensed a target, and log it."""
    while True:
        target = yield world.until.contact(robot, channel="targets")
        world.log("arrived", robot, at=target.unique_id)
        robot.speed = 0.02
        yield world.until.contact_ended(robot, target, "targets") | world.clock.timeout(15)
        robot.speed = 0.2


def mixed(made: type[Robot] = Robot, policy: Any = "random-walk", *, events: bool = True) -> World:
    """Return a world of three groups on two teams, with everything different, and two groups that they observe."""
    world = World(Box(6, 6).with_obstacles(Circle((1, 1), 0.5)), rng=7)
    scouts = world.add(
        made, 5, policy=ACmommt(idle="wander"), awareness="ring", speed=[0.1, 0.2, 0.1, 0.3, 0.1],
        sensing_range=[1.0, 0.5, 1.5, 1.0, 0.7], awareness_range=2.0, turn_limit=0.6, name="scouts",
        cycle=Cycle([1.0, 1.5, 2.0, 3.0, 5.0], phase="random", jitter=0.5),
    )  # fmt: skip
    haulers = world.add(
        Robot, 4, policy=policy, awareness="pairwise", awareness_range=[1.0, 3.0, 0.5, 2.0], speed=0.15, name="haulers"
    )
    rivals = world.add(made, 3, policy="evolved", awareness="ring", team="rivals", speed=0.2, name="rivals")
    rivals[1].cycle = 3
    prey = world.add(Target, 6, policy="evasive", speed=0.08, sensing_range=0.8, name="prey")
    prey.cycle = Cycle(4, delay=2)
    stones = world.add(Target, 3, policy="stationary", name="stones")
    world.senses(scouts, prey, sensor=Sensor(field_of_view=2.0, missed=0.1))
    world.senses(haulers, prey)
    world.senses(haulers, stones)
    world.senses(rivals, prey, sensor=Sensor(range_noise=0.05, delay=2))
    world.senses(scouts, rivals, as_="rivals", sensor=Sensor(range=1.0))
    world.senses(prey, scouts)
    world.senses(prey, rivals)
    scouts.sensors["teammates"] = Sensor(bearing_noise=0.1)
    if events:
        world.attach(Failures(40, 10), scouts)
        world.attach(SensorDropouts(30, 5, channel="targets"), haulers)
        world.attach(Batteries(4.0, per_decision=0.01), rivals)
        world.clock.process(guard(world, haulers[1]))
        world.clock.process(guard(world, scouts[2]))
        world.log_contacts(scouts)
        world.log_contacts(haulers, "targets")
    return world


def fingerprint(world: World) -> list[Any]:
    """Return all that could differ between two ways to make the same run."""
    arrays = [array for group in world.groups for array in (group.position, group.heading, group.speed, group.active)]
    tables = world.recording.history, world.events.astype(str), world.contacts
    return [*(array.tobytes() for array in arrays), *(table.to_csv() for table in tables), world.observed_fraction]


DIVISIONS: dict[str, Callable[[World], Any]] = {
    "step": lambda world: [world.step() for _ in range(STEPS)],
    "parts": lambda world: [world.run(7), world.step(), world.run(1), world.run(STEPS - 9)],
}


@pytest.fixture(scope="module")
def compiled() -> list[Any]:
    world = mixed()
    world.run(STEPS)
    assert world.path == "compiled"
    assert {"failed", "repaired", "low", "arrived"} <= set(world.events.what)
    assert len(world.contacts) > 20
    return fingerprint(world)


@pytest.mark.short
@pytest.mark.parametrize("division", DIVISIONS)
def test_mixed_teams_do_the_same_step_by_step(division: str, compiled: list[Any]) -> None:
    world = mixed()
    DIVISIONS[division](world)
    assert fingerprint(world) == compiled


@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_groups_that_decide_robot_by_robot_do_the_same_beside_compiled_groups() -> None:
    world, twin = mixed(Alone), mixed()
    world.run(30)
    twin.run(30)
    for group, same in zip(world.groups, twin.groups, strict=True):
        # An action of one robot is an angle, from which its heading differs in the last bits.
        assert np.allclose(group.position, same.position, atol=1e-9)
    assert world.events.what.tolist() == twin.events.what.tolist()


@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
@pytest.mark.parametrize("division", DIVISIONS)
def test_one_policy_in_python_among_compiled_ones_does_the_same_however_it_is_run(division: str) -> None:
    whole, parts = mixed(policy=zigzag), mixed(policy=zigzag)
    whole.run(STEPS)
    DIVISIONS[division](parts)
    assert fingerprint(parts) == fingerprint(whole)


@pytest.mark.short
def test_a_mixed_world_goes_back_to_a_state_and_to_its_start(compiled: list[Any]) -> None:
    quiet = mixed()
    quiet.run(30)
    saved = quiet.state(pending="drop")
    quiet.restore(saved)
    quiet.run(30)
    after = fingerprint(quiet)
    quiet.restore(saved)
    quiet.step()
    quiet.run(29)
    assert fingerprint(quiet) == after
    again = mixed()
    again.restore(saved)
    again.run(30)
    assert fingerprint(again) == after
    quiet.reset()
    # That of one robot is not a setting of its group.
    quiet.groups[2][1].cycle = 3
    scouts, haulers = quiet.groups[:2]
    quiet.clock.process(guard(quiet, haulers[1]))
    quiet.clock.process(guard(quiet, scouts[2]))
    quiet.run(STEPS)
    assert fingerprint(quiet) == compiled


@pytest.mark.short
def test_a_team_of_several_groups_is_one_team_and_another_is_not() -> None:
    world = mixed(events=False)
    scouts, haulers, rivals = world.groups[:3]
    for group, ranges in ((scouts, [2.0] * 5), (haulers, [1.0, 3.0, 0.5, 2.0])):
        for robot, reach in zip(group, ranges, strict=True):
            others = [other for other in [*scouts, *haulers] if other is not robot]
            near = {other for other in others if math.dist(other.position, robot.position) <= reach}
            assert set(robot.neighbours) == near
    assert all(set(robot.neighbours) <= set(rivals) for robot in rivals)
    # Degrees show what they show, whatever the rest of the team has.
    world.adjust(scouts, awareness="none")
    assert len(haulers.percept.teammates.identity) == sum(len(robot.sensed("teammates")) for robot in haulers)


def test_degrees_of_the_others_change_no_number_of_neighbours_of_robots_that_ignore_them() -> None:
    counts = []
    for awareness in ("none", "ring", "shared"):
        world = mixed(policy="random-walk", events=False)
        world.adjust(world.groups[1], awareness=awareness)
        world.run(STEPS)
        counts.append(world.recording.history.mean_neighbours.to_numpy())
    assert np.array_equal(counts[0], counts[1])
    assert np.array_equal(counts[0], counts[2])


def test_what_nobody_senses_changes_nothing_for_the_others() -> None:
    plain, more = mixed(events=False), mixed(events=False)
    more.add(Target, 5, policy="random-walk", name="clouds")
    plain.run(STEPS)
    more.run(STEPS)
    for group, same in zip(plain.groups, more.groups, strict=False):
        assert np.array_equal(group.position, same.position)
