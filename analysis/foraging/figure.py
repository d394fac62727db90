"""The figure: completion times against the number of robots, for each level of communication."""

from __future__ import annotations

import numpy as np
import pandas as pd

from teamsight.analysis.foraging.plan import NAMES, Plan
from teamsight.analysis.plot.style import DEGREE, canvas, head, plain, to_picture
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies.schemas import COMMUNICATION

_TITLE = "What communication is worth in three tasks"
_COLOURS = dict(zip(COMMUNICATION, (DEGREE["none"], DEGREE["pairwise"], DEGREE["shared"]), strict=True))


def draw(table: pd.DataFrame, plan: Plan, kind: str = "png") -> bytes:
    """Return the figure.

    Parameters
    ----------
    table : DataFrame
        One row for each run of the plan.
    plan : Plan
        What was simulated.
    kind : str
        A format in `teamsight.analysis.plot.style.FORMATS`.
    """
    figure = canvas(11.0, 4.4)
    runs = f"{plan.runs} runs of each cell; 95 % confidence intervals; seed {plan.seed}"
    head(figure, _TITLE, f"steps to complete, mean over numbers of attractors; {runs}")
    for number, task in enumerate(NAMES):
        axes = figure.add_axes((0.07 + 0.32 * number, 0.14, 0.26, 0.62))
        plain(axes)
        axes.set_title(task, loc="left", size=10)
        axes.set_xlabel("robots N")
        for communication in COMMUNICATION:
            part = table[(table["task"] == task) & (table["communication"] == communication)]
            robots = sorted(part["robots"].unique())
            found = [interval_of(np.asarray(part[part["robots"] == n]["time"], float)) for n in robots]
            wide = [max(one.high - one.mean, 0.0) if np.isfinite(one.high) else 0.0 for one in found]
            axes.errorbar(
                robots, [one.mean for one in found], wide, color=_COLOURS[communication], label=communication,
                marker="o", markersize=4, linewidth=1.4, capsize=2,
            )  # fmt: skip
        axes.set_ylim(bottom=0)
        axes.set_xticks(list(plan.robots))
        if not number:
            axes.set_ylabel("steps")
            axes.legend(frameon=False)
    return to_picture(figure, _TITLE, kind)
