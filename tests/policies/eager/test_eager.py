"""The eager learners against their slow twins, on a chain whose Q is known, and in worlds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from naive import eager as naive

from teamsight import CMOMMT
from teamsight.agents.recording.explore import explore
from teamsight.policies import check_policy
from teamsight.policies.check import sample_percept
from teamsight.policies.eager import ActionGrid, LinearQ, StateGrid, TabularQ
from teamsight.policies.memory import LazyMemory

LEARNERS = [TabularQ, LinearQ]
NEAR, FAR, NOTHING = 0.0, 0.5, 1.0


def goal(memory: LazyMemory) -> Any:
    return np.asarray(memory.fact("goal"), float)


def chain(copies: int = 1) -> LazyMemory:
    """Nothing ↔ far ↔ near: ahead leads nearer and, when near, pays 1; back leads away and costs 1 where there is a way."""
    ahead, back = (0.0, 1.0), (math.pi, 1.0)
    steps = [
        (NEAR, ahead, NEAR, 1), (FAR, ahead, NEAR, 1), (NOTHING, ahead, FAR, 0),
        (NEAR, back, FAR, -1), (FAR, back, NOTHING, -1), (NOTHING, back, NOTHING, 0),
    ] * copies  # fmt: skip
    ring = [[reading, 1, 1, 1] for reading, *_ in steps]
    after = [[reading, 1, 1, 1] for _, _, reading, _ in steps]
    facts = {"goal": [reward for *_, reward in steps]}
    return LazyMemory.of(ring, [action for _, action, _, _ in steps], after, facts, own=4, settings={"degree": "none"})


# With γ = ½: Q(near, ahead) = 1 + ½ · 2 = 2, and so on from there.
KNOWN = {(NEAR, 0): 2.0, (FAR, 0): 2.0, (NOTHING, 0): 1.0, (NEAR, 1): 0.0, (FAR, 1): -0.5, (NOTHING, 1): 0.5}
TWO = ActionGrid(2, (1.0,))


def value(learner: TabularQ | LinearQ, reading: float, action: int) -> float:
    situation = np.array([[reading, 1, 1, 1]], np.float32)
    if isinstance(learner, TabularQ):
        return float(learner.table[learner.states.index(situation)[0], action])
    return float(learner.weights[action] @ naive.features(situation[0], learner.features))


@pytest.mark.parametrize("copies", [1, 3])
def test_on_a_chain_both_learn_the_q_that_is_known(copies: int) -> None:
    memory = chain(copies)
    tabular = TabularQ(memory, goal, discount=0.5, actions=TWO)
    linear = LinearQ(memory, goal, discount=0.5, actions=TWO, learning_rate=1.0, sweeps=2000)
    for (reading, action), known in KNOWN.items():
        assert value(tabular, reading, action) == pytest.approx(known, abs=1e-6)
        assert value(linear, reading, action) == pytest.approx(known, abs=2e-3)
    assert tabular.met == 3 / 81


def explored(degree: str, steps: int = 60) -> LazyMemory:
    return explore(CMOMMT(robots=3, targets=10, radius=1.5, policy="random-walk", awareness=degree, rng=5), steps)


def transitions_of(memory: LazyMemory, learner: TabularQ | LinearQ, reward: Any) -> list[tuple[Any, int, Any, float]]:
    grid = learner.actions
    actions = [naive.action_number(*map(float, taken), grid.rotations, grid.distances) for taken in memory.action]
    before, after = (np.asarray(part)[:, : learner.inputs] for part in (memory.situation, memory.next_situation))
    return list(zip(before, actions, after, reward(memory).tolist(), strict=True))


def gain(memory: LazyMemory) -> Any:
    return np.asarray(memory.fact("gained"), float) - memory.fact("lost")


@pytest.mark.parametrize(
    ("degree", "inputs", "shape"),
    [
        ("none", 16, (4, 3)),
        ("ring", None, (4, 3)),
        ("ring", 16, (8, 2)),
        ("pairwise", None, (2, 3)),
        ("shared", None, (2, 4)),
        ("none", None, (1, 5)),
    ],
)
def test_the_table_is_that_of_the_twin(degree: str, inputs: int | None, shape: tuple[int, int]) -> None:
    memory = explored(degree)
    learner = TabularQ(
        memory, gain, inputs=inputs, sectors=shape[0], levels=shape[1], sweeps=7, actions=ActionGrid(6, (0.0, 0.5, 1.0))
    )
    states = learner.states
    merged = naive.sensors(states.own, states.added, learner.degree, states.sectors)
    assert len(merged) == states.dimensions
    transitions = [
        (naive.state(before, merged, shape[1]), action, naive.state(after, merged, shape[1]), reward)
        for before, action, after, reward in transitions_of(memory, learner, gain)
    ]
    expected = naive.table(transitions, learner.discount, 7)
    for levels, actions in expected.items():
        number = sum(level * shape[1] ** place for place, level in enumerate(reversed(levels)))
        row = learner.table[number]
        assert {int(a): pytest.approx(row[a], abs=1e-5) for a in np.flatnonzero(row > -np.inf)} == actions
    assert (learner.table > -np.inf).sum() == sum(map(len, expected.values()))
    assert learner.met == len(expected) / len(states)


@pytest.mark.parametrize(
    ("degree", "inputs", "features"), [("none", None, 3), ("ring", None, 1), ("pairwise", None, 2), ("shared", 16, 4)]
)
def test_the_weights_are_those_of_the_twin(degree: str, inputs: int | None, features: int) -> None:
    memory = explored(degree, steps=30)
    learner = LinearQ(memory, gain, inputs=inputs, features=features, sweeps=3, seed=9, learning_rate=0.3)
    expected = naive.weights(transitions_of(memory, learner, gain), 16, features, learner.discount, 0.3, 3, 9)
    assert np.abs(learner.weights - expected).max() < 1e-5
    assert np.abs(learner.weights).max() > 0.01


@pytest.mark.parametrize("kind", LEARNERS)
@pytest.mark.parametrize("degree", ["none", "ring", "pairwise"])
def test_robots_do_what_the_twin_finds_best(kind: Any, degree: str) -> None:
    learner = kind(explored(degree), gain, actions=ActionGrid(5, (0.0, 0.5, 1.0)))
    rng = np.random.default_rng(1)
    percept = sample_percept(200, rng, learner.inputs)
    situation = np.where(rng.random(percept.situation.shape) < 0.8, np.float32(1.0), percept.situation)
    situation[:100] = learner.memory.situation[:100]
    percept = percept._replace(situation=np.ascontiguousarray(situation))
    noise = rng.random((learner.draws, 200))
    action, _ = learner.decide(percept, learner.start(200), noise)
    random = 0
    for i, seen in enumerate(percept.situation):
        if kind is TabularQ:
            states = learner.states
            values = learner.table[states.index(seen[None])[0]]
            merged = naive.sensors(states.own, states.added, degree, states.sectors)
            levels = naive.state(seen, merged, states.levels)
            assert states.index(seen[None])[0] == sum(level * 3**place for place, level in enumerate(reversed(levels)))
        else:
            values = learner.weights.astype(float) @ naive.features(seen, learner.features)
        if values.max() == -np.inf:
            random += 1
            rotation, distance = 2 * math.pi * (noise[0, i] - 0.5), noise[1, i]
        else:
            best = int(values.argmax())
            rotation, distance = 2 * math.pi * (best // 3) / 5, (best % 3) / 2
        aim = complex(*percept.heading[i]) * complex(math.cos(rotation), math.sin(rotation))
        assert abs(aim - complex(*action.heading[i])) < 1e-9
        assert action.distance[i] == pytest.approx(distance * percept.speed[i])
    assert (0 < random < 200) == (kind is TabularQ)


@pytest.mark.short
@pytest.mark.parametrize("kind", LEARNERS)
def test_a_learner_keeps_the_contract_and_both_paths(kind: Any) -> None:
    learner = kind(explored("ring"), gain)
    check_policy(learner)
    running, stepping = (CMOMMT(robots=4, awareness="ring", policy=learner, rng=2) for _ in range(2))
    running.run(40)
    for _ in range(40):
        stepping.step()
    assert running.recording.history.equals(stepping.recording.history)
    assert running.robots.position.tobytes() == stepping.robots.position.tobytes()
    with pytest.raises(ValueError, match="learned from situations|reads 32 inputs"):
        CMOMMT(robots=4, awareness="none", policy=learner, rng=2)


@pytest.mark.parametrize("kind", LEARNERS)
def test_what_is_learned_depends_on_pairs_and_reward_alone(kind: Any) -> None:
    memory = explored("ring")
    order = np.random.default_rng(3).permutation(len(memory))
    facts = {name: memory.fact(name)[order] for name in memory.facts}
    shuffled = LazyMemory.of(
        memory.situation[order], memory.action[order], memory.next_situation[order], facts, settings=memory.settings
    )
    one, other = kind(memory, gain), kind(shuffled, gain)
    assert one.table.tobytes() == other.table.tobytes()
    assert repr(one) == repr(other) != repr(kind(memory, lambda memory: -gain(memory)))
    assert kind(memory, gain, inputs=16).inputs == 16


def test_a_table_that_no_exploration_could_fill_is_refused() -> None:
    StateGrid(16, 16, (16,))
    with pytest.raises(
        ValueError, match=r"3\^20 states .3 readings of 20 sensors.: must have at most 1,000,000.*LinearQ or LazyQ"
    ):
        StateGrid(16, 64, (16,) * 4)
    with pytest.raises(ValueError, match=r"3\^22 states"):
        StateGrid(16, 18)
    with pytest.raises(ValueError, match="sectors=5: must divide the 16 sectors of targets evenly; give 16 or a divisor"):
        StateGrid(16, 0, sectors=5)
    with pytest.raises(ValueError, match="sectors=4: must divide the 6 sectors of a ring that the degree .* evenly; give 2 or a divisor"):
        StateGrid(16, 6, (6,))
    with pytest.raises(ValueError, match="sectors=4: must divide the 7 sectors of a ring that the degree .* evenly; give 1"):
        StateGrid(16, 7, [7])
    with pytest.raises(ValueError, match=r"rings=\(16, 1\): must be numbers of sectors, in all at most 16"):
        StateGrid(16, 16, (16, 1))


@pytest.mark.parametrize("kind", LEARNERS)
def test_readings_beyond_0_and_1_count_as_these(kind: Any) -> None:
    # Only a degree of awareness of the user's own delivers such; kernels must not go astray on them.
    rng = np.random.default_rng(2)
    size = 300
    wild = rng.choice(np.float32([-1e29, -3, -0.01, 0.3, 0.9, 1.2, 1e29]), (2, size, 16))
    action = np.stack([rng.uniform(-3, 3, size), rng.random(size)], axis=1)
    facts = {"gained": rng.integers(0, 2, size), "lost": rng.integers(0, 2, size)}
    one, other = (LazyMemory.of(before, action, after, facts, settings={}) for before, after in (wild, wild.clip(0, 1)))
    percept = sample_percept(size, rng, 16)
    noise = rng.random((kind.draws if isinstance(kind.draws, int) else 2, size))
    learner = kind(other)
    clipped, _ = learner.decide(percept._replace(situation=wild[0].clip(0, 1)), learner.start(size), noise)
    beyond, _ = learner.decide(percept._replace(situation=wild[0]), learner.start(size), noise)
    assert beyond.heading.tobytes() == clipped.heading.tobytes()
    assert beyond.distance.tobytes() == clipped.distance.tobytes()
    if kind is TabularQ:
        assert kind(one).table.tobytes() == learner.table.tobytes()
    else:
        # The order of the transitions is that of their content, which differs.
        assert np.isfinite(kind(one).weights).all()


@pytest.mark.parametrize(
    ("kind", "settings", "message"),
    [
        (TabularQ, {"levels": 1}, "levels=1: must be at least 2; one for a sensed body, one for none"),
        (LinearQ, {"discount": 1.0, "learning_rate": 1.0, "reward": lambda memory: np.full(len(memory), 1e37), "sweeps": 400}, "learning diverges; lower one"),
        (TabularQ, {"actions": 8}, "actions=8: must be an ActionGrid"),
        (TabularQ, {"inputs": 20}, "inputs=20"),
        (TabularQ, {"reward": lambda memory: np.full(len(memory), 1e39)}, "values exceed float32; give smaller rewards"),
        (TabularQ, {"reward": lambda memory: np.full(len(memory), -1e39)}, "values exceed float32; give smaller rewards"),
        (LinearQ, {"reward": lambda memory: np.full(len(memory), np.nan)}, "nan"),
        (LinearQ, {"reward": lambda memory: np.zeros(3)}, "shape"),
    ],
)  # fmt: skip
def test_bad_constants_are_refused(kind: Any, settings: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        kind(explored("ring"), **settings)
