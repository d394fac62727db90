"""Forces that depend on the place against their slow twin, and what their memory is for."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from naive.group_forces import AdaptiveForcesRobot
from naive.watched import watch

from teamsight import CMOMMT
from teamsight.policies import AdaptiveForces, GroupForces, check_policy
from teamsight.policies.adaptive_forces import BLOCKS, PARTS, SIZE, without
from teamsight.policies.evolved import made


def drawn(seed: int) -> AdaptiveForces:
    """Constants without structure, whose soft edges are wide, so that rounding decides nothing."""
    constants = AdaptiveForces.parts(np.random.default_rng(seed).normal(0, 0.5, SIZE))
    usual = {"margin": [0.4], "decay": [0.3], "fade": [0.05], "targets_margin": [0.1], "teammates_margin": [0.1]}
    return AdaptiveForces(AdaptiveForces.vector(constants | usual))


@pytest.mark.parametrize("awareness", ["ring", "pairwise"])
@pytest.mark.parametrize("policy", [AdaptiveForces(), drawn(5), drawn(6)], ids=["shipped", "one", "other"])
def test_the_rule_is_that_of_its_slow_twin(policy: AdaptiveForces, awareness: str) -> None:
    watch(policy, AdaptiveForcesRobot, awareness, 1e-5)


def test_without_what_is_added_it_is_the_policy_of_groups() -> None:
    parts = {name: np.zeros(shape) for name, shape in BLOCKS.items()} | {"fade": np.array([9.0])}
    plain = AdaptiveForces(AdaptiveForces.vector(parts | GroupForces.parts(GroupForces.shipped())))
    worlds = [CMOMMT(robots=6, targets=9, radius=3, policy=one, awareness="ring", rng=4) for one in (plain, "group-forces")]
    for world in worlds:
        world.run(100)
    assert np.array_equal(*(world.robots.position for world in worlds))


def test_it_keeps_the_contract() -> None:
    check_policy(AdaptiveForces())
    check_policy(drawn(1))


def test_a_file_brings_the_constants_back_and_what_ships_says_what_made_it(tmp_path: Path) -> None:
    path = tmp_path / "constants.json"
    path.write_text(json.dumps(drawn(2).content({})), encoding="utf-8")
    assert AdaptiveForces.load(path) == drawn(2) != AdaptiveForces()
    assert "--policy adaptive-forces" in made(AdaptiveForces.file)["command"]


@pytest.mark.parametrize("part", PARTS)
def test_a_part_that_is_removed_changes_what_robots_do(part: str) -> None:
    whole, rest = AdaptiveForces(), AdaptiveForces(without(AdaptiveForces.shipped(), part))
    worlds = [CMOMMT(robots=6, targets=9, radius=3, policy=one, awareness="ring", rng=4) for one in (whole, rest)]
    for world in worlds:
        world.run(200)
    assert not np.array_equal(*(world.robots.position for world in worlds))
