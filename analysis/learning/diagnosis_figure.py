"""The figure and the page of a diagnosis: effect of actions, matches of eq. 1, and learned moves, against distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.learning.diagnosis import BINS, DISTANCES
from teamsight.analysis.learning.plans import LEAST_FOR_INTERVAL
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import draw_means, panels
from teamsight.analysis.plot.style import FAINT, shades
from teamsight.analysis.stats.verdicts import plus_minus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# Intervals of distances in the tables: a few of those where little changes, and all near the sensing range.
_SHOWN = (2, 6, 10, 14, 16, 17, 18, 19)


def draw(points: pd.DataFrame, conditions: str) -> Canvas:
    """Return the figure; learners see the robot's own inputs.

    Parameters
    ----------
    points : DataFrame
        From `diagnosis_points`.
    conditions : str
        The settings in a line, for the subtitle.
    """
    own = points[points["inputs"] == points["inputs"].min()]
    # Few transitions may show none of them.
    effect, matches, by_chance, moves = (
        own[own["quantity"] == name] for name in ("effect", "matches", "matches by chance", "approach")
    )
    learners = sorted(moves["learner"].unique(), key=list(LEARNERS).index)
    last = moves[(moves["transitions"] == moves["transitions"].max()) & (moves["distance"] == DISTANCES[-2])]
    far = ", ".join(f"{row['mean']:+.2f} ({row['learner']})" for row in last.to_dict("records")).replace("-", "−")
    figure, shown = panels(
        f"Steps toward a target near the sensing range: {far or 'unknown'}",
        f"{conditions}; {own['inputs'].min()} inputs",
        ["How an action changes the reward", "What eq. 1 matches with a single target",
         *(f"How far {LEARNERS[learner].title or learner} approaches it" for learner in learners)],
        x="distance of the target  [sensing ranges]",
        y=["E[r | toward] − E[r | away]", "share that shows a target there", *["approach  [steps]"] * len(learners)],
        columns=2, size=(5.3, 3.5), sharex=True,
    )  # fmt: skip
    shown[0].set_xlim(0.0, 1.0)
    _draw_by_size(shown[0], effect)
    _draw_by_size(shown[1], matches)
    shown[1].axhline(by_chance["mean"].mean(), color=FAINT, linestyle="--", linewidth=1.2, label="drawn at random")
    shown[1].set_ylim(0.0, 1.04)
    shown[1].legend(frameon=False, loc="center left", bbox_to_anchor=(0.0, 0.52))
    for axes, learner in zip(shown[2:], learners, strict=True):
        _draw_by_size(axes, moves[moves["learner"] == learner])
        axes.axhline(0.0, color=FAINT, linewidth=1.0)
        axes.set_ylim(-1.08, 1.08)
    return figure


def _draw_by_size(axes: Axes, points: pd.DataFrame) -> None:
    """Draw a line for each number of transitions, with a band where it has an interval."""
    sizes = sorted(points["transitions"].unique())
    for size, colour in zip(sizes, shades(len(sizes)), strict=True):
        of = points[points["transitions"] == size].sort_values("distance")
        found = of[["mean", "low", "high"]].to_numpy(float)
        found[of["count"] < LEAST_FOR_INTERVAL, 1:] = np.inf
        draw_means(axes, of["distance"], found, colour, f"{size:,} transitions", marker="o", markersize=3.5)


def page(points: pd.DataFrame, conditions: str) -> str:
    """Return the tables; means with half of their 95 % intervals over the explorations.

    Parameters
    ----------
    points : DataFrame
        From `diagnosis_points`.
    conditions : str
        The settings in a line.
    """
    return markdown.page(
        "# Diagnosis",
        f"{conditions[0].upper()}{conditions[1:]}. Distances are in sensing ranges.",
        "## Mean reward of a move",
        _table(points, ("toward", "away", "effect", "rewarded by chance"), ("quantity",)),
        "## Share of the matches that show a target there",
        _table(points, ("matches", "matches by chance"), ("quantity", "inputs", "transitions")),
        "## Approach to the target, in steps",
        _table(points, ("approach",), ("learner", "inputs", "transitions")),
        "## Share of the chosen transitions that were rewarded",
        _table(points, ("rewarded",), ("learner", "inputs", "transitions")),
    )


def _table(points: pd.DataFrame, quantities: Sequence[str], by: Sequence[str]) -> str:
    """Return a table with a row for each combination of `by`, and a column for each interval that is shown."""
    columns = [f"{place / BINS:.2f}–{(place + 1) / BINS:.2f}" for place in _SHOWN]
    rows = []
    for quantity in quantities:
        of = points[points["quantity"] == quantity]
        for names, part in of.groupby(list(by), sort=True):
            cells = {
                round(point["distance"] * BINS - 0.5): plus_minus(point["mean"], point["high"], ".2f")
                for point in part.to_dict("records")
            }
            rows.append([*map(str, names), *(cells.get(place, "–") for place in _SHOWN)])
    return markdown.table([*by, *columns], rows)
