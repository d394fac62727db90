"""Pursuit as a task: its contract, a team that learns, and the number of neighbours of hunters."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from teamsight import TASKS, check_task
from teamsight.agents.awareness import Awareness, NearestAwareness, NoAwareness, PairwiseAwareness, RingAwareness
from teamsight.analysis.learning.plans import Training
from teamsight.analysis.learning.training import learning_curve
from teamsight.policies import PreyQ
from teamsight.policies.online.modular_q import ModularQ
from teamsight.tasks.pursuit import Pursuit, learned, trial_steps

SMALL = {"side": 6, "depth": 2}


def test_it_is_a_task() -> None:
    assert TASKS["pursuit"].name == "pursuit"
    check_task("pursuit")


def test_hunters_that_have_learned_need_less_than_random_ones() -> None:
    task, seeds = TASKS["pursuit"], range(6)
    scenario = task.full_scenario(SMALL)
    team = learned(scenario, None, 3)
    random, skilled = (
        [_steps(Pursuit(**scenario, **how, rng=seed)) for seed in seeds] for how in (dict(task.explore or {}), team)
    )
    # In 6 seeds of 6: by chance alone once in 64 times; the means differ by a factor of 3.
    assert all(one > other for one, other in zip(random, skilled, strict=True)), (random, skilled)


def _steps(world: Pursuit) -> float:
    world.run(3000, progress=False)
    return trial_steps(world)


def test_without_awareness_of_teammates_there_is_no_table_of_them() -> None:
    scenario = TASKS["pursuit"].full_scenario(SMALL)
    policy = learned(scenario, NoAwareness(), 3)["policy"]
    assert isinstance(policy, PreyQ)
    assert policy.partner == 0


@pytest.mark.parametrize("rule", ["pair", "surround"])
@pytest.mark.parametrize("hunters", [4, 30])
@pytest.mark.parametrize(
    "degree", [NoAwareness(), NearestAwareness(1), NearestAwareness(3), RingAwareness(4), PairwiseAwareness()], ids=str
)
def test_a_team_learns_with_each_degree_and_size(degree: Awareness, hunters: int, rule: str) -> None:
    scenario = TASKS["pursuit"].full_scenario({**SMALL, "hunters": hunters, "rule": rule, "torus": True})
    team = learned(scenario, degree, 3, steps=300)
    assert team["awareness"] == degree
    policy = team["policy"]
    tables = policy.first.floats[:, :-1] if isinstance(policy, ModularQ) else policy.tables
    # The last of the 26 places in a row is for a teammate that is not seen.
    is_seen = np.arange(tables.shape[1]) % 26 != 25
    uses_partners = isinstance(policy, ModularQ) or policy.partner > 0
    assert uses_partners == (degree != NoAwareness())
    assert not uses_partners or tables[:, is_seen].any()
    if isinstance(policy, ModularQ):
        assert policy.modules == min(3, getattr(degree, "delta", 3))
    world = Pursuit(**scenario, **team, rng=1)
    world.run(50)
    assert world.path == "compiled"


def test_a_team_that_learns_for_longer_needs_less() -> None:
    training = Training(learned=(0, 20_000), awareness=("none",), trainings=1, runs=8, steps=400)
    curve = learning_curve("pursuit", training, SMALL)
    means = curve.groupby("learned")["counted"].mean()
    # Five times as long without learning; the mean of eight runs of 400 steps varies by a third.
    assert means[0] > 1.5 * means[20_000], means.to_dict()


def test_trials_that_do_not_end_are_endless() -> None:
    world = Pursuit(side=50, depth=1, rule="pair", rng=1)
    world.run(1)
    assert trial_steps(world) == math.inf


def test_the_view_of_hunters_is_a_square() -> None:
    world = Pursuit(2, 1, depth=2, awareness="pairwise", rng=1)
    for _ in range(300):
        world.step()
        gap = np.abs(world.hunters.position[0] - world.hunters.position[1]).max()
        assert len(world.hunters.percept.teammates.identity) == 2 * (gap <= 2)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"depth": 11}, "depth=11"),
        ({"rule": "all"}, "rule='all'"),
        ({"side": 1}, "side=1"),
        ({"scouts": -1}, "scouts=-1"),
    ],
)
def test_wrong_values_are_named(given: dict[str, object], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        Pursuit(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("hunters", "message"),
    [("many", r"hunters='many': must be a whole number of at least 1"), (0, r"hunters=0: must be at least 1")],
)
def test_a_wrong_number_of_hunters_is_named_before_any_learns(hunters: object, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        learned(TASKS["pursuit"].full_scenario({**SMALL, "hunters": hunters}), None, 3, steps=1)


def test_too_few_hunters_to_surround_a_prey_are_named() -> None:
    with pytest.warns(UserWarning, match=r"hunters=3: fewer than 4 never capture where rule='surround'.*take 4 or more"):
        Pursuit(3, 1, 5, depth=2, rule="surround", torus=True, rng=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Pursuit(4, 1, 5, depth=2, rule="surround", torus=True, rng=1)
        Pursuit(1, 1, 5, rule="alone", rng=1)
