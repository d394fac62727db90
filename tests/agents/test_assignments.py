"""Assignments: what is set works, or is refused with the cure; nothing is silently ignored."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Robot, World
from teamsight.agents.awareness import RingAwareness
from teamsight.policies import ACmommt, Centroid, Stationary


@pytest.mark.short
@pytest.mark.parametrize(
    ("name", "value"), [("speed", 0.3), ("sensing_range", 2.5), ("awareness_range", 0.4), ("turn_limit", 0.2)]
)
def test_an_ability_that_is_set_is_that_of_an_adjustment(name: str, value: float) -> None:
    def adjusted(model: CMOMMT) -> None:
        model.adjust(model.robots, **{name: value})

    def of_the_group(model: CMOMMT) -> None:
        setattr(model.robots, name, value)

    def of_each(model: CMOMMT) -> None:
        for robot in model.robots:
            setattr(robot, name, value)

    def of_the_set(model: CMOMMT) -> None:
        model.agents.select(lambda agent: isinstance(agent, Robot)).set(name, value)

    ends = []
    for change in (adjusted, of_the_group, of_each, of_the_set):
        model = CMOMMT(radius=2.0, rng=5)
        model.run(5)
        change(model)
        model.run(15)
        model.step()
        assert getattr(model.robots[3], name) == pytest.approx(value)
        assert getattr(model.robots, name).tolist() == pytest.approx([value] * 10)
        ends.append((model.robots.position.tolist(), model.recording.history.to_dict()))
    assert ends.count(ends[0]) == 4
    untouched = CMOMMT(radius=2.0, rng=5)
    untouched.run(21)
    assert ends[0] != (untouched.robots.position.tolist(), untouched.recording.history.to_dict())


def test_one_robot_alone_is_changed_and_at_once() -> None:
    world = World(Disc(5.0), rng=1)
    robots = world.add(Robot, 3, policy=Stationary(), awareness="pairwise", placement=[(0, 0), (1.5, 0), (-1.5, 0)])
    world.run(2)
    assert [len(robot.neighbours) for robot in robots] == [0, 0, 0]
    robots[0].awareness_range = 2.0
    assert [len(robot.neighbours) for robot in robots] == [2, 0, 0]
    assert world.mean_degree == pytest.approx(2 / 3)
    robots[1].speed = 0.0
    assert robots.speed.tolist() == [0.1, 0.0, 0.1]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("speed", -0.1, r"speed=-0\.1: must be a finite number, at least 0"),
        ("speed", "fast", r"speed='fast': must be a number"),
        ("speed", [0.1, 0.2], r"speed: has the shape \(2,\); give one number"),
        ("sensing_range", 0, r"sensing_range=0\.0: must be a finite number, above 0"),
        ("awareness_range", math.inf, r"awareness_range=inf: must be a finite number"),
        ("turn_limit", math.nan, r"turn_limit=nan"),
        ("policy", "centroyd", r"policy='centroyd': unknown"),
        ("cycle", 0.5, r"cycle=0\.5: must be a finite number, at least 1"),
        ("awareness", "none", r"awareness=none: belongs to the group 'robots'; set group\.awareness"),
        ("position", (9, 9), r"position=\(9\.0, 9\.0\): must be two finite numbers inside"),
        ("pos", (9, 9), r"position=\(9\.0, 9\.0\): must be two finite numbers inside"),
    ],
)
def test_what_an_agent_cannot_have_is_refused(name: str, value: Any, message: str) -> None:
    model, other = CMOMMT(rng=1), CMOMMT(rng=1)
    with pytest.raises((ValueError, TypeError, AttributeError), match=message):
        setattr(model.robots[2], name, value)
    for world in (model, other):
        world.run(5)
    assert np.array_equal(model.robots.position, other.robots.position)


@pytest.mark.parametrize("name", ["percept", "neighbours", "observed_targets", "situation"])
def test_what_an_agent_senses_cannot_be_set(name: str) -> None:
    with pytest.raises(AttributeError):
        setattr(CMOMMT(rng=1).robots[0], name, 1)


@pytest.mark.parametrize("name", ["position", "heading", "identity", "percept", "is_compiled"])
def test_what_a_group_is_cannot_be_set(name: str) -> None:
    with pytest.raises(AttributeError):
        setattr(CMOMMT(rng=1).robots, name, 1)


def test_mesas_name_for_a_place_is_the_place() -> None:
    model = CMOMMT(rng=1)
    robot = model.robots[0]
    assert robot.pos.tolist() == robot.position.tolist()
    robot.pos = (1.0, 1.5)
    assert robot.position.tolist() == [1.0, 1.5]
    robot.remove()
    assert robot.pos is None


def test_attributes_of_the_users_own_stay_possible() -> None:
    robot = CMOMMT(rng=1).robots[0]
    robot.charge = 3
    assert robot.charge == 3
    assert not hasattr(robot, "battery")


@pytest.mark.short
def test_settings_of_the_model_take_effect() -> None:
    model = CMOMMT(radius=2.0, rng=5)
    model.policy = "centroid"
    model.awareness = RingAwareness(8)
    model.robot_speed = 0.2
    model.target_speed = [0.01] * 15
    model.target_policy = "stationary"
    model.sensing_range = 1.5
    model.awareness_range = 0.5
    assert type(model.robots.policy).__name__ == "Centroid"
    assert model.awareness == model.robots.awareness == RingAwareness(8)
    assert model.robot_speed.tolist() == model.robots.speed.tolist() == [0.2] * 10
    assert model.targets.speed.tolist() == [0.01] * 15
    assert model.robots.sensing_range.tolist() == [1.5] * 10
    assert model.robots.awareness_range.tolist() == [0.5] * 10
    before = model.targets.position.copy()
    model.run(3)
    assert np.array_equal(before, model.targets.position)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("radius", 3.0, r"radius=3\.0: is fixed when the model is built; build another"),
        ("delta", 8, r"delta=8: is fixed .*RingAwareness\(8\)"),
        ("policy_options", {}, r"policy_options=\{\}: is fixed .*model\.policy = ACmommt\(weights='shared'\)"),
        ("target_policy_options", {}, r"is fixed .*model\.target_policy = RandomWalk\(0\.1\)"),
        ("robots", 20, "robots|setter"), ("targets", 20, "targets|setter"), ("arena", Disc(3.0), "arena|setter"),
        ("seed_used", 3, "seed_used|setter"), ("policy", "centriod", "did you mean 'centroid'"),
    ],
)  # fmt: skip
def test_settings_that_cannot_change_are_refused(name: str, value: Any, message: str) -> None:
    model, other = CMOMMT(rng=1), CMOMMT(rng=1)
    with pytest.raises((AttributeError, ValueError), match=message):
        setattr(model, name, value)
    for world in (model, other):
        world.run(5)
    assert np.array_equal(model.robots.position, other.robots.position)
    assert model.radius == 5.0


def test_targets_that_come_to_evade_sense_the_robots() -> None:
    late, early = CMOMMT(radius=2.0, rng=1), CMOMMT(radius=2.0, target_policy="evasive", rng=1)
    late.target_policy = "evasive"
    for model in (late, early):
        model.run(20)
    assert np.array_equal(late.targets.position, early.targets.position)
    late.target_policy = "random-walk"
    assert late.targets.policy == CMOMMT(rng=1).targets.policy


class Watchful(Centroid):
    """A policy for targets that asks for the robots."""

    needs = ("targets",)


def test_targets_sense_the_robots_if_their_policy_declares_that_it_needs_them() -> None:
    for policy, sense in ((Watchful(), True), (Centroid(), False)):
        model = CMOMMT(radius=2.0, target_policy=policy, rng=1)
        assert bool(model.targets.relations) == sense


def test_names_that_are_set_stand_for_what_they_stand_for_in_the_constructor() -> None:
    model = CMOMMT(awareness="ring", delta=8, policy_options={"idle": "stay"}, rng=1)
    model.awareness = "pairwise"
    model.awareness = "ring"
    assert model.robots.awareness == RingAwareness(8)
    assert model.delta == 8
    model.policy = "centroid"
    assert model.robots.policy == Centroid(idle="stay")
    model.policy = "random-walk"
    model.policy = "a-cmommt"
    assert model.robots.policy == ACmommt(idle="stay")
    assert model.policy_options == {"idle": "stay"}
    model.awareness = RingAwareness(5)
    assert model.delta == 5
    for name in ("preset", "seed"):
        with pytest.raises(AttributeError, match=f"{name}=.*is fixed when the model is built"):
            setattr(model, name, 3)


def test_a_world_has_no_abilities_of_its_own() -> None:
    world = World(Disc(3.0), rng=1)
    world.add(Robot, 2, policy=Stationary())
    for name in ("policy", "awareness", "speed", "sensing_range", "awareness_range", "turn_limit"):
        with pytest.raises(AttributeError, match=rf"{name}=3: belongs to each group; set group\.{name}"):
            setattr(world, name, 3)
        assert not hasattr(world, name)

    class Sized(World):
        def __init__(self, speed: float) -> None:
            super().__init__(Disc(3.0), rng=1)
            self.speed = speed

    assert Sized(0.3).speed == 0.3
