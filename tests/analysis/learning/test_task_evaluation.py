"""Evaluation in the worlds of any task: paired teams, whose runs can be repeated."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.learning.evaluation import (
    COLLECTIVE,
    COOPERATIVE,
    RANDOM_TEAM,
    SKILLED,
    Teams,
    contenders,
    evaluate,
    summary,
)
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.plans import Evaluation, Objective
from teamsight.analysis.learning.registry import REWARDS
from teamsight.analysis.stats.paired import interval_of
from teamsight.tasks import TASKS

SMALL = {"robots": 2, "obstacles": 0.0, "side": 30.0}


@pytest.fixture(scope="module")
def teams() -> Teams:
    memory = explore(Exploration(task="consume", world=SMALL, steps=30, runs=2))
    return contenders("linear", memory, Objective(REWARDS["keep"]), TASKS["consume"], SMALL)


def test_every_run_can_be_repeated_from_its_row(teams: Teams) -> None:
    task = TASKS["consume"]
    table = evaluate(teams, task, SMALL, Evaluation(runs=3, steps=80, seed=4))
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
    found = summary(table, TASKS["consume"]).set_index("policy")
    expected = interval_of(np.array([15.0, 5.0, 60.0]))
    assert tuple(found.loc["second", ["more", "more_low", "more_high"]]) == pytest.approx(expected)
    assert np.isnan(found.loc["first", "more"])
    assert found["censored"].to_list() == pytest.approx([0.0, 1 / 3])
    assert found.loc["first", "mean"] == pytest.approx(20.0)
