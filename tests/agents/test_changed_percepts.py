"""A robot that hands a changed percept to its policy gets the decision on that percept, and on no other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.agents.recording.explore import explore
from teamsight.policies import Action, LazyQ, Policy, RandomWalk
from teamsight.policies.percept_of_one import NeighboursOfOne, PerceptOfOne

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

NOTHING = NeighboursOfOne(np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros(0))


class Blind(Robot):
    """Hides all targets from its policy."""

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        return super().decide(percept._replace(targets=NOTHING), rng)


class Toward(Policy):
    """A NumPy policy that goes to the nearest target and counts what it has seen, robot by robot."""

    draws = 0

    def start(self, size: int) -> dict[str, Any]:
        return {"seen": np.zeros(size), "rule": "nearest"}

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        targets = percept.targets
        heading = np.zeros_like(percept.heading)
        for i in range(len(heading)):
            mine = slice(targets.start[i], targets.start[i + 1])
            if len(targets.distance[mine]):
                heading[i] = targets.offset[mine][0] / targets.distance[mine][0]
        return Action(heading, np.full(len(heading), 0.05)), {**memory, "seen": memory["seen"] + np.diff(targets.start)}


def world_of(kind: type[Robot], policy: Any, *, targets: bool = True, seed: int = 3) -> World:
    """Return a world whose robots sense targets, or have none to sense."""
    world = World(Disc(2.0), rng=seed)
    robots = world.add(kind, 6, policy=policy, awareness="pairwise")
    prey = world.add(Target, 8, policy=RandomWalk(turn_probability=0.05), speed=0.05)
    if targets:
        world.senses(robots, prey)
    return world


@pytest.mark.short
@pytest.mark.parametrize("policy", ["a-cmommt", "centroid", Toward(), "random-walk"], ids=lambda p: str(p)[:12])
def test_a_blind_robot_moves_like_one_that_senses_nothing(policy: Any) -> None:
    blind, unable, seeing = world_of(Blind, policy), world_of(Robot, policy, targets=False), world_of(Robot, policy)
    for world in (blind, unable, seeing):
        world.run(25)
    # Its turn is an angle, which costs a few last bits.
    assert blind.groups[0].position == pytest.approx(unable.groups[0].position, abs=1e-9)
    if policy != "random-walk":
        assert not np.allclose(blind.groups[0].position, seeing.groups[0].position, atol=1e-3)


def test_the_memory_of_a_blind_robot_is_that_of_a_blind_one() -> None:
    blind, seeing = world_of(Blind, Toward()), world_of(Robot, Toward())
    for world in (blind, seeing):
        world.run(10)
    assert blind.groups[0].policy_state["seen"].tolist() == [0.0] * 6
    assert seeing.groups[0].policy_state["seen"].sum() > 0


def test_each_robot_may_change_its_percept_or_not() -> None:
    class Half(Robot):
        def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
            return super().decide(percept._replace(targets=NOTHING) if self.row % 2 else percept, rng)

    half, blind, seeing = (world_of(kind, Toward()) for kind in (Half, Blind, Robot))
    for world in (half, blind, seeing):
        world.step()
    odd = np.arange(6) % 2 == 1
    assert half.groups[0].position[odd] == pytest.approx(blind.groups[0].position[odd], abs=1e-12)
    assert half.groups[0].position[~odd] == pytest.approx(seeing.groups[0].position[~odd], abs=1e-12)
    assert half.groups[0].policy_state["seen"][odd].tolist() == [0.0] * 3
    assert half.groups[0].policy_state["seen"][~odd].tolist() == seeing.groups[0].policy_state["seen"][~odd].tolist()


def test_a_policy_for_one_robot_gets_the_changed_percept_too() -> None:
    seen: list[int] = []

    def look(percept: Any, rng: Any) -> tuple[float, float]:
        seen.append(len(percept.targets.distance))
        return 0.1, 0.05

    world = world_of(Blind, look)
    world.run(5)
    assert seen == [0] * 30


def test_a_policy_may_be_asked_twice_and_its_last_answer_is_remembered() -> None:
    class Unsure(Robot):
        def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
            super().decide(percept, rng)
            return super().decide(percept._replace(targets=NOTHING), rng)

    unsure, blind = world_of(Unsure, "a-cmommt"), world_of(Blind, "a-cmommt")
    for world in (unsure, blind):
        world.run(15)
    assert np.array_equal(unsure.groups[0].position, blind.groups[0].position)


@pytest.mark.parametrize("policy", ["a-cmommt", Toward()], ids=["kernel", "numpy"])
def test_asking_between_steps_changes_nothing(policy: Any) -> None:
    asked, other = world_of(Robot, policy), world_of(Robot, policy)
    asked.run(5)
    other.run(5)
    for robot in asked.groups[0]:
        robot.decide(robot.percept, np.random.default_rng(1))
        robot.decide(robot.percept._replace(targets=NOTHING), np.random.default_rng(1))
    for world in (asked, other):
        world.run(5)
    assert np.array_equal(asked.groups[0].position, other.groups[0].position)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": (np.zeros(1), np.zeros((0, 2)), np.zeros(0))}, r"percept\.targets: identity, offset and distance"),
        ({"targets": None}, r"percept\.targets: must be NeighboursOfOne"),
        ({"heading": np.ones(3)}, r"percept\.heading: has the shape \(3,\); it must be \(2,\)"),
        ({"teammates": (np.zeros(2, int), np.zeros((2, 3)), np.zeros(2))}, r"percept\.teammates: .*\(2, 3\)"),
    ],
)
def test_a_percept_that_a_kernel_could_not_read_is_refused(change: dict[str, Any], message: str) -> None:
    class Wrong(Robot):
        def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
            return super().decide(percept._replace(**change), rng)

    with pytest.raises((TypeError, ValueError), match=message):
        world_of(Wrong, "a-cmommt").step()


def test_a_learner_that_reads_the_situation_is_not_given_changed_sightings_alone() -> None:
    class Honest(Robot):
        def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
            nothing = np.ones_like(percept.situation)
            return super().decide(percept._replace(targets=NOTHING, situation=nothing), rng)

    learner = CMOMMT(robots=5, policy="evolved", awareness="ring", rng=1)
    assert not getattr(learner.robots.policy, "inputs", 0)
    memory = explore(CMOMMT(robots=5, awareness="ring", policy="random-walk", rng=1), 30)
    for kind, refused in ((Blind, True), (Honest, False)):
        world = World(Disc(3.0), rng=1)
        robots = world.add(kind, 5, policy=LazyQ(memory), awareness="ring")
        world.senses(robots, world.add(Target, 5, policy="random-walk"))
        if refused:
            with pytest.raises(ValueError, match=r"percept\.targets: was changed, but LazyQ reads percept\.situation"):
                world.run(2)
        else:
            world.run(2)
        assert world.tick == (0 if refused else 2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": "fast"}, r"percept\.speed='fast': must be a number"),
        ({"speed": np.nan}, r"percept\.speed=nan: must be a finite number"),
        ({"heading": (np.nan, 0.0)}, r"percept\.heading=\(nan, 0\.0\): must be two finite numbers"),
    ],
)
def test_a_field_of_a_percept_that_is_no_number_is_named(change: dict[str, Any], message: str) -> None:
    robot = world_of(Robot, "a-cmommt").groups[0][0]
    with pytest.raises((TypeError, ValueError), match=message):
        robot.decide(robot.percept._replace(**change), np.random.default_rng(1))
