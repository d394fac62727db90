"""Figs. 4 to 7: the largest number of neighbours, and the percentage of observed targets, under one policy."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import canvas, head
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import cell_maxima, cell_means, grid_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


def neighbours_figure(name: str, experiment: str, policy: str) -> Figure:
    """Return the figure of the largest number of robots within any robot's awareness range."""
    title = f"Largest number of neighbours: {policy}"

    def draw(tables: Tables, conditions: Conditions) -> Canvas:
        grid = grid_of(cell_maxima(tables[""], "max_neighbours"))
        look = Look(
            "largest number of neighbours  [robots]", "{:.0f}".format, 0, max(1.0, float(grid.to_numpy().max()))
        )
        figure = canvas(WIDTH, HEIGHT + HEAD)
        head(
            figure, f"Fig. {name}   {title}", f"maximum over {conditions.line()}; awareness range 1; {_range_of(grid)}"
        )
        draw_row(figure, grid, look)
        return figure

    return Figure(name, title, (experiment,), _tabulate(experiment), draw)


def observed_figure(name: str, experiment: str, policy: str) -> Figure:
    """Return the figure of the mean percentage of targets that at least one robot senses."""
    title = f"Observed targets: {policy}"
    look = Look("observed targets  [%]", "{:.0f}".format, 0, 100)

    def draw(tables: Tables, conditions: Conditions) -> Canvas:
        grid = grid_of(cell_means(tables[""], "observed_fraction")) * 100
        targets = int(tables[""]["targets"].iloc[0])
        figure = canvas(WIDTH, HEIGHT + HEAD)
        head(
            figure,
            f"Fig. {name}   {title}",
            f"mean over {conditions.line()}; {targets} targets, sensing range 1; {_range_of(grid)}",
        )
        draw_row(figure, grid, look)
        return figure

    return Figure(name, title, (experiment,), _tabulate(experiment), draw)


def _tabulate(experiment: str) -> Callable[[Tables, Conditions], dict[str, pd.DataFrame]]:
    def tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
        return {"": tables[experiment]}

    return tabulate


def _range_of(grid: pd.DataFrame) -> str:
    robots, radius = np.asarray(grid.index), np.asarray(grid.columns)
    return f"N = {robots.min()}..{robots.max()}, R = {radius.min():g}..{radius.max():g}"


FIGURE_4 = neighbours_figure("4", "random-walk", "random walk")
FIGURE_5 = neighbours_figure("5", "a-cmommt", "A-CMOMMT")
FIGURE_6 = observed_figure("6", "centroid", "centroid of the sensed targets, no awareness")
FIGURE_7 = observed_figure("7", "a-cmommt", "A-CMOMMT, pairwise awareness")
