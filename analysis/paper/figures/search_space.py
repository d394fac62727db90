"""Fig. 2: inputs of a robot, and size of its search space, against team size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import DEGREE, FAINT, ROBOTS_LABEL, canvas, head, plain, superscript

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_LARGEST_TEAM = 30


def _tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
    from teamsight.analysis.search_space import PAPER, dimensions_table

    return {"": dimensions_table(range(1, _LARGEST_TEAM + 1), degrees=PAPER)}


def _draw(tables: Tables, conditions: Conditions) -> Canvas:
    figure = canvas(14.4, 6.4)
    head(
        figure,
        "Fig. 2   Search space against team size, for each degree of awareness",
        "n = 16 sensors of the world, δ = 16 inputs for all teammates, σ = 2 for each; in closed form",
    )
    for left, value, label in (
        (0.05, "inputs", "dimensions d of the search space  [inputs]"),
        (0.565, "log10_size", "size of the search space pᵈ for p = 2"),
    ):
        axes = figure.add_axes((left, 0.11, 0.32, 0.7))
        _lines(axes, tables[""], value)
        axes.set_ylabel(label)
        if value == "log10_size":
            axes.yaxis.set_major_formatter(lambda power, _: f"10{superscript(f'{power:.0f}')}")
    return figure


def _lines(axes: Axes, table: pd.DataFrame, value: str) -> None:
    plain(axes)
    ends = table.groupby("degree", sort=False)[value].last()
    near = 0.05 * ends.max()
    for degree, rows in table.groupby("degree", sort=False):
        colour = DEGREE[str(degree)]
        axes.plot(rows["team_size"], rows[value], color=colour, linewidth=2.2, marker="o", markersize=3)
        last = rows.iloc[-1]
        number = f"{last[value]:.0f}"
        gaps = ends - last[value]
        formula = f"d = {last['formula']}  ({number})" if value == "inputs" else f"10{superscript(number)}"
        axes.annotate(
            f"{last['growth']}:  {formula}",
            (last["team_size"], last[value]),
            # The labels of lines that end close together move apart.
            xytext=(8, 4 * gaps.between(-near, 0, "neither").any() - 5 * gaps.between(0, near, "neither").any()),
            textcoords="offset points",
            color=colour,
            va="center",
            size=9.5,
        )
    axes.set_xlim(0, _LARGEST_TEAM + 0.5)
    axes.set_ylim(0)
    axes.set_xticks([1, *range(5, _LARGEST_TEAM + 1, 5)])
    axes.set_xlabel(ROBOTS_LABEL)
    axes.tick_params(colors=FAINT)


FIGURE = Figure("2", "Search space against team size", (), _tabulate, _draw)
