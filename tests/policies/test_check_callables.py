"""`check_policy` on callables for one robot, and what a kernel that numba refuses says."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from teamsight.core.kernel import kernel
from teamsight.policies import CompiledPolicy, check_policy, turn_to


def test_a_rule_that_keeps_the_contract_passes() -> None:
    check_policy(lambda percept, rng: (rng.normal(), percept.speed))


@pytest.mark.parametrize(
    ("rule", "error", "message"),
    [
        (lambda percept, rng: 1.0, TypeError, "two numbers"),
        (lambda percept, rng: (math.nan, 1.0), ValueError, "finite"),
        (lambda percept, rng: (90.0, 1.0), ValueError, r"the turn 90 for robot 0; it is in radians.*np.radians\(turn\)"),
        (lambda percept, rng: (np.random.default_rng().random(), 1.0), ValueError, "different answers"),
        (lambda percept, rng: (percept.heading.fill(0.0) or 0.0, 1.0), ValueError, "changes its percept"),
    ],
)
def test_a_rule_that_breaks_the_contract_is_refused(rule: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        check_policy(rule)


@kernel
def _copies_a_row(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        action.heading[i] = percept.heading[i]


@dataclass(frozen=True)
class CopiesARow(CompiledPolicy):
    kernel = _copies_a_row
    parameters = ()


def test_a_kernel_that_copies_an_array_is_named_where_and_what_to_do() -> None:
    with pytest.raises(TypeError, match=r"test_check_callables\.py:\d+: the kernel makes or copies") as caught:
        check_policy(CopiesARow())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("way", "turn"), [((0, 2), 0.0), ((-3, 0), np.pi / 2), ((1, 0), -np.pi / 2), ((0, 0), 0.0)])
def test_the_turn_to_a_direction(way: tuple[float, float], turn: float) -> None:
    assert turn_to((0.0, 1.0), way) == pytest.approx(turn)
