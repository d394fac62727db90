"""Runs of a task: `run_many` returns its metrics, teams of one scenario meet the same noise, CMOMMT is as before."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from toy_tasks import GATHER, LEARN, SOON

from teamsight import TASKS, Study, run_many
from teamsight.analysis.runs.run import TaskMeasure, task_seed
from teamsight.analysis.runs.seeds import model_seed


def test_cmommt_as_a_task_gives_the_bits_of_the_model() -> None:
    given = {"robots": [3, 5], "radius": [2.0, 4.0]}
    task = run_many({**given, "treatment": ["explore", "skilled"]}, task="cmommt", steps=40, replicates=2, rng=1)
    plain = run_many({**given, "policy": ["random-walk", "a-cmommt"]}, steps=40, replicates=2, rng=1)
    for column in ("seed", "observed_fraction", "max_neighbours", "mean_neighbours"):
        assert task[column].tolist() == plain[column].tolist()


def test_teams_of_one_scenario_are_paired() -> None:
    table = run_many({"treatment": ["explore", "skilled"], "walkers": [3, 6]}, task=GATHER, replicates=3, rng=4)
    seeds = table.groupby(["walkers", "replicate"])["seed"]
    assert (seeds.nunique() == 1).all()
    assert table["seed"].nunique() == 6
    wide = table.pivot_table("closeness", ["walkers", "replicate"], "treatment")
    assert (wide["skilled"] > wide["explore"]).all()
    assert (table["steps"] == GATHER.steps).all()


def test_results_do_not_depend_on_the_workers() -> None:
    given = {"treatment": ["explore", "skilled"], "side": [4.0, 8.0]}
    one, two = (run_many(given, task=LEARN, steps=30, replicates=2, rng=4, workers=number) for number in (1, 2))
    pd.testing.assert_frame_equal(one, two)


def test_a_censored_run_is_infinite_in_the_table() -> None:
    table = run_many({"treatment": ["explore", "skilled"]}, task=SOON, steps=100, replicates=4, rng=2)
    assert (table.loc[table["treatment"] == "explore", "gathered_after"] == math.inf).any()
    assert np.isfinite(table.loc[table["treatment"] == "skilled", "gathered_after"]).all()


def test_seeds_follow_from_the_values_of_the_scenario() -> None:
    task = TASKS["cmommt"]
    assert task_seed(task, 3, 1, {"robots": 4}) == model_seed(3, 1, 4, 15, 5.0)
    assert task_seed(GATHER, 3, 1, {}) == task_seed(GATHER, 3, 1, {"side": 6}) != task_seed(GATHER, 3, 1, {"side": 7})


def test_a_study_of_a_task_has_its_metrics_and_seeds(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setitem(TASKS._homes, "gather", "toy_tasks:GATHER")  # type: ignore[index]
    study = Study(model="task:gather", axes={"treatment": ["explore", "skilled"], "walkers": [3, 5]}, replicates=2, steps=30)
    study.check()
    frame = study.run(tmp_path / "study").frame
    table = run_many(
        {"treatment": ["explore", "skilled"], "walkers": [3, 5]}, task=GATHER, replicates=2, steps=30, rng=0
    )
    for column in ("seed", "closeness", "max_neighbours"):
        assert frame[column].tolist() == table[column].tolist()
    with pytest.raises(ValueError, match="wakers: is no parameter of task:gather; did you mean 'walkers'"):
        Study(model="task:gather", axes={"wakers": [3]}).check()


def test_cmommt_as_a_task_of_a_study(tmp_path) -> None:  # type: ignore[no-untyped-def]
    axes = {"robots": [3, 5], "radius": [2.0, 4.0]}
    task = Study(model="task:cmommt", axes=axes, fixed={"treatment": "explore"}, steps=20).run(tmp_path / "task").frame
    plain = Study(axes=axes, fixed={"policy": "random-walk"}, steps=20).run(tmp_path / "plain").frame
    assert task["observed_fraction"].tolist() == plain["observed_fraction"].tolist()
    with pytest.raises(ValueError, match="task='cmomt': unknown; did you mean 'cmommt'"):
        Study(model="task:cmomt").check()


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="a task has worlds of its own; give either"):
        run_many({}, task=GATHER, model=GATHER.world)
    with pytest.raises(ValueError, match="wakers: is no parameter of the task gather; did you mean 'walkers'"):
        run_many({"wakers": 3}, task=GATHER)
    with pytest.raises(ValueError, match="task='gathr': unknown"):
        run_many({}, task="gathr")


def test_a_metric_may_not_have_the_name_of_a_column() -> None:
    from dataclasses import replace

    task = replace(GATHER, metrics={**GATHER.metrics, "max_neighbours": len})
    with pytest.raises(ValueError, match="'max_neighbours' is measured of every task; take another name"):
        TaskMeasure(replace(task, metrics={**GATHER.metrics, "max_neighbours": GATHER.metrics["closeness"]}))(
            GATHER.build("explore", rng=1), 5
        )
