"""One robot with a policy of its own, in a group with another."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from teamsight import CMOMMT, Cycle, Robot, Torus, World
from teamsight.policies import ACmommt, Policy, RandomWalk
from teamsight.policies.interface import Action, Percept
from tests.agents.decisions.test_cycles import InPython, bits


def model(**more: Any) -> CMOMMT:
    return CMOMMT(robots=6, targets=7, radius=2.5, rng=more.pop("rng", 3), **more)


def test_robots_with_other_policies_move_as_in_a_group_of_these() -> None:
    # Robots that sense nobody decide alone, so each moves as it would in a group in which all have its policy.
    policies = {0: RandomWalk(), 1: RandomWalk(0.1), 2: RandomWalk(0.3, random_distance=True)}
    rows = [0, 1, 0, 2, 2, 1, 0]
    mixed = World(Torus(9, 9), rng=4)
    robots = mixed.add(Robot, 7, policy=policies[0])
    for row, index in enumerate(rows):
        if index:
            robots[row].policy = policies[index]
    mixed.run(20)
    for index, policy in policies.items():
        alike = World(Torus(9, 9), rng=4)
        group = alike.add(Robot, 7, policy=policy)
        alike.run(20)
        chosen = np.array(rows) == index
        assert (robots.position[chosen] == group.position[chosen]).all()
    assert "RandomWalk and RandomWalk" in repr(robots)


@pytest.mark.parametrize("awareness", ["ring", "shared"])
def test_kernels_and_python_give_the_same_bits(awareness: str) -> None:
    found = []
    for kind in range(4):
        world = model(awareness=awareness, cycle=Cycle([1, 1, 3, 1, 2, 1]))
        others: list[Any] = [ACmommt(weights="none"), "centroid"]
        if kind == 3:
            others[0] = InPython(others[0])
        world.run(5)
        world.robots[1].policy = others[0]
        world.robots[4].policy = others[1]
        for steps in ([20], [1] * 20, [3, 17], [1] * 20)[kind]:
            world.run(steps)
        world.robots[1].policy = world.robots.policy
        world.robots[2].policy = others[1]
        world.run(10)
        found.append(bits(world))
        assert world.robots.is_compiled == (kind != 3)
    assert found[0] == found[1] == found[2] == found[3]


def test_it_starts_with_the_first_state_of_its_policy() -> None:
    world = model()
    world.run(15)
    before = world.robots.policy_state.ints.copy()
    assert (before[:, 0, 0] >= 0).any()
    row = int(np.flatnonzero(before[:, 0, 0] >= 0)[0])
    world.robots[row].policy = "random-walk"
    world.run(1)
    world.robots[row].policy = world.robots.policy
    fresh = world.robots.policy.start(6)
    assert (world.robots.policy_state.ints[row] == fresh.ints[row]).all()
    assert (world.robots.policy_state.floats[row] == fresh.floats[row]).all()


def test_a_known_policy_costs_no_binding() -> None:
    world = model()
    world.robots[1].policy = "random-walk"
    world.run(2)
    binding = world._engine._binding
    world.robots[3].policy = "random-walk"
    world.robots[1].policy = world.robots.policy
    world.run(2)
    assert world._engine._binding is binding
    assert len(world.robots.policies) == 2
    assert isinstance(world.robots[3].policy, RandomWalk)
    assert isinstance(world.robots[1].policy, ACmommt)


def test_the_group_and_a_reset_set_all_again() -> None:
    world, plain = model(), model()
    world.robots[1].policy = "random-walk"
    world.run(4)
    world.robots.policy = "centroid"
    assert {type(robot.policy).__name__ for robot in world.robots} == {"Centroid"}
    world.robots.policy = plain.robots.policy
    world.robots[2].policy = "random-walk"
    world.robots.policy = plain.robots.policy
    assert isinstance(world.robots[2].policy, ACmommt)
    world.robots[2].policy = "random-walk"
    world.adjust(world.robots, policy=plain.robots.policy, cycle=Cycle(3))
    assert isinstance(world.robots[2].policy, ACmommt)
    world.robots[2].policy = "random-walk"
    world.adjust(world.robots, cycle=Cycle())
    assert isinstance(world.robots[2].policy, RandomWalk)
    world.run(3)
    world.reset()
    world.run(12)
    plain.run(12)
    assert bits(world) == bits(plain)


def test_state_holds_the_policies_of_robots() -> None:
    world = model()
    world.run(3)
    world.robots[1].policy = "random-walk"
    world.run(3)
    saved = world.state()
    world.run(9)
    expected = bits(world)
    world.robots[1].policy = world.robots.policy
    world.robots[4].policy = "centroid"
    world.run(2)
    world.restore(saved)
    assert isinstance(world.robots[1].policy, RandomWalk)
    assert isinstance(world.robots[4].policy, ACmommt)
    world.run(9)
    assert bits(world) == expected
    # A world that has never had it, and one that has it after another.
    new, other = model(rng=8), model()
    other.robots[2].policy = "centroid"
    other.robots[5].policy = "random-walk"
    for one in (new, other):
        one.restore(pickle.loads(pickle.dumps(saved)))
        assert [type(robot.policy).__name__ for robot in one.robots] == ["ACmommt", "RandomWalk", *["ACmommt"] * 4]
        one.run(9)
        assert bits(one) == expected


@pytest.mark.short
def test_policies_that_cannot_be_pickled_are_given_first() -> None:
    class Local(Halves):
        pass

    worlds = model(), model()
    worlds[0].targets[1].policy = own = Local()
    worlds[0].run(4)
    saved = worlds[0].state()
    worlds[0].run(6)
    message = r"single targets have the policy .*Local.*could not be pickled.*as in targets\[0\]\.policy = "
    for one in (saved, pickle.loads(pickle.dumps(saved))):
        with pytest.raises(ValueError, match=message):
            worlds[1].restore(one)
    worlds[1].run(1)
    worlds[1].targets[3].policy = Local()
    worlds[1].restore(pickle.loads(pickle.dumps(saved)))
    worlds[1].run(6)
    assert bits(worlds[1]) == bits(worlds[0])
    # The world itself goes back with the policy itself, also if it has lost it.
    worlds[0].targets.policy = worlds[0].targets.policy
    assert worlds[0].targets[1].policy is not own
    worlds[0].restore(saved)
    assert worlds[0].targets[1].policy is own
    worlds[0].run(6)
    assert bits(worlds[1]) == bits(worlds[0])


def test_agents_that_come_and_go_keep_the_policies_of_the_others() -> None:
    world = model()
    world.robots[4].policy = "random-walk"
    world.run(2)
    world.robots[1].remove()
    world.robots.add(2)
    kinds = [type(robot.policy).__name__ for robot in world.robots]
    assert kinds == ["ACmommt"] * 3 + ["RandomWalk"] + ["ACmommt"] * 3
    world.run(3)
    assert (world.robots.decided_at == 4).all()


def test_what_does_not_fit_is_refused_and_changes_nothing() -> None:
    world, plain = model(awareness="none"), model(awareness="none")
    robot = world.robots[1]
    with pytest.raises(ValueError, match=r"needs 'teammates', which awareness 'none' does not deliver"):
        robot.policy = "evolved"
    with pytest.raises(ValueError, match=r"policy='dance': unknown"):
        robot.policy = "dance"
    with pytest.raises(TypeError, match=r"policy=RandomWalk: is a class"):
        robot.policy = RandomWalk  # type: ignore[assignment]
    assert world.robots.timetable is None
    world.robots[2].policy = "lazy-collective"
    with pytest.raises(ValueError, match=r"lazy-collective.*learned from situations of awareness|lazy-collective.*reads"):
        world.robots.awareness = "ring"
    world.robots[2].policy = world.robots.policy
    world.run(5)
    plain.run(5)
    assert bits(world) == bits(plain)


class Halves(Policy):
    """A NumPy policy with a state that counts its decisions."""

    draws = 1

    def start(self, size: int) -> npt.NDArray[np.int64]:
        return np.zeros(size, np.int64)

    def decide(self, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> tuple[Action, Any]:
        assert len(state) == len(percept.heading) == noise.shape[1]
        return Action(percept.heading, percept.speed * noise[0]), state + 1


def test_states_of_numpy_policies_belong_to_robots() -> None:
    world = World(Torus(9, 9), rng=2)
    robots = world.add(Robot, 4, policy=Halves(), cycle=Cycle([1, 2, 3, 1]))
    own = Halves()
    robots[3].policy = own
    robots[0].policy = "random-walk"
    for _ in range(6):
        world.step()
    assert robots.states[0].tolist() == [0, 3, 2, 0]
    assert robots.states[1].tolist() == [0, 0, 0, 6]
    robots[3].policy = own
    assert robots.states[1][3] == 0
