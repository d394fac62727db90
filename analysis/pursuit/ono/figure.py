"""The figure: steps to a capture while hunters learn, on the large torus and on the small one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.plot.style import COLOURS, FAINT, canvas, head, plain, to_picture
from teamsight.analysis.pursuit.ono.conditions import SIDE, SMALL
from teamsight.analysis.pursuit.ono.measure import PARTS
from teamsight.analysis.pursuit.ono.plan import Plan
from teamsight.analysis.pursuit.ono.rates import expected_steps

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TITLE = "Four hunters learn to surround a prey"
# By condition: the label and the colour.
_LARGE = {
    "modular, depth 2": ("modules, depth 2", COLOURS[1]),
    "modular, depth 3": ("modules, depth 3", COLOURS[2]),
    "monolithic, depth 2": ("one table over all, depth 2", COLOURS[3]),
    "nearest 2, depth 2": ("the 2 nearest, depth 2", COLOURS[4]),
    "nearest 1, depth 2": ("the nearest, depth 2", COLOURS[5]),
}
_SMALL = {
    f"modular, side {SMALL}": ("modules", COLOURS[1]),
    f"monolithic, side {SMALL}": ("one table over all", COLOURS[3]),
}


def draw(table: pd.DataFrame, plan: Plan, kind: str = "png") -> bytes:
    """Return the figure in a format of `plot.style.FORMATS`.

    Parameters
    ----------
    table : DataFrame
        One row for each run of the plan.
    plan : Plan
        What was simulated.
    kind : str
        The format.
    """
    figure = canvas(11.0, 4.8)
    about = f"one prey; {plan.runs} runs of each, and their geometric mean; dashed: random hunters, by formula"
    head(figure, _TITLE, f"{about}; seed {plan.seed}")
    left = figure.add_axes((0.08, 0.13, 0.5, 0.66))
    right = figure.add_axes((0.66, 0.13, 0.32, 0.66))
    for axes, side, curves in ((left, SIDE, _LARGE), (right, SMALL, _SMALL)):
        plain(axes)
        axes.set_xlabel("steps of learning [million]")
        axes.set_title(f"torus of {side} × {side}", loc="left", size=10)
        axes.set_xscale("log")
        axes.set_yscale("log")
        _draw(axes, table, curves)
        axes.axhline(expected_steps(side), color=FAINT, linestyle="--", linewidth=1.0)
    left.set_ylabel("steps to a capture")
    return to_picture(figure, _TITLE, kind)


def _draw(axes: Axes, table: pd.DataFrame, curves: Mapping[str, tuple[str, str]]) -> None:
    for name, (label, colour) in curves.items():
        runs = table[table["condition"] == name]
        if runs.empty:
            continue
        part = int(runs["steps"].iloc[0]) / PARTS
        captures = np.array(runs["parts"].tolist(), float)
        # A part without a capture is drawn as if it had half of one.
        steps = part / np.maximum(captures, 0.5)
        middle = part * (np.arange(PARTS) + 0.5) / 1e6
        for one in steps:
            axes.plot(middle, one, color=colour, linewidth=0.5, alpha=0.35)
        axes.plot(middle, np.exp(np.log(steps).mean(axis=0)), color=colour, linewidth=2.0, label=label)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, fontsize=8, loc="upper right", bbox_to_anchor=(1.0, 0.93))
