"""The learning curve of a task: the objective of teams that have learned for so long, and what awareness adds to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.agents.awareness.registry import awareness_named
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run, TaskMeasure, is_cmommt, task_seed
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.core import checks
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task

if TYPE_CHECKING:
    from teamsight.agents.awareness import Awareness

_KEYS = ["task", "awareness", "learned", "training", "replicate"]


@dataclass(frozen=True)
class _Test(Run):
    """A run of a team that has learned, which is known by how it learned."""

    label: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[str, ...]:
        return (*self.label, f"seed={self.seed}")


def learning_curve(
    task: Task | str,
    learned: Sequence[int],
    *,
    awareness: Sequence[Awareness | str] = ("none", "nearest"),
    scenario: Mapping[str, Any] | None = None,
    trainings: int = 5,
    runs: int = 20,
    steps: int | None = None,
    rng: int = 0,
    pool: WorkerPool | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Let teams learn for some time, and measure the objective in worlds in which they have not learned.

    Parameters
    ----------
    task : Task or str
        A task whose team with skill has to learn, by a function with a parameter `steps`.
    learned : sequence of int
        Numbers of steps, or of whatever unit the function counts, for which it learns.
    awareness : sequence of Awareness or str
        Degrees of awareness with which it learns.
    scenario : mapping, optional
        Values of the scenario.
    trainings : int
        How often each team learns, with other seeds.
    runs : int
        Test runs of each training, the same worlds for all teams.
    steps : int, optional
        Steps of each test run; by default those of the task.
    rng : int
        Root seed of the learning and of the tests.
    pool : WorkerPool, optional
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
        If an argument is of the wrong type or outside its limits, or the team of the task does not learn.
    """
    found = task_of(task)
    if not callable(found.skilled):
        raise ValueError(
            f"the task {found.name} has no team that learns; give it a function, as in Task(…, skilled=train)"
        )
    skilled: Callable[..., Any] = found.skilled
    full = found.full_scenario(scenario)
    root, runs = checks.count("rng", rng, least=0), limits.runs(runs)
    length = limits.steps(found.steps if steps is None else steps)
    model, measure = None if is_cmommt(found) else found.world, TaskMeasure(found)
    seeds = [task_seed(found, root, replicate, full) for replicate in range(runs)]
    tests, rows = [], []
    often = range(checks.count("trainings", trainings))
    for amount, degree, training in product(learned, map(_degree, awareness), often):
        train: Any = partial(skilled, steps=checks.count("learned", amount, least=0))
        team = replace(found, skilled=train).parameters("skilled", full, awareness=degree, rng=root + training)
        label = (found.name, repr(degree), f"learned={amount}", f"training={training}")
        tests += [_Test(team, seed, length, measure, model, label) for seed in seeds]
        rows += [(found.name, repr(degree), amount, training, *one) for one in enumerate(seeds)]
    measured = run_all(tests, pool, progress=progress)
    objective = found.objective
    table = pd.DataFrame(rows, columns=[*_KEYS, "seed"])
    table["value"] = [one[objective.metric] for one in measured]
    table["counted"] = [objective.counted(value, length) for value in table["value"]]
    return table


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
            interval = interval_of(one.to_numpy(np.float64), level)
            rows.append({"awareness": name, "learned": amount, "gain": interval.mean, **_ends(interval)})
    return pd.DataFrame(rows, columns=["awareness", "learned", "gain", "low", "high"])


def _degree(awareness: Awareness | str) -> Awareness:
    return awareness_named(awareness) if isinstance(awareness, str) else awareness


def _ends(interval: Interval) -> dict[str, float]:
    return {"low": interval.low, "high": interval.high}
