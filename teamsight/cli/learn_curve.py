"""``teamsight learn curve``: the learning curve of a task whose team learns while it acts."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.limits import MOST_STEPS, Steps
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Works, Writes
from teamsight.cli.values import CellRuns, DegreeName, Folder, Format
from teamsight.cli.world_settings import TaskName
from teamsight.core.component import Allowed, Seed

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.tasks.task import Task

_TESTS, _POINTS, _GAINS = "learning-curve.parquet", "learning-curve-points.parquet", "learning-curve-gains.parquet"
_PICTURE = "learning-curve"
_Learned = Annotated[int, Allowed(least=1, most=MOST_STEPS, cure="let teams learn for less long")]


@dataclass(frozen=True, kw_only=True)
class CurveSettings(Works, Writes):
    """Options of ``teamsight learn curve``.

    Parameters
    ----------
    task : str
        The task. Its team has to learn, as those of pursuit and collect do.
    set : mapping of str to object
        A value of the scenario of the task. May be given several times.
    learned : sequence of int
        Numbers of steps of learning, separated by commas.
    awareness : sequence of str
        Degrees of awareness, separated by commas; gains are over the first.
    trainings : int
        How often each team learns, with other seeds.
    runs : int
        Number of test runs of each training.
    steps : int, optional
        Number of steps of each test run.
    seed : int
        Seed of the learning and of the tests.
    out : Path
        Folder for the results.
    format : sequence of str
        Formats of the picture, with commas between them.
    """

    task: TaskName = "pursuit"
    set: Mapping[str, Any] = field(default_factory=dict)
    learned: Annotated[tuple[_Learned, ...], Allowed(most=50, is_sorted=True)] = (1000, 10000, 100000)
    awareness: Annotated[tuple[DegreeName, ...], Allowed()] = ("none", "pairwise")
    trainings: Annotated[int, Allowed(least=1, most=1000)] = 5
    runs: CellRuns = 20
    steps: Annotated[Steps | None, Allowed(shown="that of the task")] = None
    seed: Seed = 0
    out: Folder = Path("results")
    format: Annotated[tuple[Format, ...], Allowed()] = ("png",)

    def check(self) -> None:
        """Refuse tasks whose teams do not learn, and unknown values."""
        task = self.task_given()
        if not callable(task.skilled):
            from teamsight.tasks.registry import TASKS

            names = ", ".join(name for name, one in TASKS.items() if callable(one.skilled))
            raise ValueError(f"task={task.name!r}: its team does not learn; give one whose team does: {names}")
        task.full_scenario(self.set)

    def task_given(self) -> Task:
        """Return the task."""
        from teamsight.tasks.named import task_of

        return task_of(self.task)


def curve(settings: CurveSettings) -> None:
    """Draw the learning curve of a task.

    For tasks whose team learns while it acts, such as pursuit. Teams learn for several times, with each degree of
    awareness, and are then tested on the same worlds, in which they have not learned. Writes a picture, a table of all
    tests, one of the means with their intervals over trainings, and one of what awareness adds. Learning from a
    recorded exploration of CMOMMT has its own curves, `teamsight learn figure`.

    \b
    Examples:
      teamsight learn curve --task pursuit
      teamsight learn curve --task pursuit --learned 1000,10000 \\
          --awareness none,pairwise,nearest
      teamsight learn curve --task pursuit --set hunters=4 \\
          --trainings 10 --out four
    """
    from teamsight.analysis.learning.task_curve_figure import curve_points, draw
    from teamsight.analysis.learning.task_curves import awareness_gain, learning_curve
    from teamsight.analysis.runs.files import Content, check_results, prepare_folder, write_results
    from teamsight.cli.show import say, working

    task, folder = settings.task_given(), prepare_folder(settings.out)
    about = {"learning curve": _about(settings, task)}
    pictures = {f"{_PICTURE}.{kind}": kind for kind in settings.format}
    check_results(folder, (_TESTS, _POINTS, _GAINS, *pictures), about, force=settings.force)
    began = time.perf_counter()
    with when_stopped(lambda: "nothing was kept"), working(settings.workers) as (watch, pool):
        table = learning_curve(
            task, settings.learned, awareness=settings.awareness, scenario=settings.set, pool=pool, rng=settings.seed,
            progress=partial(watch, "testing"), **settings.values(("trainings", "runs", "steps")),
        )  # fmt: skip
    points = curve_points(table)
    gains = awareness_gain(task, table, str(points["awareness"].iloc[0]))
    drawn = {name: draw(points, task, _subtitle(settings), kind) for name, kind in pictures.items()}
    contents: dict[str, Content] = {_TESTS: table, _POINTS: points, _GAINS: gains, **drawn}
    write_results(folder, contents, about, force=settings.force)
    _show(points, task)
    say(f"learning curve of {task.name} in {folder} after {time.perf_counter() - began:.0f} s")


def _about(settings: CurveSettings, task: Task) -> dict[str, Any]:
    """Return the settings, fit for JSON."""
    given = settings.values(("learned", "awareness", "trainings", "runs", "steps", "seed"))
    named = {name: list(value) if isinstance(value, tuple) else value for name, value in given.items()}
    return {"task": task.name, "scenario": task.full_scenario(settings.set), **named}


def _subtitle(settings: CurveSettings) -> str:
    scenario = "".join(f"{name} = {value}; " for name, value in settings.set.items())
    return (
        f"{scenario}{settings.trainings} trainings, {settings.runs} test runs of each; 95 % intervals over trainings; "
        f"seed {settings.seed}"
    )


def _show(points: pd.DataFrame, task: Task) -> None:
    from teamsight.cli.show import say

    for row in points.to_dict("records"):
        ends = f" ({row['low']:.4g} to {row['high']:.4g})" if math.isfinite(row["low"]) else ""
        censored = f", {row['censored']:.0%} censored" if row["censored"] else ""
        reached = f"{task.objective.metric} {row['mean']:.4g}{ends}{censored}"
        say(f"{row['awareness']}, {row['learned']:,} steps of learning: {reached}")
