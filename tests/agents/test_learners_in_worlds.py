"""Learners in worlds: both paths agree, worlds of another degree are refused, and without teammates nobody misses them."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT
from teamsight.agents.awareness import Awareness, NoAwareness, PairwiseAwareness, RingAwareness, SharedAwareness
from teamsight.agents.awareness.interface import Width
from teamsight.agents.recording.explore import explore
from teamsight.core.kernel import kernel
from teamsight.policies import LazyQ, LazyRegression, PessimisticLazyQ, Policy, RandomWalk, SheppardLazyQ
from teamsight.policies.eager import LinearQ, TabularQ
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import team_reward

pytestmark = pytest.mark.filterwarnings("error:run.. makes its steps one by one")


@cache
def memory(degree: Any = RingAwareness(), robots: int = 5, seed: int = 1) -> LazyMemory:  # noqa: B008
    """What a short exploration leaves."""
    return explore(
        CMOMMT(
            robots=robots, targets=10, radius=2.5, policy=RandomWalk(random_distance=True), awareness=degree, rng=seed
        ),
        60,
    )


# Made when a test needs them: to explore and to learn compiles, which must not happen while tests are collected.
LEARNERS: list[tuple[Callable[[], Any], Any]] = [
    (lambda: LazyQ(memory()), RingAwareness()),
    (lambda: LazyQ(memory(), inputs=16), NoAwareness()),
    (lambda: LazyQ(memory(), team_reward, k=3, discount=0.9, sweeps=30), RingAwareness()),
    (lambda: LazyQ(memory(RingAwareness(5))), RingAwareness(5)),
    (lambda: LazyQ(memory(PairwiseAwareness())), PairwiseAwareness()),
    (lambda: LazyQ(memory(SharedAwareness())), SharedAwareness()),
    (lambda: LazyRegression(memory()), RingAwareness()),
    (lambda: LazyRegression(memory(), inputs=16), NoAwareness()),
    (lambda: LazyRegression(memory(), team_reward, significance=0), RingAwareness()),
    (lambda: LazyRegression(memory(RingAwareness(5))), RingAwareness(5)),
    (lambda: LazyRegression(memory(RingAwareness(70)), significance=0), RingAwareness(70)),
    (lambda: LazyRegression(memory(PairwiseAwareness()), significance=0), PairwiseAwareness()),
    (lambda: PessimisticLazyQ(memory()), RingAwareness()),
    (lambda: PessimisticLazyQ(memory(), inputs=16), NoAwareness()),
    (lambda: SheppardLazyQ(), RingAwareness()),
    (lambda: SheppardLazyQ(inputs=16, capacity=20), NoAwareness()),
    (lambda: SheppardLazyQ(memory=memory()), RingAwareness()),
]  # fmt: skip


@cache
def made(make: Callable[[], Any]) -> Any:
    """Return what a function makes, which is made once."""
    return make()


def shown(value: Any) -> str | None:
    return str(value) if isinstance(value, Awareness) else None


def seeds() -> int:
    return fresh_seed()


def world(policy: Any, awareness: Any, seed: int) -> CMOMMT:
    return CMOMMT(robots=5, targets=8, radius=2.0, policy=policy, awareness=awareness, rng=seed)


def fingerprint(model: CMOMMT) -> list[bytes]:
    arrays = [model.robots.position, model.robots.heading, *model.robots.policy_state, model.recording.history.to_numpy()]
    return [array.tobytes() for array in arrays]


@pytest.mark.parametrize(("make", "awareness"), LEARNERS, ids=shown)
def test_stepping_and_running_agree_bit_for_bit(make: Callable[[], Any], awareness: Any) -> None:
    policy, seed = made(make), seeds()
    running, stepping, mixed = (world(policy, awareness, seed) for _ in range(3))
    running.run(60)
    for _ in range(60):
        stepping.step()
    for steps in (1, 17, 2, 40):
        mixed.run(steps)
    assert fingerprint(running) == fingerprint(stepping) == fingerprint(mixed)
    assert (running.robots.position != world(policy, awareness, seed).robots.position).any()


class Plain(Policy):
    """The same policy, as its NumPy side only."""

    def __init__(self, policy: Any) -> None:
        self.policy, self.draws, self.inputs = policy, policy.draws, policy.inputs

    def start(self, size: int) -> Any:
        return self.policy.start(size)

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        return self.policy.decide(percept, state, noise)


@pytest.mark.parametrize(("make", "awareness"), LEARNERS, ids=shown)
def test_called_from_python_they_agree_with_their_kernel_in_the_loop(make: Callable[[], Any], awareness: Any) -> None:
    policy, seed = made(make), seeds()
    compiled, plain = (world(one, awareness, seed) for one in (policy, Plain(policy)))
    compiled.run(40)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plain.run(40)
    assert fingerprint(compiled) == fingerprint(plain)


@pytest.mark.parametrize("kind", [LazyQ, LazyRegression, PessimisticLazyQ])
def test_without_teammates_cooperative_and_collective_agree_exactly(kind: Any) -> None:
    lonely = memory(robots=1)
    seed = seeds()
    models = [
        CMOMMT(robots=1, radius=1.5, policy=policy, awareness=awareness, rng=seed)
        for policy, awareness in ((kind(lonely), "ring"), (kind(lonely, inputs=16), "none"))
    ]
    for model in models:
        model.run(300)
    assert fingerprint(models[0]) == fingerprint(models[1])
    assert models[0].observed_fraction > 0


def test_a_pickled_learner_lives_the_same_life() -> None:
    seed = seeds()
    for make, awareness in LEARNERS[-2:] + LEARNERS[:2]:
        policy = made(make)
        one, other = (world(p, awareness, seed) for p in (policy, pickle.loads(pickle.dumps(policy))))
        one.run(30)
        other.run(30)
        assert fingerprint(one) == fingerprint(other)


@pytest.mark.parametrize(
    ("make", "given", "message"),
    [
        # Nine robots under pairwise awareness have 32 inputs too; they mean something else.
        (lambda: LazyQ(memory()), {"awareness": "pairwise", "robots": 9}, r"LazyQ: learned from situations of awareness 'ring', but these robots have 'pairwise'; use awareness='ring' \(--awareness ring\)$"),
        (lambda: LazyQ(memory()), {"awareness": "none"}, r"learned from .* 'ring', .*'none'; use awareness='ring'"),
        (lambda: LazyQ(memory(), inputs=16), {"awareness": "ring"}, r"'none', but these robots have 'ring'; use awareness='none' \(--awareness none\), or leave out inputs=16$"),
        (lambda: PessimisticLazyQ(memory(), inputs=16), {"awareness": "pairwise", "robots": 1}, r"use awareness='none' \(--awareness none\)$"),
        (lambda: LazyQ(memory()), {"awareness": "ring", "delta": 8}, r"reads 32 inputs, but awareness 'ring' gives 24 in a team of 10; use RingAwareness\(delta=16\)"),
        (lambda: LazyQ(memory(RingAwareness(5))), {"awareness": "ring"}, r"reads 21 inputs.*use RingAwareness\(delta=5\)"),
        (lambda: LazyQ(memory(PairwiseAwareness())), {"awareness": "pairwise", "robots": 6}, r"reads 24 inputs, but awareness 'pairwise' gives 26 in a team of 6; explore with this degree and this team"),
        (lambda: SheppardLazyQ(memory=memory()), {"awareness": "pairwise", "robots": 9}, r"learned from .* 'ring'"),
        (lambda: "lazy-cooperative", {"awareness": "none"}, r"policy='lazy-cooperative': learned from .*use awareness='ring' \(--awareness ring\)$"),
        (lambda: SheppardLazyQ(), {"awareness": "none"}, r"reads 32 inputs, but awareness 'none' gives 16"),
    ],
)  # fmt: skip
def test_a_world_of_another_degree_is_refused(make: Callable[[], Any], given: dict[str, Any], message: str) -> None:
    policy = make()
    with pytest.raises(ValueError, match=message):
        CMOMMT(policy=policy, rng=1, **given).run(1)


@kernel
def _situate_wrongly(scene: Any, parameters: Any, situation: Any) -> None:
    for i in range(situation.shape[0]):
        for component in range(situation.shape[1]):
            situation[i, component] = parameters[0] if i == 3 and component == 2 else 1.0


@dataclass(frozen=True)
class Wrong(Awareness):
    """A user's own degree, in which one reading of the fourth robot is no reading."""

    reading: float

    name = "ring"
    order = "?"
    situate = _situate_wrongly

    @property
    def parameters(self) -> tuple[float, ...]:
        return (self.reading,)

    def width(self, team_size: int) -> Width:
        return Width(16, 16)


@pytest.mark.parametrize("reading", [np.nan, np.inf, -1e31])
@pytest.mark.parametrize(
    ("kind", "options"),
    [(LazyQ, {}), (LazyRegression, {}), (PessimisticLazyQ, {}), (SheppardLazyQ, {}), (TabularQ, {}), (LinearQ, {"sweeps": 1})],
)
def test_an_invalid_situation_is_refused_on_both_paths(kind: Any, options: dict[str, Any], reading: float) -> None:
    policy, name = kind(**options) if kind is SheppardLazyQ else kind(memory(), **options), kind.__name__
    with pytest.raises(ValueError, match=rf"{name}: an action of robot.* is not finite.*check_awareness"):
        world(policy, Wrong(reading), 1).run(2)
    with pytest.raises(ValueError, match=rf"{name}: an action of robot.* is not finite.*check_awareness"):
        world(policy, Wrong(reading), 1).step()
    with pytest.raises(ValueError, match=f"{name}: the situation of robot 3 holds NaN or more than"):
        world(Plain(policy), Wrong(reading), 1).step()
    world(policy, Wrong(0.5), 1).run(2)


def test_a_memory_without_a_degree_is_judged_by_its_width() -> None:
    known = memory()
    unnamed = LazyMemory(known.table, known.own, known.added, known.facts, {})
    CMOMMT(policy=LazyQ(unnamed), awareness="ring", rng=1).run(1)
    with pytest.raises(ValueError, match="reads 32 inputs"):
        CMOMMT(policy=LazyQ(unnamed), awareness="none", rng=1)


def test_a_learner_sees_no_lists_of_teammates_but_its_robots_do() -> None:
    """The degree of awareness writes them when somebody asks, with the values that another policy would be given."""
    learned, walking = (CMOMMT(robots=8, radius=2.0, policy=each, awareness="ring", rng=3) for each in (LazyQ(memory()), "stationary"))
    for model in (learned, walking):
        model.run(1)
    for one, other in zip(learned.robots, walking.robots, strict=True):
        other.position, other.heading = one.position, one.heading
    for one, other in zip(learned.robots, walking.robots, strict=True):
        assert one.percept.teammates.distance.tolist() == other.percept.teammates.distance.tolist()
    assert any(len(robot.percept.teammates.distance) for robot in learned.robots)
