"""Learning curves: the same transitions and worlds with and without awareness, and nothing made twice."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT
from teamsight.analysis.learning import curves as module
from teamsight.analysis.learning.curves import can_learn, curve_jobs, make_curves
from teamsight.analysis.learning.evaluation import BY_HAND, DESIGNED, RANDOM
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.learners import learn
from teamsight.analysis.learning.plans import Curves
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.policies import FollowFree
from teamsight.policies.rewards import keep_reward

SMALL = Curves(samples=(8, 40, 300), memories=2, worlds=2, robots=(3, 5), radius=(2.0,), targets=4, steps=8, seed=6)
LEARNERS = ("lazy", "tabular", "linear", "regression")


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    with warnings.catch_warnings():
        # Too few transitions are no reason for a flood of warnings.
        warnings.simplefilter("error")
        return make_curves(SMALL)


@pytest.mark.short
def test_every_learner_meets_the_same_worlds_with_and_without_awareness(table: pd.DataFrame) -> None:
    learned = table[table["transitions"] > 0]
    assert len(learned) == 4 * 3 * 2 * 2 * 2 * 2
    assert set(learned["learner"]) == set(LEARNERS)
    assert set(learned["degree"]) == {"none", "ring"}
    for _, rows in table.groupby(["robots", "radius", "memory"]):
        assert rows.groupby("replicate")["seed"].nunique().eq(1).all()
        assert len(rows.groupby(["learner", "transitions", "degree", "replicate"])) == len(rows)
    assert table["seed"].nunique() == 2 * 2 * 2
    designed = table[table["transitions"] == 0]
    by_hand = {(name, degree.name) for name, (_, degree) in BY_HAND.items()}
    named = set(zip(designed["learner"], designed["degree"], strict=True))
    assert named == {(RANDOM, "none"), (DESIGNED, "pairwise"), *by_hand}
    # They learn nothing: their runs are those of these teams alone.
    row = designed[designed["learner"] == "by hand, f = d"].iloc[0]
    model = CMOMMT(robots=row["robots"], targets=4, radius=2.0, policy=FollowFree(1), awareness="ring", rng=row["seed"])
    model.run(8)
    assert row["observed_fraction"] == model.observed_fraction


def test_without_awareness_a_learner_has_the_own_inputs_of_the_same_transitions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = []

    def noted(name, memory, objective, *, inputs):  # type: ignore[no-untyped-def]
        seen.append((len(memory), memory, inputs))
        assert objective.reward is keep_reward
        return learn(name, memory, objective, inputs=inputs)

    monkeypatch.setattr(module, "learn", noted)
    make_curves(replace(SMALL, learners=("linear",), memories=1))
    assert [(size, inputs) for size, _, inputs in seen] == [(n, d) for n in (8, 40, 300) for d in (16, 32)]
    everything = explore(Exploration(**SMALL.exploration(0)))
    rows = {row.tobytes() for row in everything.table.T}
    former: set[bytes] = set()
    for (_, memory, _), (_, other, _) in zip(seen[::2], seen[1::2], strict=True):
        assert memory is other
        own = {row.tobytes() for row in memory.table.T}
        # Nested: each sample holds the smaller one, and all are parts of the exploration.
        assert former < own < rows
        former = own


def test_what_a_memory_is_too_small_for_is_missing(table: pd.DataFrame) -> None:
    missing = table[table["observed_fraction"].isna()]
    # Lazy Q-learning matches ten transitions; the others make do with eight.
    assert set(zip(missing["learner"], missing["transitions"], strict=True)) == {("lazy", 8)}
    assert len(missing) == 2 * 2 * 2 * 2
    assert can_learn(SMALL, "lazy", 10)
    assert not can_learn(replace(SMALL, k=11), "lazy", 10)
    assert can_learn(replace(SMALL, k=11), "regression", 1)


def test_the_search_space_is_the_number_of_values_to_learn(table: pd.DataFrame) -> None:
    with_awareness = table[(table["degree"] == "ring") & (table["transitions"] == 300)]
    sizes = 10 ** with_awareness.groupby("learner")["log10_size"].first()
    actions = 16
    # A table of 3 levels of 4 + 4 merged sectors, 3 weights for each of 32 inputs and a constant, and whole situations.
    assert sizes["tabular"] == pytest.approx(3**8 * actions)
    assert sizes["linear"] == pytest.approx((1 + 3 * 32) * actions)
    assert sizes["lazy"] == pytest.approx(2**32)
    assert sizes["regression"] < sizes["linear"]


def test_the_table_does_not_depend_on_workers(table: pd.DataFrame, two_workers: WorkerPool) -> None:
    assert make_curves(SMALL, two_workers).equals(table)


def test_finished_jobs_are_kept_after_an_interruption(
    table: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(done: float, total: float) -> None:
        if done > total / 2:
            raise KeyboardInterrupt

    kept = Checkpoint(tmp_path / "kept")
    with pytest.raises(KeyboardInterrupt):
        make_curves(SMALL, checkpoint=kept, progress=stop)
    finished = kept.count(job.key for job in curve_jobs(SMALL))
    assert 0 < finished < 10
    made: list[str] = []
    learnt_rows = module._learnt_rows
    monkeypatch.setattr(module, "_learnt_rows", lambda job: (made.append(job.learner), learnt_rows(job))[1])
    assert make_curves(SMALL, checkpoint=kept).equals(table)
    assert len(made) + finished >= 9
    assert len(made) < 8
    # The entries of other curves are neither used nor deleted.
    other = replace(SMALL, discount=0.1)
    found = make_curves(other, checkpoint=kept)
    assert not found["observed_fraction"].equals(table["observed_fraction"])
    kept.forget(job.key for job in curve_jobs(other))
    assert kept.count(job.key for job in curve_jobs(SMALL)) == kept.count() == 10
    kept.forget(job.key for job in curve_jobs(SMALL))
    assert not kept.path.exists()


def test_memories_share_no_world_and_no_transition() -> None:
    one, other = (Exploration(**SMALL.exploration(memory)) for memory in (0, 1))
    assert one.run_seed(0) != other.run_seed(0)
    assert one.transitions >= max(SMALL.samples)
    first, second = (explore(plan) for plan in (one, other))
    assert not {row.tobytes() for row in first.table.T} & {row.tobytes() for row in second.table.T}


def test_all_scenarios_are_those_of_the_table(table: pd.DataFrame) -> None:
    assert SMALL.scenarios == [(3, 2.0), (5, 2.0)]
    assert set(zip(table["robots"], table["radius"], strict=True)) == set(SMALL.scenarios)
    assert np.isfinite(table["seed"]).all()
