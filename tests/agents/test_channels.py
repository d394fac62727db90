"""Channels: what a group senses, by name."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight import Box, Robot, Target, World, check_policy
from teamsight.agents.body import Body
from teamsight.agents.sensing import Sensor
from teamsight.core.kernel import kernel
from teamsight.policies import RandomWalk
from teamsight.policies.compiled import CompiledPolicy


@kernel
def _flee(percept, arrays, noise, action):
    predators = percept.channels.predators
    for i in range(percept.heading.shape[0]):
        x = 0.0
        y = 0.0
        for k in range(predators.start[i], predators.start[i + 1]):
            x -= predators.offset[k, 0]
            y -= predators.offset[k, 1]
        length = np.sqrt(x * x + y * y)
        action.heading[i, 0] = x / length if length > 0.0 else 0.0
        action.heading[i, 1] = y / length if length > 0.0 else 0.0
        action.distance[i] = percept.speed[i] + 0.001 * percept.channels.beacons.start[i + 1]


class Flee(CompiledPolicy):
    """Moves away from predators, in a kernel that reads two channels."""

    kernel = _flee
    channels = ("predators", "beacons")
    parameters = ()


class FleeInPython(Flee):
    """The same kernel, called from Python: the world makes its steps one by one."""

    def decide(self, percept, state, noise):
        assert percept.channels._fields[0] == "beacons"
        return super().decide(percept, state, noise)


def hunt(policy, seed=3):
    world = World(Box(4, 3), rng=seed)
    robots = world.add(Robot, 6, policy=policy, name="prey", speed=0.05)
    predators = world.add(Target, 3, policy=RandomWalk(0.2), name="predators")
    beacons = world.add(Body, 4, policy="stationary", name="beacons")
    world.senses(robots, beacons, as_="beacons", sensor=Sensor(range=2.0))
    world.senses(robots, predators, as_="predators")
    world.senses(predators, robots)
    return world, robots, predators, beacons


def test_a_kernel_reads_the_channels_that_it_declares_on_both_paths():
    check_policy(Flee())
    compiled, robots, *_ = hunt(Flee())
    compiled.run(40)
    stepped, others, *_ = hunt(FleeInPython())
    with pytest.warns(UserWarning, match="one by one"):
        stepped.run(40)
    np.testing.assert_array_equal(robots.position, others.position)
    again, third, *_ = hunt(Flee())
    for _ in range(40):
        again.step()
    np.testing.assert_array_equal(robots.position, third.position)
    assert compiled.recording.history.equals(again.recording.history)


def test_channels_show_who_is_in_range():
    _, robots, predators, beacons = hunt(Flee())
    percept = robots[0].percept
    for name, group, reach in (("predators", predators, 1.0), ("beacons", beacons, 2.0)):
        way = group.position - robots[0].position
        near = np.hypot(*way.T) <= reach
        np.testing.assert_array_equal(getattr(percept.channels, name).identity, group.identity[near])
        assert robots[0].sensed(name) == [agent for agent, is_near in zip(group, near, strict=True) if is_near]
    assert percept.targets.identity.size == 0
    assert all(robot.observers == [p for p in predators if robot in p.sensed("targets")] for robot in robots)


def test_what_counts_as_observed_is_declared():
    """Robots that sense beacons too have the same observed fraction."""
    fractions = []
    for declare in (
        lambda world, robots, beacons: None,
        lambda world, robots, beacons: world.senses(robots, beacons, as_="beacons"),
        lambda world, robots, beacons: world.senses(robots, beacons, as_="beacons", counts=True),
    ):
        world = World(Box(6, 6), rng=1)
        robots = world.add(Robot, 5, policy="random-walk")
        prey = world.add(Target, 10, policy="random-walk")
        beacons = world.add(Body, 10, policy="stationary", name="beacons")
        world.senses(robots, prey)
        declare(world, robots, beacons)
        world.run(50)
        fractions.append(world.observed_fraction)
        assert not any(beacon.is_observed for beacon in beacons) or len(fractions) == 3

    assert fractions[0] == fractions[1] != fractions[2]


def test_a_forgotten_declaration_is_said():
    world = World(Box(6, 6), rng=1)
    world.add(Robot, 5, policy="a-cmommt")
    world.add(Target, 10, policy="evasive")
    with pytest.warns(UserWarning, match="declare") as said:
        world.run(2)
    texts = [str(each.message) for each in said]
    assert any("observed_fraction is NaN" in text and "world.senses(robots, targets)" in text for text in texts)
    assert any("evasive" in text and "world.senses(targets, others)" in text for text in texts)


def test_a_policy_whose_channel_is_missing_is_refused():
    world = World(Box(6, 6), rng=1)
    robots = world.add(Robot, 5, policy=Flee())
    with pytest.raises(ValueError, match=r"reads the channel 'predators'.*as_='predators'"):
        world.run(1)
    robots.policy = "random-walk"
    world.run(1)
    with pytest.raises(ValueError, match="reads the channel 'predators'"):
        robots.policy = Flee()
    world.run(1)
    assert world.tick == 2


@pytest.mark.parametrize(
    ("declaration", "message"),
    [
        ({"as_": "teammates"}, "the same team"),
        ({"as_": "relayed"}, "must be a name"),
        ({"as_": "count"}, "must be a name"),
        ({"as_": "two words"}, "must be a name"),
        ({"as_": 3}, "name of a channel"),
        ({"counts": 1}, "counts"),
        ({"sensor": 0.5}, "must be a Sensor"),
        ({"sensor": Sensor}, "is a class"),
        ({"sensor": Sensor(range=1.0)}, "sensing_range"),
        ({"as_": "prey", "sensor": Sensor(range=1e12)}, "sensor.range"),
        ({"as_": "wolves", "counts": True}, "was declared with False"),
        ({"as_": "wolves", "sensor": Sensor(missed=0.5)}, "one sensor"),
    ],
)
def test_wrong_declarations_are_refused_and_change_nothing(declaration, message):
    world = World(Box(6, 6), rng=1)
    robots = world.add(Robot, 5, policy="random-walk")
    prey = world.add(Target, 10, policy="random-walk")
    world.senses(robots, prey, as_="wolves", sensor=Sensor(missed=0.25))
    before = {name: (list(channel.observed), channel.sensor) for name, channel in robots.channels.items()}
    with pytest.raises((TypeError, ValueError), match=message):
        world.senses(robots, robots, **declaration)
    assert {name: (list(channel.observed), channel.sensor) for name, channel in robots.channels.items()} == before


def test_sensors_are_a_mapping_by_channel():
    world, robots, *_ = hunt(Flee())
    assert list(robots.sensors) == ["teammates", "beacons", "predators"]
    assert robots.sensors["predators"] == Sensor()
    robots.sensors["predators"] = Sensor(missed=1.0)
    world.run(3)
    assert not any(robot.sensed("predators") for robot in robots)
    assert robots.percept.channels.predators.start[-1] == 0
    del robots.sensors["predators"]
    assert robots.sensors["predators"] == Sensor()
    with pytest.raises(KeyError, match="no such channel"):
        robots.sensors["prey"] = Sensor()
    with pytest.raises(KeyError, match="no such channel"):
        robots[0].sensed("prey")


def test_a_world_says_on_which_path_it_runs():
    world, robots, *_ = hunt(Flee())
    assert world.path == "compiled"
    robots.policy = FleeInPython()
    assert world.path == "step by step: the policy of prey is Python"


def test_a_state_holds_the_sensors():
    world, robots, *_ = hunt(Flee())
    robots.sensors["predators"] = Sensor(missed=0.8)
    world.run(10)
    saved = world.state()
    world.run(10)
    end = robots.position.copy()
    robots.sensors["predators"] = Sensor()
    world.restore(saved)
    assert robots.sensors["predators"] == Sensor(missed=0.8)
    world.run(10)
    np.testing.assert_array_equal(robots.position, end)


def test_a_state_from_before_a_declaration_is_refused():
    world, _, predators, beacons = hunt(Flee())
    saved = world.state()
    world.senses(predators, beacons, as_="beacons")
    with pytest.raises(ValueError, match="have the channels 'targets', and here 'targets', 'beacons'"):
        world.restore(saved)


def test_agents_can_leave_and_come_in_a_loop_over_their_group():
    world, robots, *_ = hunt(Flee())
    for _ in robots:
        robots.add(1)
    assert len(robots) == 12
    for robot in robots:
        robot.remove()
    assert len(robots) == 0
    assert "<svg" in world._repr_html_()
