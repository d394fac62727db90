"""``teamsight learn evaluate`` in the worlds of a task other than CMOMMT."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from functools import partial
from typing import TYPE_CHECKING, Any

from teamsight.cli import limits

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.learners import Objective, Progress
    from teamsight.cli.learn_evaluate import EvaluateSettings
    from teamsight.policies.memory import LazyMemory
    from teamsight.tasks.task import Task

CMOMMT = "cmommt"
#: Options that only worlds of CMOMMT have.
OF_CMOMMT = ("robots", "targets", "radius")


def task_given(settings: EvaluateSettings, memory: LazyMemory) -> Task | None:
    """Return the task in whose worlds robots are evaluated: the one given, or that of the exploration; None for CMOMMT.

    Raises
    ------
    ValueError
        If options are those of another task, or the memory is of a task that is not known here.
    """
    from teamsight.tasks.named import task_of

    explored = memory.settings.get("task")
    name = settings.task or (explored if isinstance(explored, str) else CMOMMT)
    if name == CMOMMT:
        if settings.set:
            raise ValueError(f"--set: is for another task than {CMOMMT}; give --robots, --targets and --radius")
        return None
    for option in OF_CMOMMT:
        if option in settings.given:
            raise ValueError(
                f"--{option}={getattr(settings, option)}: is an option of CMOMMT; with the task {name} give --set "
                "NAME=VALUE"
            )
    return task_of(name)


def scenario_of(settings: EvaluateSettings, memory: LazyMemory, task: Task) -> dict[str, Any]:
    """Return the scenario: that of the exploration if it was of this task, with the values that are given.

    Raises
    ------
    ValueError
        If a value is of no parameter of the scenario.
    """
    explored = memory.settings.get("scenario") if memory.settings.get("task") == task.name else {}
    known = {name: value for name, value in dict(explored or {}).items() if name in task.scenario}
    return task.full_scenario({**known, **settings.set})


def evaluated(
    settings: EvaluateSettings,
    memory: LazyMemory,
    task: Task,
    scenario: dict[str, Any],
    objective: Objective,
    learning: AbstractContextManager[Progress],
) -> pd.DataFrame:
    """Learn while `learning` shows the progress, and run all teams."""
    from teamsight.analysis.learning.task_evaluation import evaluate_in_task, task_contenders
    from teamsight.cli.show import working

    with learning as progress:
        teams = task_contenders(settings.learner, memory, objective, task, scenario, progress, rng=settings.seed)
    steps = settings.steps or task.steps
    size = scenario[task.size]
    limits.check_worlds(size, 1, 1.0, steps, settings.runs)
    with working(settings.workers, size * steps * settings.runs * len(teams)) as (watch, pool):
        return evaluate_in_task(
            teams, task, scenario, pool, partial(watch, "simulating"), runs=settings.runs, steps=steps,
            seed=settings.seed,
        )  # fmt: skip


def print_result(
    table: pd.DataFrame, settings: EvaluateSettings, memory: LazyMemory, task: Task, scenario: dict[str, Any]
) -> None:
    """Print what was measured, and by how much the first team is better."""
    from rich import box
    from rich.table import Table

    from teamsight.analysis.learning.task_evaluation import task_summary
    from teamsight.cli.show import plural, say, wide_console

    values = ", ".join(f"{name} = {value}" for name, value in scenario.items())
    steps = settings.steps or task.steps
    say(f"{task.name}: {values}, {plural(settings.runs, 'world')} of {plural(steps, 'step')}, seed {settings.seed}")
    summary = task_summary(table, task)
    first = str(summary["policy"].iloc[0])
    shown = Table(box=box.SIMPLE_HEAD)
    shown.add_column("policy")
    for name in (f"{task.objective.metric} ({task.objective.better} is better)", "censored", f"{first} better by"):
        shown.add_column(name, justify="right")
    for row in summary.to_dict("records"):
        better = "" if row["policy"] == first else _interval(row["more"], row["more_low"], row["more_high"], "+.4g")
        mean = _interval(row["mean"], row["low"], row["high"], ".4g")
        shown.add_row(str(row["policy"]), mean, f"{row['censored']:.0%}", better)
    wide_console().print(shown, highlight=False)
    if "Lattice" in str(memory.settings.get("policy")):
        say(
            "note: robots explored from cell to cell, and those that have learned may move in any direction, which the "
            "others cannot; a difference between them may be due to that"
        )


def _interval(mean: float, low: float, high: float, how: str) -> str:
    ends = f" ({low:{how}} to {high:{how}})" if math.isfinite(low) else ""
    return f"{mean:{how}}{ends}"
