"""The plot of a task's learning curve: its objective against how long the team has learned, for each degree."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd

from teamsight.analysis.plot.style import COLOURS, canvas, head, plain, to_picture
from teamsight.analysis.stats.paired import interval_of
from teamsight.tasks.task import Task


def curve_points(curve: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return the mean objective of each degree after each time of learning, with its interval over trainings.

    Parameters
    ----------
    curve : DataFrame
        From `teamsight.analysis.learning.task_curves.learning_curve`.
    level : float
        Confidence of the intervals; they are infinite for a single training.

    Returns
    -------
    DataFrame
        awareness, learned, mean, low, high, censored (share of the runs that did not end).
    """
    rows = []
    for (awareness, learned), part in curve.groupby(["awareness", "learned"], sort=False):
        means = part.groupby("training")["counted"].mean().to_numpy(np.float64)
        interval = interval_of(means, level)
        censored = float(np.isinf(part["value"]).mean())
        rows.append({"awareness": awareness, "learned": learned, **interval._asdict(), "censored": censored})
    return pd.DataFrame(rows)


def draw(points: pd.DataFrame, task: Task, subtitle: str, kind: str = "png") -> bytes:
    """Return the figure.

    Parameters
    ----------
    points : DataFrame
        From `curve_points`.
    task : Task
        The task.
    subtitle : str
        What was measured.
    kind : str
        A format in `teamsight.analysis.plot.style.FORMATS`.
    """
    figure = canvas(7.5, 4.8)
    title = f"{task.title}: what learning with awareness gives"
    head(figure, title, subtitle)
    axes = figure.add_axes((0.12, 0.13, 0.84, 0.66))
    plain(axes)
    for (awareness, part), colour in zip(points.groupby("awareness", sort=False), itertools.cycle(COLOURS)):
        part = part.sort_values("learned")
        axes.plot(part["learned"], part["mean"], color=colour, marker="o", markersize=4, label=str(awareness))
        known = part[np.isfinite(part["low"])]
        axes.fill_between(known["learned"], known["low"], known["high"], color=colour, alpha=0.18, linewidth=0)
    if points["learned"].min() > 0 and points["learned"].nunique() > 1:
        axes.set_xscale("log")
    axes.set_xlabel("steps of learning")
    axes.set_ylabel(f"{task.objective.metric} ({task.objective.better} is better)")
    axes.legend(frameon=False)
    return to_picture(figure, title, kind)
