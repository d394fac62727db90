"""``teamsight learn curve``: the learning curve of a task whose team learns while it acts."""

from __future__ import annotations

import math
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.analysis.runs.limits import MOST_STEPS
from teamsight.cli import limits, task_options, values
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Settings
from teamsight.core import checks

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.tasks.task import Task

_TESTS, _POINTS, _GAINS = "learning-curve.parquet", "learning-curve-points.parquet", "learning-curve-gains.parquet"
_PICTURE = "learning-curve"
# Times of learning, and trainings of each.
_MOST_TIMES, _MOST_TRAININGS = 50, 1000


class CurveSettings(Settings):
    """Settings of ``teamsight learn curve``."""

    task: str | None = values.choice(
        "pursuit", "The task: {names}. Its team has to learn, as those of pursuit and collect do.", task_options.TASKS
    )
    set: dict[str, Any] = task_options.scenario("A value of the scenario of the task. May be given several times.")
    learned: tuple[int, ...] = values.counts(
        (1000, 10000, 100000), "Numbers of steps of learning, separated by commas.", most=_MOST_TIMES
    )
    awareness: tuple[str, ...] = values.choices(
        ("none", "pairwise"), "Degrees of awareness, separated by commas: {names}; gains are over the first.",
        values.DEGREES, "awareness",
    )  # fmt: skip
    trainings: int = values.count(5, "How often each team learns, with other seeds.", most=_MOST_TRAININGS)
    runs: int = values.count(20, "Number of test runs of each training.", most=limits.MOST_CELL_RUNS)
    steps: int | None = values.steps(None, "Number of steps of each test run.", shown="that of the task")
    seed: int = values.seed(0, "Seed of the learning and of the tests.")
    out: Path = values.folder(Path("results"), "Folder for the results.")
    format: tuple[str, ...] = values.choices(
        ("png",), "Formats of the picture, with commas between them: {names}.", values.FORMATS, "format"
    )
    workers: int | None = values.workers()
    force: bool = values.force()

    def check(self) -> None:
        """Refuse tasks whose teams do not learn, unknown values, and times of learning that no run may have."""
        task = task_options.task_of(self)
        if not callable(task.skilled):
            from teamsight.tasks.registry import TASKS

            names = ", ".join(name for name, one in TASKS.items() if callable(one.skilled))
            raise ValueError(f"task={task.name!r}: its team does not learn; give one whose team does: {names}")
        task.full_scenario(self.set)
        for amount in self.learned:
            checks.count("learned", amount, most=MOST_STEPS, cure="let teams learn for less long")


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
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.analysis.runs.results import Content, check_results, write_results
    from teamsight.cli.show import say, working

    task, folder = task_options.task_of(settings), prepare_folder(settings.out)
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
