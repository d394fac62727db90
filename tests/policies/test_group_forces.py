"""The forces of groups against their slow twin and the team by hand, and the file of their constants."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chance import generator
from naive.group_forces import GroupForcesRobot
from naive.watched import watch

from teamsight import CMOMMT
from teamsight.policies import GroupForces, check_policy
from teamsight.policies.group_forces import BY_HAND, SIZE


def drawn(seed: int) -> GroupForces:
    """Constants without structure, whose soft edges are wide, so that rounding decides nothing."""
    constants = GroupForces.parts(np.random.default_rng(seed).normal(0, 0.5, SIZE))
    return GroupForces(GroupForces.vector(constants | {"margin": [0.4], "decay": [0.3]}))


def in_lists(constants: Any) -> dict[str, Any]:
    """As a file keeps them."""
    return {name: part.tolist() for name, part in GroupForces.parts(constants).items()}


@pytest.mark.parametrize("awareness", ["ring", "pairwise"])
@pytest.mark.parametrize("policy", [GroupForces(), drawn(5), drawn(6)], ids=["shipped", "one", "other"])
def test_the_rule_is_that_of_its_slow_twin(policy: GroupForces, awareness: str) -> None:
    watch(policy, GroupForcesRobot, awareness, 1e-5)


@pytest.mark.parametrize("policy", ["group-forces", "adaptive-forces"])
def test_steps_and_a_run_give_the_same_bits(policy: str) -> None:
    one, other = (CMOMMT(robots=6, targets=9, radius=3, policy=policy, awareness="ring", rng=4) for _ in range(2))
    one.run(60)
    for _ in range(60):
        other.step()
    assert one.robots.position.tobytes() == other.robots.position.tobytes()
    assert one.observed_fraction == other.observed_fraction


def test_it_keeps_the_contract() -> None:
    check_policy(GroupForces())
    check_policy(drawn(1))


def test_the_file_brings_the_constants_back_to_the_last_bit(tmp_path: Path) -> None:
    constants = tuple(generator().normal(size=SIZE).tolist())
    path = tmp_path / "constants.json"
    path.write_text(json.dumps({"constants": in_lists(constants)}), encoding="utf-8")
    assert GroupForces.load(path).constants == constants
    assert GroupForces.load(path) == GroupForces(constants) != GroupForces()


def test_what_is_shipped_is_the_default_and_differs_from_the_start() -> None:
    assert GroupForces().constants == GroupForces.shipped() != GroupForces.vector(BY_HAND)
    assert repr(GroupForces()) == "GroupForces()"
    assert repr(GroupForces(GroupForces.vector(BY_HAND))) != repr(GroupForces())
    assert pickle.loads(pickle.dumps(GroupForces())) == GroupForces()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda content: content.pop("constants"), "holds no constants"),
        (lambda content: content["constants"].pop("law"), "holds no constants.*law"),
        (lambda content: content["constants"]["law"].pop(), r"law has the shape \(5,\), not \(6,\)"),
        (lambda content: content["constants"]["bias"].__setitem__(0, "fast"), "bias: could not convert"),
        (lambda content: content["constants"]["bias"].__setitem__(0, float("nan")), "is not finite"),
    ],
)
def test_a_bad_file_is_refused(change: Any, message: str, tmp_path: Path) -> None:
    content = {"constants": in_lists(GroupForces.shipped())}
    change(content)
    path = tmp_path / "constants.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        GroupForces.load(path)


@pytest.mark.parametrize(("constants", "message"), [((1.0,) * 5, r"the shape \(5,\)"), ((np.inf,) * SIZE, "number 0")])
def test_wrong_constants_are_refused(constants: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GroupForces(constants)


def test_without_teammates_in_sight_it_is_refused() -> None:
    with pytest.raises(ValueError, match="needs 'teammates', which awareness 'none' does not deliver"):
        CMOMMT(policy="group-forces", awareness="none")
