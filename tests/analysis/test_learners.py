"""Learners by name, and their evaluation beside what they are measured by."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT
from teamsight.agents.awareness import NoAwareness, PairwiseAwareness, RingAwareness, SharedAwareness
from teamsight.agents.exploration import explore
from teamsight.analysis.crew import Crew, JobError
from teamsight.analysis.evaluation import (
    COLLECTIVE,
    COOPERATIVE,
    DESIGNED,
    RANDOM,
    Stage,
    contenders,
    evaluate,
    summary,
)
from teamsight.analysis.explore import Exploration
from teamsight.analysis.learners import LEARNERS, REWARDS, Lesson, awareness_for, learn
from teamsight.policies import RandomWalk, check_policy
from teamsight.policies.lazy_memory import LazyMemory

SMALL = Stage(robots=3, targets=5, radius=2.0, runs=3, steps=20, seed=1)


def memory(awareness: Any = "ring", robots: int = 3) -> LazyMemory:
    model = CMOMMT(robots=robots, targets=8, radius=1.5, policy=RandomWalk(), awareness=awareness, rng=4)
    return explore(model, 20)


@pytest.mark.parametrize("name", LEARNERS)
@pytest.mark.parametrize("reward", REWARDS)
def test_every_learner_learns_every_reward(name: str, reward: str) -> None:
    pairs = memory()
    if name == "sheppard" and reward != "own":
        with pytest.raises(ValueError, match="knows only what it itself gained and lost"):
            learn(name, pairs, Lesson(REWARDS[reward]))
        return
    policy = learn(name, pairs, Lesson(REWARDS[reward], gamma=0.5))
    assert (policy.inputs, policy.gamma) == (32, 0.5)
    assert learn(name, pairs, Lesson(REWARDS[reward]), inputs=16).inputs == 16
    check_policy(policy)


def test_k_reaches_the_learners_that_match() -> None:
    assert learn("lazy", memory(), Lesson(k=7)).k == 7
    assert learn("pessimistic", memory(), Lesson(k=7)).k == 7
    with pytest.raises(ValueError, match="learner='lasy': unknown; did you mean 'lazy'"):
        learn("lasy", memory())


def test_a_memory_tells_the_degree_that_shows_its_situations() -> None:
    for degree in (NoAwareness(), RingAwareness(8), PairwiseAwareness(), SharedAwareness()):
        pairs = memory(degree)
        assert awareness_for(pairs) == degree
        assert awareness_for(pairs, 16) == NoAwareness()
    pairs = memory()
    unnamed = LazyMemory.of(
        pairs.situation, pairs.action, pairs.next_situation, {name: pairs.fact(name) for name in pairs.facts}
    )
    with pytest.raises(ValueError, match="degree of awareness None, which is not one of none, ring, pairwise, shared"):
        awareness_for(unnamed)


@pytest.mark.short
def test_an_evaluation_is_what_each_model_gives_alone() -> None:
    policies = contenders("linear", memory(), Lesson())
    assert list(policies) == [COOPERATIVE, COLLECTIVE, DESIGNED, RANDOM]
    seen: list[float] = []
    with Crew(1) as crew:
        table = evaluate(policies, SMALL, crew, lambda done, total: seen.append(done / total))
    assert seen[-1] == 1
    assert len(table) == 12
    for _, row in table.iterrows():
        policy, degree = policies[row["policy"]]
        model = CMOMMT(robots=3, targets=5, radius=2.0, policy=policy, awareness=degree, rng=row["seed"])
        model.run(20)
        assert row["observed_fraction"] == model.observed_fraction
        model.close()


def test_a_memory_without_teammates_has_no_cooperative_learner() -> None:
    assert list(contenders("tabular", memory("none"), Lesson())) == [COLLECTIVE, DESIGNED, RANDOM]


def test_a_team_of_another_size_is_refused_where_the_degree_depends_on_it() -> None:
    policies = contenders("linear", memory("pairwise"), Lesson())
    with Crew(1) as crew, pytest.raises(JobError, match="20 inputs|reads 20"):
        evaluate(policies, SMALL._replace(robots=4), crew)


def test_the_summary_is_student_by_hand() -> None:
    shares = {"a": [0.5, 0.7, 0.6], "b": [0.4, 0.5, 0.6]}
    rows = [
        {
            "policy": name,
            "robots": 1,
            "targets": 1,
            "radius": 1.0,
            "replicate": k,
            "seed": k,
            "observed_fraction": share,
        }
        for name, found in shares.items()
        for k, share in enumerate(found)
    ]
    found = summary(pd.DataFrame(rows)).set_index("policy")
    assert found["mean"].tolist() == pytest.approx([0.6, 0.5])
    # t with 2 degrees of freedom: 4.3027; the standard deviations are 0.1 and, of the differences, 0.1.
    half = 4.302653 * 0.1 / math.sqrt(3)
    assert found.loc["a", "high"] - 0.6 == pytest.approx(half, rel=1e-6)
    assert (found.loc["b", "more"], found.loc["b", "more_low"]) == pytest.approx((0.1, 0.1 - half))
    assert np.isnan(found.loc["a", "more"])


def test_no_world_is_both_explored_and_evaluated() -> None:
    exploration = Exploration(robots=5, targets=15, radius=3.0, runs=50)
    explored = {exploration.run_seed(run) for run in range(50)}
    assert explored.isdisjoint({Stage().run_seed(run) for run in range(50)})
    assert len(explored) == 50
