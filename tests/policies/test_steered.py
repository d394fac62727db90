"""Robots that are steered from outside."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight import CMOMMT, check_policy
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
