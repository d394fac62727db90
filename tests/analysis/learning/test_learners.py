"""Learners by name, and their evaluation beside what they are measured by."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT
from teamsight.agents.awareness import NoAwareness, PairwiseAwareness, RingAwareness, SharedAwareness
from teamsight.agents.recording.explore import explore
from teamsight.analysis.learning.evaluation import (
    BY_HAND,
    COLLECTIVE,
    COOPERATIVE,
    DESIGNED,
    EVOLVED,
    RANDOM,
    Scenario,
    bodies_of,
    check_team,
    contenders,
    evaluate,
    summary,
)
from teamsight.analysis.learning.explore import Exploration
from teamsight.analysis.learning.learners import (
    Objective,
    awareness_for,
    check_objective,
    default_of,
    default_reward,
    learn,
)
from teamsight.analysis.learning.registry import LEARNERS, REWARDS
from teamsight.analysis.runs.executor import JobError
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.policies import RandomWalk, check_policy
from teamsight.policies.memory import LazyMemory
from teamsight.tasks.pursuit import Pursuit

SMALL = Scenario(robots=3, targets=5, radius=2.0, runs=3, steps=20, seed=1)


def memory(awareness: Any = "ring", robots: int = 3) -> LazyMemory:
    model = CMOMMT(robots=robots, targets=8, radius=1.5, policy=RandomWalk(), awareness=awareness, rng=4)
    return explore(model, 20)


@pytest.mark.parametrize("name", LEARNERS)
@pytest.mark.parametrize("reward", REWARDS)
def test_every_learner_learns_every_reward(name: str, reward: str) -> None:
    pairs = memory() if reward != "interaction" else explore(Pursuit(awareness="ring", rng=4), 20)
    if name == "sheppard" and reward != "own":
        with pytest.raises(ValueError, match="must depend only on the facts gained and lost"):
            learn(name, pairs, Objective(REWARDS[reward]))
        return
    policy = learn(name, pairs, Objective(REWARDS[reward], discount=0.5))
    assert (policy.inputs, getattr(policy, "discount", None)) == (32, None if name == "regression" else 0.5)
    assert learn(name, pairs, Objective(REWARDS[reward]), inputs=16).inputs == 16
    check_policy(policy)


def test_a_reward_of_interactions_needs_some() -> None:
    with pytest.raises(ValueError, match="nothing interacted.*give another reward"):
        learn("linear", memory(), Objective(REWARDS["interaction"]))


def test_without_an_objective_each_learner_has_its_own_defaults() -> None:
    for name in LEARNERS:
        policy = learn(name, memory())
        assert policy.reward == REWARDS[default_reward(name)] == default_of(name, "reward")
        for constant in ("k", "discount"):
            assert getattr(policy, constant, None) == default_of(name, constant)
    assert {name for name in LEARNERS if default_reward(name) == "keep"} == {"regression"}
    assert {name for name in LEARNERS if default_of(name, "discount") is None} == {"regression"}


def test_k_reaches_the_learners_that_match() -> None:
    assert learn("lazy", memory(), Objective(k=7)).k == 7
    assert learn("pessimistic", memory(), Objective(k=7)).k == 7
    with pytest.raises(ValueError, match="learner='lasy': unknown; did you mean 'lazy'"):
        learn("lasy", memory())


def test_a_memory_reports_the_degree_that_shows_its_situations() -> None:
    for degree in (NoAwareness(), RingAwareness(8), PairwiseAwareness(), SharedAwareness()):
        pairs = memory(degree)
        assert awareness_for(pairs) == degree
        assert awareness_for(pairs, 16) == NoAwareness()
    pairs = memory()
    unnamed = LazyMemory.of(
        pairs.situation, pairs.action, pairs.next_situation, {name: pairs.fact(name) for name in pairs.facts}
    )
    with pytest.raises(ValueError, match="degree of awareness None, which is not one of none, ring, "):
        awareness_for(unnamed)


@pytest.mark.short
def test_an_evaluation_is_what_each_model_gives_alone() -> None:
    policies = contenders("linear", memory(), Objective())
    assert list(policies) == [COOPERATIVE, COLLECTIVE, *BY_HAND, DESIGNED, EVOLVED, RANDOM]
    seen: list[float] = []
    with WorkerPool(1) as pool:
        table = evaluate(policies, SMALL, pool, lambda done, total: seen.append(done / total))
    assert seen[-1] == 1
    assert len(table) == 3 * 10
    for _, row in table.iterrows():
        policy, degree = policies[row["policy"]]
        model = CMOMMT(robots=3, targets=5, radius=2.0, policy=policy, awareness=degree, rng=row["seed"])
        model.run(20)
        assert row["observed_fraction"] == model.observed_fraction
        model.close()


def test_a_memory_without_teammates_has_no_cooperative_learner() -> None:
    assert list(contenders("tabular", memory("none"), Objective())) == [COLLECTIVE, *BY_HAND, DESIGNED, EVOLVED, RANDOM]


def test_a_team_of_another_size_is_refused_where_the_degree_depends_on_it() -> None:
    policies = contenders("linear", memory("pairwise"), Objective())
    with WorkerPool(1) as pool, pytest.raises(JobError, match="20 inputs|reads 20"):
        evaluate(policies, SMALL._replace(robots=4), pool)


def test_a_team_of_another_size_is_refused_before_anything_is_learned() -> None:
    with pytest.raises(
        ValueError, match=r"robots=4: awareness 'pairwise' gives 22 inputs in a team of 4.* has 20, from a team of 3"
    ):
        check_team(memory("pairwise"), 4)
    check_team(memory("pairwise"), 3)
    check_team(memory("ring"), 40)
    check_team(memory("none"), 40)


@pytest.mark.parametrize(
    ("learners", "reward", "k", "pairs", "message"),
    [
        (("sheppard",), "keep", None, None, "reward=keep: sheppard .* give the reward own, or another learner"),
        (("linear", "sheppard"), "team", None, None, "reward=team: sheppard"),
        (("sheppard",), "own", 5, None, "k=5: sheppard matches no fixed number"),
        (("tabular", "linear"), "own", 5, None, "k=5: tabular and linear match no fixed number"),
        (("lazy",), "own", 129, None, "k=129: must be at most 128"),
        (("linear", "lazy"), "own", 61, 60, "k=61: lazy matches so many transitions, but the memory has only 60"),
        (
            ("pessimistic",),
            "own",
            None,
            29,
            "k=30: pessimistic matches so many transitions, but the memory has only 29",
        ),
    ],
)
def test_what_a_learner_cannot_learn_is_refused(
    learners: tuple[str, ...], reward: str, k: int | None, pairs: int | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        check_objective(learners, reward, k, pairs)
    check_objective(tuple(LEARNERS), "own", 20, 20)


def test_a_discount_that_no_learner_uses_is_refused() -> None:
    with pytest.raises(ValueError, match=r"discount=0\.5: regression uses immediate rewards only; leave it out"):
        check_objective(("regression",), "own", None, discount=0.5)
    check_objective(("regression", "linear"), "own", None, discount=0.5)
    check_objective(("regression",), None, None)


def test_a_search_reports_how_far_it_is() -> None:
    seen: list[float] = []
    contenders("lazy", memory(), Objective(), lambda done, total: seen.append(done / total))
    # 60 pairs are one block: first of all 32 inputs, then of 16.
    assert seen == pytest.approx([2 / 3, 2 / 3, 1, 1])


def test_robots_act_with_the_bodies_that_they_explored_with() -> None:
    model = CMOMMT(robots=3, targets=4, radius=1.5, policy=RandomWalk(), awareness="ring", robot_speed=0.4, rng=2)
    pairs = explore(model, 10)
    bodies = bodies_of(pairs)
    assert bodies == {"robot_speed": 0.4, "target_speed": 0.075, "sensing_range": 1.0, "awareness_range": 1.0}
    scenario = SMALL._replace(bodies=bodies, runs=1)
    with WorkerPool(1) as pool:
        row = evaluate({"random": (RandomWalk(), NoAwareness())}, scenario, pool).iloc[0]
    fast = CMOMMT(
        robots=3, targets=5, radius=2.0, policy=RandomWalk(), awareness="none", robot_speed=0.4, rng=row["seed"]
    )
    fast.run(20)
    assert row["observed_fraction"] == fast.observed_fraction
    # Of explorations that differ there is no one speed.
    assert "robot_speed" not in bodies_of(pairs.merge(memory()))


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
    assert explored.isdisjoint({Scenario().run_seed(run) for run in range(50)})
    assert len(explored) == 50
