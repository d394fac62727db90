"""Interactions: both paths give one result, and they do what their slow twin does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from interactions import Capture, CaptureInTurn, fingerprint, hunt
from naive import interactions as twin

from teamsight import Interaction, Robot, Target, Torus, World
from teamsight.core.kernel import inlined, kernel
from teamsight.policies import Policy
from teamsight.policies.interface import Action
from teamsight.world import InteractionState


class Keen(Policy):
    """In Python: goes on after a reward, and turns by a right angle after none."""

    def decide(self, percept: Any, state: Any, noise: Any) -> tuple[Action, Any]:
        x, y = percept.heading.T
        heading = np.where((percept.reward > 0)[:, None], percept.heading, np.stack([-y, x], axis=-1))
        return Action(heading, np.where(percept.ended, 0.0, percept.speed)), state


@pytest.mark.parametrize("interaction", [Capture(), CaptureInTurn()], ids=repr)
@pytest.mark.parametrize("policy", ["centroid", Keen()], ids=["kernel", "Python"])
@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_both_paths_give_one_result(interaction: Capture, policy: Any) -> None:
    at_once, one_by_one, mixed = (hunt(interaction, policy=policy) for _ in range(3))
    at_once.run(120)
    for _ in range(120):
        one_by_one.step()
    mixed.run(17)
    for _ in range(30):
        mixed.step()
    mixed.run(73)
    assert at_once.recording.history["captures"].sum() > 0
    assert fingerprint(at_once) == fingerprint(one_by_one) == fingerprint(mixed)


def test_scores_and_rewards_are_those_of_the_captures() -> None:
    world = hunt()
    hunters, prey = world.groups
    captures = rewards = 0.0
    for _ in range(200):
        before, caught = prey.bodies.position.copy(), prey.caught.values.copy()
        world.step()
        moved = world.arena.displacement(before, prey.bodies.position)
        assert moved == pytest.approx(prey.bodies.moved, abs=1e-12)
        reward, ended = hunters.percept.reward, hunters.percept.ended
        assert (ended == (reward > 0.0)).all()
        assert ended.any() == (prey.caught.values > caught).any()
        captures += (prey.caught.values - caught).sum()
        rewards += reward.sum()
    assert captures == world.recording.history["captures"].sum() == world._data.interactions[0].state.ints[0, 0] > 0
    assert rewards > 200 * 6 * -0.1 + captures - 1e-9


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_does_what_the_slow_twin_does(seed: int) -> None:
    world, plain = hunt(seed=seed), hunt(Capture(reach=0.0), seed=seed)
    hunters, prey = world.groups
    captured = 0
    for tick in range(80):
        # The same bodies move without a capture.
        for one, other in zip(plain.groups, world.groups, strict=True):
            for name in ("position", "heading", "moved", "speed"):
                getattr(one.bodies, name)[:] = getattr(other.bodies, name)
        plain._engine.is_seen = False
        plain.step()
        world.step()
        expected = twin.capture(world, {one.name: one.bodies.position for one in plain.groups}, tick, "Capture")
        assert (prey.bodies.position == expected["place"]).all()
        assert hunters.bodies.reward == pytest.approx(expected["reward"])
        assert world.recording.history["captures"].iloc[-1] == expected["captured"]
        captured += expected["captured"]
    assert captured > 0


@inlined
def _have_moved(here: Any) -> bool:
    for i in range(here.position.shape[0]):
        if here.moved[i, 0] != 0.0 or here.position[i, 0] != here.before[i, 0]:
            return True
    return False


@kernel
def _note(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.ints[turn, 0] += _have_moved(bodies.one)
    state.ints[turn, 1] += _have_moved(bodies.two)
    state.ints[turn, 2] += 1


class Note(Interaction):
    """Notes at each turn which groups have moved."""

    roles = ("two", "one")
    in_turn = True
    kernel = _note

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.zeros((2, 3), np.int64))


def test_groups_move_in_turn() -> None:
    world = World(Torus(6.0, 6.0), rng=1)
    one = world.add(Robot, 2, policy="random-walk", name="one")
    world.add(Target, 3, policy="random-walk", name="between")
    two = world.add(Target, 2, policy="random-walk", name="two")
    world.senses(one, two)
    world.interact(Note(), two=two, one=one)
    world.run(10)
    # The role "one" has the index 1 and moves first: by then "two" has not moved.
    assert world._data.interactions[0].state.ints.tolist() == [[10, 10, 10], [10, 0, 10]]


def test_scores_follow_the_columns_of_every_world() -> None:
    world = hunt()
    assert world.recording.history["captures"].tolist() == []
    world.run(3)
    assert list(world.recording.history) == ["observed", "mean_neighbours", "max_neighbours", "captures"]
    assert world.interactions == (Capture(),)


def test_one_robot_perceives_its_reward() -> None:
    found = []

    def rule(percept: Any, rng: Any) -> tuple[float, float]:
        found.append((percept.reward, percept.ended))
        return 0.0, 1.0

    world = hunt(policy=rule)
    for _ in range(100):
        world.step()
    assert set(found[:6]) == {(0.0, False)}
    assert {ended for _, ended in found[6:]} == {True, False}
    assert all(ended == (reward > 0) for reward, ended in found)
    assert found[-1] != (0.0, False)
    assert world.groups[0][0].percept.reward == world.groups[0].percept.reward[0]


def test_without_an_interaction_there_is_no_reward() -> None:
    from teamsight import CMOMMT

    world: World = CMOMMT(rng=1)
    world.run(5)
    assert not world.groups[0].percept.reward.any()
    assert not world.groups[0].percept.ended.any()
    assert world.groups[0].percept.reward.shape == (len(world.groups[0]),)
