"""Teams of a task that learn while they act: their objective after so much learning, and what awareness adds to it."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.agents.awareness import AWARENESS
from teamsight.agents.resolve import awareness_of
from teamsight.analysis.learning.plans import Training
from teamsight.analysis.plot.kinds import draw_means, panels
from teamsight.analysis.plot.style import DEGREE, INK
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import LabelledRun, TaskMeasure, is_cmommt, task_seed
from teamsight.analysis.runs.simulate import Planned, Progress, run_rows
from teamsight.analysis.stats.paired import interval_of
from teamsight.core import checks
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


def learning_curve(
    task: Task | str,
    training: Training | None = None,
    scenario: Mapping[str, Any] | None = None,
    *,
    pool: Executor | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Let teams learn for some time, and measure the objective in worlds in which they have not learned.

    Parameters
    ----------
    task : Task or str
        A task whose team with skill has to learn, by a function with a parameter `steps`.
    training : Training, optional
        For how long and with which degrees of awareness teams learn, and how they are tested.
    scenario : mapping, optional
        Values of the scenario.
    pool : Executor, optional
        Processes that make the test runs. The result does not depend on it.
    progress : callable
        Called with the work done and the work in all, while tests are made.

    Returns
    -------
    DataFrame
        One row for each test run: task, awareness, learned, training, replicate, seed, value (of the objective) and
        counted, which is the length of the run if it is censored.

    Raises
    ------
    TypeError, ValueError
        If the team of the task does not learn, or a name is no parameter of the scenario.
    """
    found, plan = task_of(task), training or Training()
    full = check_training(found, scenario)
    skilled: Callable[..., Any] = found.skilled  # type: ignore[assignment]
    length, metric = found.steps if plan.steps is None else plan.steps, found.objective.metric
    model, measure = None if is_cmommt(found) else found.world, TaskMeasure(found)
    seeds = [task_seed(found, plan.seed, replicate, full) for replicate in range(plan.runs)]
    tests: list[Planned] = []
    degrees = map(awareness_of, plan.awareness)
    for amount, degree, number in itertools.product(plan.learned, degrees, range(plan.trainings)):
        train: Any = partial(skilled, steps=amount)
        team = replace(found, skilled=train).parameters("skilled", full, awareness=degree, rng=plan.seed + number)
        about = {"task": found.name, "awareness": repr(degree), "learned": amount, "training": number}
        for replicate, seed in enumerate(seeds):
            run = LabelledRun(team, seed, length, measure, model, tuple(map(str, about.values())))
            tests.append((about | {"replicate": replicate, "seed": seed}, run))
    table = run_rows(tests, pool, progress=progress)
    table = table.assign(value=table[metric], counted=[found.objective.counted(one, length) for one in table[metric]])
    return table[[*tests[0][0], "value", "counted"]]


def check_training(task: Task, scenario: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the whole scenario in which the team of a task learns.

    Raises
    ------
    ValueError
        If the team does not learn, or a name is no parameter of the scenario.
    """
    if not callable(task.skilled):
        from teamsight.tasks.registry import TASKS

        names = ", ".join(name for name, one in TASKS.items() if callable(one.skilled))
        raise ValueError(
            f"task={task.name!r}: its team does not learn; give one whose team does: {names}, or one of your own with "
            "a function, as in Task(…, skilled=train)"
        )
    return task.full_scenario(scenario)


def awareness_gain(task: Task | str, curve: pd.DataFrame, base: str, level: float = 0.95) -> pd.DataFrame:
    """Return what each degree of awareness adds to the objective, over another one, paired by training and test world.

    Parameters
    ----------
    task : Task or str
        The task.
    curve : DataFrame
        From `learning_curve`.
    base : str
        The degree in the column `awareness` over which the others gain, such as "NoAwareness()".
    level : float
        Confidence of the intervals, which are over trainings.

    Returns
    -------
    DataFrame
        awareness, learned, gain, low, high; positive is better.

    Raises
    ------
    ValueError
        If no row has this degree.
    """
    found = task_of(task)
    checks.choice("base", base, curve["awareness"].unique().tolist())
    means = curve.groupby(["awareness", "learned", "training"])["counted"].mean().unstack("awareness")
    rows = []
    for name in means.columns.drop(base):
        for amount, one in (found.objective.sign * (means[name] - means[base])).groupby("learned"):
            rows.append((name, amount, *interval_of(one.to_numpy(np.float64), level)))
    return pd.DataFrame(rows, columns=["awareness", "learned", "gain", "low", "high"])


def training_points(curve: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return the mean objective of each degree after each time of learning, with its interval over trainings.

    Parameters
    ----------
    curve : DataFrame
        From `learning_curve`.
    level : float
        Confidence of the intervals; they are infinite for a single training.

    Returns
    -------
    DataFrame
        awareness, learned, mean, low, high, censored (share of the runs that did not end).
    """
    rows = []
    for (awareness, learned), part in curve.groupby(["awareness", "learned"], sort=False):
        interval = interval_of(part.groupby("training")["counted"].mean().to_numpy(np.float64), level)
        censored = float(np.isinf(part["value"]).mean())
        rows.append({"awareness": awareness, "learned": learned, **interval._asdict(), "censored": censored})
    return pd.DataFrame(rows)


def draw(points: pd.DataFrame, task: Task, about: str) -> Canvas:
    """Return the figure.

    Parameters
    ----------
    points : DataFrame
        From `training_points`.
    task : Task
        The task.
    about : str
        What was measured.
    """
    last = points.groupby("awareness", sort=False).last()["mean"]
    figure, (axes,) = panels(
        f"{task.title}: {', '.join(f'{mean:.3g} with {name}' for name, mean in last.items())}", about, [""],
        x="steps of learning", y=f"{task.objective.metric} ({task.objective.better} is better)", size=(7.5, 4.2),
    )  # fmt: skip
    degrees = {repr(degree()): name for name, degree in AWARENESS.items()}
    for name, part in points.sort_values("learned").groupby("awareness", sort=False):
        colour = DEGREE.get(degrees.get(str(name), ""), INK)
        draw_means(axes, part["learned"], part, colour, str(name), marker="o", markersize=4)
    if points["learned"].min() > 0 and points["learned"].nunique() > 1:
        axes.set_xscale("log")
    axes.legend(frameon=False)
    return figure
