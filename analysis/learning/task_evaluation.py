"""Evaluation in the worlds of any task: what robots achieve that have learned from transitions, by its objective."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.learning.evaluation import RANDOM_TEAM, SKILLED, check_team, learned_policies
from teamsight.analysis.learning.learners import Objective, Progress
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import LabelledRun, TaskMeasure, is_cmommt, task_seed
from teamsight.analysis.runs.seeds import canonical
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies.memory import LazyMemory
from teamsight.tasks.task import Task

#: The parameters of worlds by the name of the team.
Teams = dict[str, dict[str, Any]]


def task_contenders(
    name: str,
    memory: LazyMemory,
    objective: Objective,
    task: Task,
    scenario: Mapping[str, Any],
    progress: Progress = lambda done, total: None,
    *,
    rng: int = 0,
) -> Teams:
    """Return the teams to compare: what the learner learns, the team with skill, and the one that explores.

    Parameters
    ----------
    name : str
        The learner.
    memory : LazyMemory
        The transitions.
    objective : Objective
        What is to be learnt.
    task : Task
        The task.
    scenario : mapping
        Values of its scenario.
    progress : callable
        Called with the share of the work that is done, and 1.
    rng : int
        Root seed of the learning of the team with skill, if it has to learn.

    Raises
    ------
    TypeError, ValueError
        If the memory does not fit the team, or the learner cannot learn from it.
    """
    full = task.full_scenario(scenario)
    check_team(memory, full[task.size])
    learned = learned_policies(name, memory, objective, progress)
    teams: dict[str, Any] = {
        team: {"policy": policy, "awareness": degree} for team, (policy, degree) in learned.items()
    }
    if task.skilled is not None:
        teams[SKILLED] = "skilled"
    teams[RANDOM_TEAM] = "explore"
    return {team: task.parameters(treatment, scenario, rng=rng) for team, treatment in teams.items()}


def evaluate_in_task(
    teams: Teams,
    task: Task,
    scenario: Mapping[str, Any],
    pool: Executor | None = None,
    progress: Progress = lambda done, total: None,
    *,
    runs: int = 30,
    steps: int | None = None,
    seed: int = 0,
) -> pd.DataFrame:
    """Run each team on each world.

    Parameters
    ----------
    teams : dict of str to mapping
        The parameters of worlds by the name of the team; see `task_contenders`.
    task : Task
        The task.
    scenario : mapping
        Values of its scenario.
    pool : Executor, optional
        What makes the runs; by default this process.
    progress : callable
        Called with the work done and the work in all.
    runs : int
        Number of worlds; no exploration uses them, whatever its seed.
    steps : int, optional
        Steps of each; by default those of the task.
    seed : int
        Root seed of the worlds.

    Returns
    -------
    DataFrame
        One row a team and world: policy, replicate, seed, the metrics of the task, counted (the objective; a censored
        run counts as its length), max_neighbours and mean_neighbours.

    Raises
    ------
    JobError
        If a policy does not fit its degree and the worlds.
    """
    length = task.steps if steps is None else steps
    full, model = task.full_scenario(scenario), None if is_cmommt(task) else task.world
    planned = []
    for team, parameters in teams.items():
        for replicate in range(runs):
            seed_of = task_seed(task, seed, replicate, full)
            run = LabelledRun(
                parameters, seed_of, length, TaskMeasure(task), model, (task.name, canonical(full), team)
            )  # fmt: skip
            planned.append(({"policy": team, "replicate": replicate, "seed": seed_of}, run))
    table = run_rows(planned, pool, progress=progress)
    metric = task.objective.metric
    table.insert(3, "counted", [task.objective.counted(value, length) for value in table[metric]])
    return table


def task_summary(table: pd.DataFrame, task: Task) -> pd.DataFrame:
    """Return what each team achieves, and by how much the first is better than each other, with 95 % intervals.

    Parameters
    ----------
    table : DataFrame
        From `evaluate_in_task`.
    task : Task
        The task.

    Returns
    -------
    DataFrame
        One row a team, in the order of the table: policy, mean, low, high, censored (share of the runs), and of the
        paired difference `more`, more_low, more_high, positive if the first is better, which are NaN for the first.
    """
    wide = table.pivot(index="replicate", columns="policy", values="counted")
    names = list(dict.fromkeys(table["policy"]))
    rows = []
    for name in names:
        mean, low, high = interval_of(wide[name].to_numpy(np.float64))
        infinite = np.isinf(table.loc[table["policy"] == name, task.objective.metric])
        row = {"policy": name, "mean": mean, "low": low, "high": high, "censored": float(infinite.mean())}
        if name != names[0]:
            better = interval_of(task.objective.sign * (wide[names[0]] - wide[name]).to_numpy(np.float64))
            row |= {"more": better.mean, "more_low": better.low, "more_high": better.high}
        rows.append(row)
    return pd.DataFrame(rows)
