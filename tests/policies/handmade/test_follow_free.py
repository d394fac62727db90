"""The team by hand: the decisions of the regression with this law, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from naive import regression as naive

from teamsight.policies import FollowFree, check_policy
from teamsight.policies.check import sample_percept
from teamsight.policies.lazy.readings import KINDS

pytestmark = pytest.mark.short


@pytest.mark.parametrize("exponent", [0, 1, 8])
@pytest.mark.parametrize("teammates", [0, 6])
def test_it_turns_along_the_law_of_free_targets_and_heeds_nothing_else(exponent: float, teammates: int) -> None:
    policy = FollowFree(exponent, teammates, targets=8)
    rng = np.random.default_rng(3)
    size = (200, policy.inputs)
    situation = np.where(rng.random(size) < 1 / 3, rng.random(size), 1.0).astype(np.float32)
    percept = sample_percept(200, rng)
    percept = percept._replace(situation=situation, awareness_range=percept.sensing_range)
    action, _ = policy.decide(percept, policy.start(200), np.zeros((0, 200)))
    assert action.distance.tolist() == percept.speed.tolist()
    ways = action.heading.view(complex)[:, 0] / percept.heading.view(complex)[:, 0]
    law = np.linspace(0, 1, 21) ** exponent
    forces = dict(zip(KINDS, (law, 0 * law, 0 * law), strict=True))
    layout = "sectors" if teammates else ""
    checked = 0
    for way, row in zip(ways, situation, strict=True):
        force = naive.decide(forces, [float(reading) for reading in row], 8, layout, 1.0)
        if abs(force) > 1e-4:
            assert way == pytest.approx(force / abs(force), abs=1e-3)
            checked += 1
        elif not force:
            assert way == pytest.approx(1)
    assert checked > 90


def test_it_keeps_the_contract_and_says_what_it_needs() -> None:
    assert (FollowFree().degree, FollowFree().inputs) == ("ring", 32)
    assert (FollowFree(teammates=0).degree, FollowFree(teammates=0).inputs) == ("none", 16)
    check_policy(FollowFree())
    percept = sample_percept(2, np.random.default_rng(1))
    with pytest.raises(ValueError, match=r"FollowFree: the percept's situations have \d+ components; it compares 7"):
        FollowFree(teammates=3, targets=4).decide(percept, FollowFree().start(2), np.zeros((0, 2)))
