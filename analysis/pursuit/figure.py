"""The figure: learning curves of joint hunters, and what seeing the partner is worth over time, for three depths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.analysis.plot.style import DEGREE, FAINT, canvas, head, plain, to_picture
from teamsight.analysis.pursuit.claims import gains
from teamsight.analysis.pursuit.paper import VALUES
from teamsight.analysis.pursuit.plan import Plan
from teamsight.analysis.pursuit.trials import BLOCK
from teamsight.analysis.stats.paired import interval_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = npt.NDArray[np.float64]

_TITLE = "Two hunters that learn to capture together"
#: Conditions of the first panel, their names, and the colour of the degree of awareness that each needs.
CURVES = {
    "2/2 joint": ("independent", DEGREE["none"]),
    "2/2 joint passive": ("sees the partner", DEGREE["pairwise"]),
    "2/2 joint mutual": ("mutual scouting", DEGREE["shared"]),
}
_DEPTHS = {2: ("#9ecae1", ", depth 2"), 3: ("#4292c6", ", depth 3"), 4: ("#084594", "")}
# Blocks that one point of the figure averages.
_POINT = 4
_TRIALS = 3000


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
    head(
        figure,
        _TITLE,
        f"two prey on a 10 × 10 grid; {plan.runs} runs of each; 95 % confidence bands; dashed: where Tan's settle; "
        f"seed {plan.seed}",
    )
    left = figure.add_axes((0.07, 0.13, 0.41, 0.66))
    right = figure.add_axes((0.57, 0.13, 0.41, 0.66))
    for axes in (left, right):
        plain(axes)
        axes.set_xlabel("trials")
    _draw_curves(left, table)
    _draw_gains(right, table)
    return to_picture(figure, _TITLE, kind)


def _draw_curves(axes: Axes, table: pd.DataFrame) -> None:
    axes.set_title("depth 4", loc="left", size=10)
    axes.set_ylabel("steps of a trial")
    for name, (label, colour) in CURVES.items():
        curves = table[table["condition"] == name]["curve"].tolist()
        if not curves:
            continue
        _band(axes, np.array([np.asarray(curve, float) for curve in curves]), colour, label)
        settled = [one.steps for one in VALUES if (one.condition, one.phase, one.where) == (name, "training", "Fig. 7")]
        for value in settled:
            axes.axhline(value, color=colour, linestyle="--", linewidth=1.0)
    axes.set_ylim(bottom=0)
    _legend(axes, "upper right")


def _draw_gains(axes: Axes, table: pd.DataFrame) -> None:
    axes.set_title("what seeing the partner is worth", loc="left", size=10)
    axes.set_ylabel("steps saved in a trial")
    axes.axhline(0.0, color=FAINT, linewidth=1.0)
    have = set(table["condition"])
    for depth, (colour, suffix) in _DEPTHS.items():
        names = (f"2/2 joint{suffix}", f"2/2 joint passive{suffix}")
        if have.issuperset(names):
            _band(axes, gains(table, *names)[:, : _TRIALS // BLOCK], colour, f"d = {depth}")
    _legend(axes, "lower right")


def _legend(axes: Axes, where: Literal["upper right", "lower right"]) -> None:
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, loc=where)


def _band(axes: Axes, curves: Floats, colour: str, label: str) -> None:
    """Draw the mean over runs with its interval, one point for some blocks."""
    points = max(curves.shape[1] // _POINT, 1)
    grouped = [part.mean(axis=1) for part in np.array_split(curves, points, axis=1)]
    trial = BLOCK * (np.arange(points) + 0.5) * curves.shape[1] / points
    found = [interval_of(part) for part in grouped]
    axes.plot(trial, [one.mean for one in found], color=colour, label=label, linewidth=1.6)
    if np.isfinite([one.low for one in found]).all():
        axes.fill_between(
            trial, [one.low for one in found], [one.high for one in found], color=colour, alpha=0.2, linewidth=0
        )
