"""The contract's own check: it passes what we ship and refuses what breaks the contract, by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight.policies import POLICIES, Action, Percept, Policy, check_policy, column_of, turned
from teamsight.policies.registry import policy_named


@pytest.mark.short
@pytest.mark.parametrize("name", POLICIES)
def test_every_policy_of_the_registry_keeps_the_contract(name: str) -> None:
    policy = policy_named(name)
    assert isinstance(policy, Policy)
    check_policy(policy)


class Honest(Policy):
    """Goes straight on; subclasses break one rule each."""

    draws = 1

    def start(self, size: int) -> Any:
        return np.zeros(size)

    def decide(self, percept: Percept, memory: Any, noise: Any) -> Any:
        return Action(percept.heading, percept.speed * noise[0]), memory + 1


def broken(change: Any, **members: Any) -> Any:
    """An honest policy whose action is changed on the way out."""

    def decide(self: Any, percept: Percept, memory: Any, noise: Any) -> Any:
        return change(Action(percept.heading.copy(), 0.1 * noise[0]), memory, percept, noise)

    return type("Broken", (Honest,), {"decide": decide, **members})()


def spoil(action: Action, memory: Any, percept: Percept, noise: Any) -> Any:
    percept.speed[0] = 9.0
    return action, memory


WRONG = [
    (lambda a, m, p, n: [a, m], r"must return \(action, state\)"),
    (lambda a, m, p, n: a, r"returned ndarray as action; it must be Action\(heading, distance\)"),
    (lambda a, m, p, n: (np.zeros(3), m), r"returned ndarray as action; it must be Action\(heading, distance\)"),
    (lambda a, m, p, n: (Action(a.heading[:, :1], a.distance), m), r"action\.heading has the shape \(\d, 1\); \d robots need"),
    (lambda a, m, p, n: (Action(a.heading, a.distance[:, None]), m), r"action\.distance has the shape"),
    (lambda a, m, p, n: (Action(a.heading, a.distance * np.nan), m), r"action\.distance of robot 0 is nan; it must be finite"),
    (lambda a, m, p, n: (Action(a.heading * np.inf, a.distance), m), r"action\.heading of robot 0 is .* finite"),
    (lambda a, m, p, n: (Action(a.heading * 1.5, a.distance), m), r"length 1\.5; it must be a unit vector"),
    (lambda a, m, p, n: (Action(a.heading, np.random.default_rng().random(len(a.distance))), m), r"returned different a"),
    (spoil, r"changes its arguments"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), WRONG)
def test_what_breaks_the_contract_is_named(change: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=f"Broken.*{message}"):
        check_policy(broken(change))


@pytest.mark.parametrize("draws", [-1, 1.5, "2", True])
def test_draws_must_be_a_count(draws: Any) -> None:
    with pytest.raises((TypeError, ValueError), match=r"Broken\.draws=.*: must be (a whole number of )?at least 0"):
        check_policy(broken(lambda a, m, p, n: (a, m), draws=draws))


def test_what_is_no_policy_is_refused() -> None:
    with pytest.raises(TypeError, match=r"object: is not a policy; derive it from teamsight\.policies\.Policy"):
        check_policy(object())  # type: ignore[arg-type]


def test_an_honest_policy_passes() -> None:
    check_policy(Honest(), sizes=(1, 4, 33), steps=5)


def test_turning_headings() -> None:
    heading = np.array([[1.0, 0.0], [0.0, 1.0]])
    assert turned(heading, [np.pi / 2, np.pi]) == pytest.approx(np.array([[0, 1], [0, -1]]))


class Weighs(Policy):
    """Goes as far as its own load and the first teammate's fuel say."""

    columns = ("load", "fuel")

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        distance = percept.columns.load[percept.identity]
        for i in range(len(distance)):
            mine = percept.teammates.identity[percept.teammates.start[i] : percept.teammates.start[i + 1]]
            distance[i] += column_of(percept.columns.fuel, mine[0]) if len(mine) else 0.0
        return Action(percept.heading, distance), state


def test_the_column_that_is_nan_is_named() -> None:
    with pytest.raises(ValueError, match=r"is nan; it must be finite. It comes of the column 'fuel', which is NaN for"):
        check_policy(Weighs())
