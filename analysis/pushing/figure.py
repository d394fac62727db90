"""The figure: times, stagnation and neighbours against the number of robots."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.plot.style import COLOURS, ROBOTS_LABEL, canvas, head, plain, to_picture
from teamsight.analysis.pushing.claims import runs_of, stagnation
from teamsight.analysis.pushing.plan import Plan
from teamsight.analysis.stats.paired import interval_of

_TITLE = "Robots that push a box together"
#: The colour of each team.
_COLOUR = dict(zip(("explore", "fixed priority", "no recovery", "network"), COLOURS, strict=False))


def draw(table: pd.DataFrame, plan: Plan, kind: str = "png") -> bytes:
    """Return the figure.

    Parameters
    ----------
    table : DataFrame
        The table of the runs of the plan.
    plan : Plan
        What was simulated.
    kind : str
        A format in `teamsight.analysis.plot.style.FORMATS`.
    """
    figure = canvas(11.0, 4.4)
    head(figure, _TITLE, f"{plan.runs} runs of each team; 95 % confidence intervals; seed {plan.seed}")
    panels = [figure.add_axes((0.07 + 0.32 * number, 0.14, 0.26, 0.62)) for number in range(3)]
    titles = ("steps until the box is moved", "stagnation", "largest number of neighbours")
    for axes, title in zip(panels, titles, strict=True):
        plain(axes)
        axes.set_title(title, loc="left", size=10)
        axes.set_xlabel(ROBOTS_LABEL)
    sizes = [size for size in plan.robots if size >= 2]
    for team in ("fixed priority", "no recovery", "network"):
        _line(panels[0], team, {size: np.asarray(runs_of(table, team, size)["time"], float) for size in sizes})
    for team in ("fixed priority", "no recovery"):
        shares = {size: stagnation(runs_of(table, team, size)) for size in sizes}
        _line(panels[1], team, {size: share for size, share in shares.items() if len(share)})
    for team in ("explore", "fixed priority"):
        met = {size: np.asarray(runs_of(table, team, size)["max_neighbours"], float) for size in sizes}
        _line(panels[2], team, met)
    panels[2].plot(sizes, [size - 1 for size in sizes], color="#999999", linewidth=0.8, linestyle=":", label="N − 1")
    panels[1].set_ylim(0, 1)
    for axes in panels:
        axes.set_ylim(bottom=0)
        axes.legend(frameon=False, fontsize=8)
    return to_picture(figure, _TITLE, kind)


def _line(axes: Any, team: str, values: dict[int, Any]) -> None:
    """Draw the means of a team, with intervals where there is more than one run."""
    found = [interval_of(one) for one in values.values()]
    wide = [max(one.high - one.mean, 0.0) if np.isfinite(one.high) else 0.0 for one in found]
    axes.errorbar(
        list(values), [one.mean for one in found], wide, color=_COLOUR[team], label=team, marker="o", markersize=3.5,
        linewidth=2.4 if team == "fixed priority" else 1.2, capsize=2,
    )  # fmt: skip
