"""Figs. 4 to 7: a quantity of each team size in each arena."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.kinds import draw_curves
from teamsight.analysis.plot.style import FAINT, canvas, head
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import cell_means, grid_of, maxima

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# Height of the curves below the surface [inches].
_CURVES = 4.6


def _neighbours(name: str, experiment: str, policy: str) -> Figure:
    """Return a figure of the largest number of neighbours under one policy."""
    title = f"Largest number of neighbours: {policy}"

    def tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
        return {"": tables[experiment], "cells": cell_means(tables[experiment], "max_neighbours")}

    def draw(tables: Tables, conditions: Conditions) -> Canvas:
        grid = maxima(tables[""])
        figure = canvas(WIDTH, HEAD + HEIGHT + _CURVES)
        runs = conditions.runs
        head(
            figure,
            f"Fig. {name}   {title}",
            f"of each cell the maximum of all {runs} runs, of {conditions.steps} steps each; setting "
            f"{conditions.name}, seed {conditions.root}; awareness range 1; {_extent(grid)}",
        )
        # All teammates of the largest team: both figures have one scale, even if one of them is drawn alone.
        most = max(1, grid.index.max() - 1)
        draw_row(figure, grid, Look("largest number of neighbours  [robots]", "{:.0f}".format, 0, most))
        _draw_means(figure, tables["cells"], "largest number in a run  [robots]", most).set_title(
            f"mean over the {runs} runs of the largest number in one run, which the maximum of all exceeds\n"
            + _uncertainty(tables["cells"], ""),
            loc="left", size=11, color=FAINT,
        )  # fmt: skip
        return figure

    return Figure(name, title, (experiment,), tabulate, draw)


def _observed(name: str, experiment: str, policy: str) -> Figure:
    """Return a figure of the observed targets under one policy, with their confidence intervals."""
    title = f"Observed targets: {policy}"
    label = "observed targets  [%]"

    def tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
        return {"": tables[experiment], "cells": cell_means(tables[experiment], "observed_fraction")}

    def draw(tables: Tables, conditions: Conditions) -> Canvas:
        cells = tables["cells"].copy()
        cells[["mean", "low", "high"]] *= 100
        grid = grid_of(cells)
        figure = canvas(WIDTH, HEAD + HEIGHT + _CURVES)
        head(
            figure,
            f"Fig. {name}   {title}",
            f"mean over {conditions.line()}; 15 targets, sensing range 1; {_extent(grid)}",
        )
        draw_row(figure, grid, Look(label, "{:.0f}".format, 0, 100))
        _draw_means(figure, cells, label, 100).set_title(_uncertainty(cells), loc="left", size=11, color=FAINT)
        return figure

    return Figure(name, title, (experiment,), tabulate, draw)


def _draw_means(figure: Canvas, cells: pd.DataFrame, label: str, most: float) -> Axes:
    """Draw means with their intervals against team size, below the surface."""
    total = figure.get_figheight()
    axes = figure.add_axes((0.065, 0.62 / total, 0.81, (_CURVES - 1.25) / total))
    draw_curves(axes, cells, label)
    axes.set(xlim=(cells["robots"].min(), cells["robots"].max()), ylim=(0, 1.02 * most))
    return axes


def _extent(grid: pd.DataFrame) -> str:
    robots, radius = grid.index, grid.columns
    return f"N = {robots.min()}..{robots.max()}, R = {radius.min():g}..{radius.max():g}"


def _uncertainty(cells: pd.DataFrame, unit: str = " points") -> str:
    """Return the half-widths of the confidence intervals in words."""
    if (cells["count"] < 2).any():
        return "one run per cell gives no confidence intervals"
    half = cells["high"] - cells["mean"]
    worst = int(half.argmax())
    return (
        f"bands: 95 % confidence interval of the mean; its half-width is {half.median():.1f}{unit} in the median cell "
        f"and at most {half.max():.1f} (N = {cells['robots'].iloc[worst]}, R = {cells['radius'].iloc[worst]:g})"
    )


FIGURE_4 = _neighbours("4", "random-walk", "random walk")
FIGURE_5 = _neighbours("5", "a-cmommt", "A-CMOMMT")
FIGURE_6 = _observed("6", "centroid", "centroid of the sensed targets, no awareness")
FIGURE_7 = _observed("7", "a-cmommt", "A-CMOMMT, pairwise awareness")
