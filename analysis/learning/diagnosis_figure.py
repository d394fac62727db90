"""The figure and the page of a diagnosis: effect of actions, matches of eq. 1, and learned moves, against distance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.analysis.learning.diagnosis import BINS
from teamsight.analysis.learning.plans import LEAST_FOR_INTERVAL
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import FAINT, INK, canvas, head, plain, to_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# Inches: a panel with its margins, the margins on the left of a panel and below it, and the head of the figure.
_WIDTH, _HEIGHT, _LEFT, _BENEATH, _ABOVE, _HEAD = 5.3, 3.7, 0.75, 0.6, 0.45, 0.8
_COLUMNS = 2
_TITLE = "What learners make of a single target"
# Colours of the fewest and of the most transitions; from light to dark.
_SHADES = ("#9ecae1", "#08306b")
# Intervals of distances in the tables: a few of those where little changes, and all near the sensing range.
_SHOWN = (2, 6, 10, 14, 16, 17, 18, 19)


def draw(points: pd.DataFrame, conditions: str) -> bytes:
    """Return the figure as PNG.

    Parameters
    ----------
    points : DataFrame
        From `diagnosis_points`.
    conditions : str
        The settings in a line, for the subtitle.
    """
    return to_png(draw_on_canvas(points, conditions), f"{_TITLE}; {conditions}")


def draw_on_canvas(points: pd.DataFrame, conditions: str) -> Canvas:
    """Return the figure; see `draw`. Learners see the robot's own inputs."""
    own = points[points["inputs"] == points["inputs"].min()]
    learners = list(own.loc[own["quantity"] == "approach", "learner"].unique())
    rows = math.ceil((2 + len(learners)) / _COLUMNS)
    figure = canvas(_COLUMNS * _WIDTH, rows * _HEIGHT + _HEAD)
    head(figure, _TITLE, f"{conditions}; {own['inputs'].min()} inputs")
    _draw_effect(_panel(figure, 0, rows), own[own["quantity"] == "effect"])
    _draw_matches(_panel(figure, 1, rows), own)
    for number, learner in enumerate(sorted(learners, key=list(LEARNERS).index)):
        moves = own[(own["quantity"] == "approach") & (own["learner"] == learner)]
        axes = _panel(figure, 2 + number, rows)
        _draw_by_size(axes, moves)
        axes.axhline(0.0, color=FAINT, linewidth=1.0)
        _label(axes, f"How far {LEARNERS[learner].title or learner} approaches it", "approach  [steps]")
        axes.set_ylim(-1.08, 1.08)
    return figure


def _panel(figure: Canvas, number: int, rows: int) -> Axes:
    row, column = divmod(number, _COLUMNS)
    width, height = figure.get_size_inches()
    bottom = (rows - 1 - row) * _HEIGHT + _BENEATH
    inner = (_WIDTH - _LEFT - 0.2, _HEIGHT - _BENEATH - _ABOVE)
    axes = figure.add_axes(((column * _WIDTH + _LEFT) / width, bottom / height, inner[0] / width, inner[1] / height))
    plain(axes)
    axes.tick_params(colors=FAINT)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("distance of the target  [sensing ranges]")
    return axes


def _label(axes: Axes, title: str, label: str) -> None:
    axes.set_title(title, loc="left", size=11.5, color=INK)
    axes.set_ylabel(label)


def _draw_effect(axes: Axes, points: pd.DataFrame) -> None:
    _line(axes, points, INK, "")
    _label(axes, "How an action changes the reward", "E[r | toward] − E[r | away]")


def _draw_matches(axes: Axes, own: pd.DataFrame) -> None:
    _draw_by_size(axes, own[own["quantity"] == "matches"])
    chance = own.loc[own["quantity"] == "matches by chance", "mean"].mean()
    axes.axhline(chance, color=FAINT, linestyle="--", linewidth=1.2, label="drawn at random")
    axes.set_ylim(0.0, 1.04)
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(0.0, 0.52))
    _label(axes, "What eq. 1 matches with it", "share that shows a target there")


def _draw_by_size(axes: Axes, points: pd.DataFrame) -> None:
    """Draw a line for each number of transitions."""
    sizes = sorted(points["transitions"].unique())
    for size, colour in zip(sizes, _shades(len(sizes)), strict=True):
        _line(axes, points[points["transitions"] == size], colour, f"{size:,} transitions")


def _line(axes: Axes, points: pd.DataFrame, colour: str, label: str) -> None:
    of = points.sort_values("distance")
    axes.plot(of["distance"], of["mean"], color=colour, marker="o", markersize=3.5, label=label)
    known = of[of["count"] >= LEAST_FOR_INTERVAL]
    axes.fill_between(known["distance"], known["low"], known["high"], color=colour, alpha=0.15, linewidth=0)


def _shades(count: int) -> Sequence[str]:
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    shades = LinearSegmentedColormap.from_list("transitions", _SHADES)
    return [to_hex(shades(share)) for share in np.linspace(0.0, 1.0, count)]


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
            cells = {round(point["distance"] * BINS - 0.5): _cell(point) for point in part.to_dict("records")}
            rows.append([*map(str, names), *(cells.get(place, "–") for place in _SHOWN)])
    return markdown.table([*by, *columns], rows)


def _cell(point: dict[Any, Any]) -> str:
    wide = point["high"] - point["mean"]
    return f"{point['mean']:.2f}" + (f" ± {wide:.2f}" if wide < float("inf") else "")
