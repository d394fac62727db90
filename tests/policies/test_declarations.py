"""What a policy declares wrongly is named where the policy is first used, and so is what its kernel must not use."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Robot, World, check_policy
from teamsight.core.kernel import kernel
from teamsight.policies import CompiledPolicy, go
from teamsight.world.arena import Disc


@kernel
def _ahead(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(len(percept.heading)):
        go(action, i, 0.0, 0.0, percept.speed[i])


@kernel
def _numpy_numbers(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(len(percept.heading)):
        go(action, i, 0.0, 0.0, np.random.random())  # noqa: NPY002 numpy.random.random


@kernel
def _numbers_of_random(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(len(percept.heading)):
        go(action, i, 0.0, 0.0, random.random())  # random.random


@kernel
def _other_predators(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(len(percept.heading)):
        go(action, i, 0.0, 0.0, percept.channels.predator.start[i])


def policy(rule: Any = _ahead, **declared: Any) -> CompiledPolicy:
    return type("Mine", (CompiledPolicy,), {"kernel": rule, **declared})()  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("declared", "text"),
    [
        ({"draws": 1.5}, r"draws=1\.5: must be a whole number"),
        ({"inputs": "18"}, r"inputs='18': must be a whole number"),
        ({"inputs": -1}, r"inputs=-1: must be at least 0"),
        ({"channels": "predators"}, r"channels='predators': must be a tuple of names, such as \('predators',\)"),
        ({"channels": ["predators"]}, r"channels=\['predators'\]: must be a tuple"),
        ({"channels": ("targets",)}, r"'targets' is a field of percepts, percept\.targets; leave it out"),
        ({"channels": ("a b",)}, r"'a b': must be a name for an attribute"),
        ({"needs": "relayed"}, r"needs='relayed': must be a tuple of names, such as \('relayed',\)"),
        ({"needs": ("relay",)}, r"'relay': unknown; did you mean 'relayed'"),
    ],
)
def test_wrong_declarations_are_named(declared: dict[str, Any], text: str) -> None:
    with pytest.raises((TypeError, ValueError), match=text):
        check_policy(policy(**declared))
    with pytest.raises((TypeError, ValueError), match=text):
        CMOMMT(policy=policy(**declared))


def test_a_missing_kernel_is_named() -> None:
    class Empty(CompiledPolicy):
        pass

    with pytest.raises(TypeError, match=r"Empty: has no 'kernel'; give kernel\(percept, arrays,"):
        CMOMMT(policy=Empty())


@pytest.mark.parametrize(("rule", "name"), [(_numpy_numbers, "numpy.random.random"), (_numbers_of_random, "random.random")])
def test_random_numbers_without_a_seed_are_refused_with_their_line(rule: Any, name: str) -> None:
    with open(__file__, encoding="utf-8") as file:
        (line,) = (at for at, text in enumerate(file, 1) if text.endswith(f" {name}\n"))
    with pytest.raises(TypeError, match=rf"test_declarations\.py:{line}: kernels cannot use {name}; .*declare draws"):
        CMOMMT(policy=policy(rule), rng=1).run(1)


def test_a_channel_that_the_policy_does_not_declare_is_named() -> None:
    with pytest.raises(TypeError, match=r"declares the channels .*, but not 'predator'; did you mean 'predators'"):
        check_policy(policy(_other_predators, channels=("predators",)))


def test_a_channel_that_a_percept_does_not_have_is_named() -> None:
    robots = World(Disc(1.0), rng=1).add(Robot, 1, policy=policy())
    with pytest.raises(AttributeError, match=r"channels\.beacons: .*world\.senses\(group, others, as_='beacons'\)"):
        _ = robots[0].percept.channels.beacons
