"""Evaluation in the worlds of any task: paired teams, whose runs can be repeated."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.learning.evaluation import COLLECTIVE, COOPERATIVE, RANDOM_TEAM, SKILLED, Scenario, evaluate
from teamsight.analysis.learning.explore import explore
from teamsight.analysis.learning.learners import Objective
from teamsight.analysis.learning.registry import REWARDS
from teamsight.analysis.learning.task_evaluation import Teams, evaluate_in_task, task_contenders, task_summary
from teamsight.analysis.learning.task_exploration import TaskExploration
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.stats.paired import interval_of
from teamsight.tasks import TASKS

SMALL = {"robots": 2, "obstacles": 0.0, "side": 30.0}


@pytest.fixture(scope="module")
def teams() -> Teams:
    memory = explore(TaskExploration(task="consume", scenario=SMALL, steps=30, runs=2))
    return task_contenders("linear", memory, Objective(REWARDS["keep"]), TASKS["consume"], SMALL)


def test_every_run_can_be_repeated_from_its_row(teams: Teams) -> None:
    task = TASKS["consume"]
    table = evaluate_in_task(teams, task, SMALL, runs=3, steps=80, seed=4)
    assert list(dict.fromkeys(table["policy"])) == [COOPERATIVE, COLLECTIVE, SKILLED, RANDOM_TEAM]
    assert (table.groupby("replicate")["seed"].nunique() == 1).all()
    for row in table.itertuples():
        world = task.world(**teams[row.policy], rng=row.seed)
        world.run(80)
        assert task.measure(world) == {name: getattr(row, name) for name in task.metrics}
        assert row.counted == min(row.completion_time, 80.0)


def test_differences_are_paired_and_positive_where_the_first_is_better() -> None:
    # Of completion time less is better; the last run of the second team is censored.
    times = {"first": [10.0, 30.0, 20.0], "second": [25.0, 35.0, np.inf]}
    rows = [
        (team, replicate, time, min(time, 80.0)) for team, some in times.items() for replicate, time in enumerate(some)
    ]
    table = pd.DataFrame(rows, columns=["policy", "replicate", "completion_time", "counted"])
    summary = task_summary(table, TASKS["consume"]).set_index("policy")
    expected = interval_of(np.array([15.0, 5.0, 60.0]))
    assert tuple(summary.loc["second", ["more", "more_low", "more_high"]]) == pytest.approx(expected)
    assert np.isnan(summary.loc["first", "more"])
    assert summary["censored"].to_list() == pytest.approx([0.0, 1 / 3])
    assert summary.loc["first", "mean"] == pytest.approx(20.0)


def test_cmommt_as_a_task_gives_what_its_own_evaluation_gives() -> None:
    scenario = {"robots": 3, "targets": 4, "radius": 2.0}
    memory = explore(TaskExploration(scenario=scenario, steps=20))
    teams = task_contenders("linear", memory, Objective(REWARDS["own"]), TASKS["cmommt"], scenario)
    found = evaluate_in_task(teams, TASKS["cmommt"], scenario, runs=2, steps=20, seed=1)
    policies = {name: (teams[name]["policy"], teams[name]["awareness"]) for name in (COOPERATIVE, COLLECTIVE)}
    with WorkerPool(1) as pool:
        direct = evaluate(policies, Scenario(3, 4, 2.0, runs=2, steps=20, seed=1), pool)
    for name in policies:
        one, other = (table[table["policy"] == name] for table in (found, direct))
        assert one["seed"].tolist() == other["seed"].tolist()
        assert one["observed_fraction"].tolist() == other["observed_fraction"].tolist()
