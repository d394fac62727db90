"""Learners by name, and their evaluation beside what they are measured by."""

from __future__ import annotations

from typing import Any

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
    check_team,
    contenders,
    evaluate,
    scenario_of,
)
from teamsight.analysis.learning.explore import Exploration
from teamsight.analysis.learning.learners import awareness_for, check_objective, default_of, default_reward, learn
from teamsight.analysis.learning.plans import Evaluation, Objective
from teamsight.analysis.learning.registry import LEARNERS, REWARDS
from teamsight.analysis.runs.executor import JobError
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import task_seed
from teamsight.policies import RandomWalk, check_policy
from teamsight.policies.memory import LazyMemory
from teamsight.tasks import TASKS
from teamsight.tasks.pursuit import Pursuit

CMOMMT_TASK = TASKS["cmommt"]
SMALL = Evaluation(runs=3, steps=20, seed=1)
SCENARIO = {"robots": 3, "targets": 5, "radius": 2.0}


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
    # The contract is kept whatever was learned.
    if reward == "own":
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
    teams = contenders("linear", memory(), Objective(), CMOMMT_TASK, SCENARIO)
    assert list(teams) == [COOPERATIVE, COLLECTIVE, *BY_HAND, DESIGNED, EVOLVED, RANDOM]
    seen: list[float] = []
    with WorkerPool(1) as pool:
        table = evaluate(teams, CMOMMT_TASK, SCENARIO, SMALL, pool, lambda done, total: seen.append(done / total))
    assert seen[-1] == 1
    assert len(table) == 3 * 10
    for _, row in table.iterrows():
        team = teams[row["policy"]]
        assert SCENARIO.items() <= team.items()
        model = CMOMMT(**team, rng=row["seed"])
        model.run(20)
        assert row["observed_fraction"] == model.observed_fraction
        model.close()


def test_a_memory_without_teammates_has_no_cooperative_learner() -> None:
    teams = contenders("tabular", memory("none"), Objective(), CMOMMT_TASK, SCENARIO)
    assert list(teams) == [COLLECTIVE, *BY_HAND, DESIGNED, EVOLVED, RANDOM]


def test_a_team_of_another_size_is_refused_where_the_degree_depends_on_it() -> None:
    scenario = SCENARIO | {"robots": 4}
    teams = contenders("linear", memory("pairwise"), Objective(), CMOMMT_TASK, scenario)
    with WorkerPool(1) as pool, pytest.raises(JobError, match="20 inputs|reads 20"):
        evaluate(teams, CMOMMT_TASK, scenario, SMALL, pool)


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
    contenders("lazy", memory(), Objective(), CMOMMT_TASK, SCENARIO, lambda done, total: seen.append(done / total))
    # 60 pairs are one block: first of all 32 inputs, then of 16.
    assert seen == pytest.approx([2 / 3, 2 / 3, 1, 1])


def test_robots_act_with_the_bodies_that_they_explored_with() -> None:
    model = CMOMMT(robots=3, targets=4, radius=1.5, policy=RandomWalk(), awareness="ring", robot_speed=0.4, rng=2)
    pairs = explore(model, 10)
    bodies = {"robot_speed": 0.4, "target_speed": 0.075, "sensing_range": 1.0, "awareness_range": 1.0}
    scenario = scenario_of(pairs, CMOMMT_TASK, {"targets": 5, "radius": 2.0})
    assert bodies.items() <= scenario.items()
    assert (scenario["robots"], scenario["targets"], scenario["radius"]) == (3, 5, 2.0)
    # Of explorations that differ there is no one speed.
    assert scenario_of(pairs.merge(memory()), CMOMMT_TASK, {})["robot_speed"] == 0.1
    teams = {"random": CMOMMT_TASK.parameters({"policy": RandomWalk(), "awareness": NoAwareness()}, scenario)}
    row = evaluate(teams, CMOMMT_TASK, scenario, SMALL).iloc[0]
    fast = CMOMMT(
        robots=3, targets=5, radius=2.0, policy=RandomWalk(), awareness="none", robot_speed=0.4, rng=row["seed"]
    )
    fast.run(20)
    assert row["observed_fraction"] == fast.observed_fraction


def test_no_world_is_both_explored_and_evaluated() -> None:
    scenario = {"robots": 5, "targets": 15, "radius": 3.0}
    exploration = Exploration(world=scenario, runs=50)
    explored = {exploration.run_seed(run) for run in range(50)}
    assert explored.isdisjoint({task_seed(CMOMMT_TASK, 0, replicate, scenario) for replicate in range(30)})
    assert len(explored) == 50
