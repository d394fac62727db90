"""Robots that are steered from outside."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight import CMOMMT, check_policy
from teamsight.env import vector_env
from teamsight.policies.steered import FORMS, Steered


@pytest.mark.parametrize("form", FORMS)
def test_it_keeps_the_contract_of_policies(form: str) -> None:
    check_policy(Steered(form))


def test_without_an_action_robots_stay() -> None:
    model = CMOMMT(policy=Steered(), seed=1)
    before = model.robots.position.copy()
    model.run(5)
    assert np.array_equal(model.robots.position, before)


def test_what_is_written_into_the_state_is_carried_out() -> None:
    model = CMOMMT(robots=2, policy=Steered("heading"), seed=1)
    model.robots.policy_state.floats[:, 0] = [(0.6, 0.8, 0.05), (0.0, 0.0, 9.0)]
    model.run(1)
    assert model.robots.action.heading.tolist() == [[0.6, 0.8], [0.0, 0.0]]
    assert model.robots.action.distance.tolist() == [0.05, 9.0]
    assert np.hypot(*model.robots.bodies.moved[1]) <= 0.1 + 1e-12


def test_a_vector_is_a_way_ahead_and_to_the_left_of_the_heading() -> None:
    env = vector_env(1, robots=4, targets=2, radius=50.0, max_cycles=9)
    env.reset(seed=1)
    robots = env.world(0).groups[0]
    before, heading = robots.position.copy(), robots.heading.copy()
    # Ahead, back at half speed, to the left beyond the speed, and nowhere.
    actions = np.array([[1.0, 0.0], [-0.5, 0.0], [0.8, 1.0], [0.0, 0.0]])
    env.step(actions[None])
    robots = env.world(0).groups[0]
    left = np.stack([-heading[:, 1], heading[:, 0]], axis=-1)
    wanted = actions[:, :1] * heading + actions[:, 1:] * left
    length = np.hypot(*wanted.T)
    assert robots.heading[:3] == pytest.approx(wanted[:3] / length[:3, None])
    assert robots.heading[3].tolist() == heading[3].tolist()
    moved = np.hypot(*(robots.position - before).T)
    assert moved == pytest.approx([0.1, 0.05, 0.1, 0.0], abs=1e-12)


@pytest.mark.parametrize("wrong", [np.nan, 1.01, -1.01, np.inf])
def test_a_vector_outside_of_its_space_is_refused(wrong: float) -> None:
    env = vector_env(1, robots=2)
    env.reset(seed=1)
    with pytest.raises(ValueError, match=r"actions\[0, 1\]=.*must be finite and between -1 and 1; clip it"):
        env.step([[[0.0, 0.0], [0.0, wrong]]])
