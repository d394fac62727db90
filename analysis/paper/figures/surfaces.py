"""Figs. 4 to 8, 10 and 11: a quantity, or a paired difference, of each team size in each arena."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import FAINT, canvas, head, signed
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import CELL, cell_means, grid_of, includes_zero, maxima, paired, percent

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

# Letters in a line of a caption, which stands above a surface, beside the heat map.
_CAPTION = 84
_CHANCE = 0.025


class _Quantity(NamedTuple):
    """A quantity of each cell: how a table of runs gives it, under which conditions, and its axis from 0 to `high`."""

    name: str
    grid_of_runs: Callable[[pd.DataFrame], pd.DataFrame]
    statistic: str
    conditions: str
    label: str
    high: float | None = None  # all teammates of the largest team: Figs. 4 and 5 have one scale, even if drawn alone


_NEIGHBOURS = _Quantity(
    "Largest number of neighbours", maxima, "maximum", "awareness range 1", "largest number of neighbours  [robots]"
)
_OBSERVED = _Quantity(
    "Observed targets", percent, "mean", "15 targets, sensing range 1", "observed targets  [%]", high=100
)


def _level_figure(name: str, quantity: _Quantity, experiment: str, policy: str) -> Figure:
    """Return the figure of a quantity under one policy."""
    title = f"{quantity.name}: {policy}"

    def draw(tables: Tables, conditions: Conditions) -> Canvas:
        grid = quantity.grid_of_runs(tables[""])
        robots, radius = grid.index, grid.columns
        figure = canvas(WIDTH, HEIGHT + HEAD)
        head(
            figure,
            f"Fig. {name}   {title}",
            f"{quantity.statistic} over {conditions.line()}; {quantity.conditions}; "
            f"N = {robots.min()}..{robots.max()}, R = {radius.min():g}..{radius.max():g}",
        )
        high = quantity.high or max(1, robots.max() - 1)
        draw_row(figure, grid, Look(quantity.label, "{:.0f}".format, 0, high))
        return figure

    return Figure(name, title, (experiment,), lambda tables, conditions: {"": tables[experiment]}, draw)


class _Contrast(NamedTuple):
    """A difference, treated − base, of two experiments; its value in the column `variant`; text above its surface."""

    treated: str
    base: str
    variant: str
    caption: str


def _difference_figure(
    name: str,
    title: str,
    *contrasts: _Contrast,
    own_colours: bool = False,
    summarise: Callable[[pd.DataFrame], str] | None = None,
) -> Figure:
    """Return a figure of paired differences in percentage points, one row for each contrast, all of one height.

    With `own_colours` each row has its own colour scale, so that small differences stay visible beside large ones.
    """

    def tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
        parts = [paired(tables[one.treated], tables[one.base]).assign(variant=one.variant) for one in contrasts]
        runs = pd.concat(parts, ignore_index=True)
        return {"": runs, "cells": cell_means(runs, "difference", ("variant", *CELL))}

    def draw(tables: Tables, conditions: Conditions) -> Canvas:
        cells = tables["cells"]
        figure = canvas(WIDTH, HEIGHT * len(contrasts) + HEAD)
        head(
            figure,
            f"Fig. {name}   {title}",
            f"paired on common noise, mean over {conditions.line()}; "
            "in brackets: the 95 % confidence interval includes 0",
        )
        # Most differences have one sign: cut the axis where no cell reaches.
        heights = (min(0.0, 10.0 * np.floor(cells["mean"].min() * 10 + 0.05)), _limit(cells))
        for row, contrast in enumerate(contrasts):
            of = cells[cells["variant"] == contrast.variant]
            limit = _limit(of if own_colours else cells)
            look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, True, heights)
            draw_row(figure, grid_of(of) * 100, look, row=row, open_cells=includes_zero(of))
            _caption(figure, contrast.caption, row)
        return figure

    needs = tuple(dict.fromkeys(name for contrast in contrasts for name in (contrast.treated, contrast.base)))
    return Figure(name, title, needs, tabulate, draw, summarise)


def _limit(cells: pd.DataFrame) -> float:
    """Return the smallest multiple of ten percentage points that no cell exceeds."""
    return float(10.0 * np.ceil(cells["mean"].abs().max() * 10 + 1e-9))


def _caption(figure: Canvas, text: str, row: int) -> None:
    total = figure.get_figheight()
    lines = textwrap.fill(text, _CAPTION, break_long_words=False, break_on_hyphens=False)
    figure.text(0.03, 1 - (HEAD + row * HEIGHT + 0.12) / total, lines, size=11, color=FAINT, va="top", linespacing=1.4)


def _learned_in_words(cells: pd.DataFrame) -> str:
    """Return Fig. 11 in one line, and a pointer: another exploration gives another surface."""
    of = cells[cells["variant"] == "learned"]
    most = of.nlargest(1, "mean").iloc[0]
    text = (
        f"gain from awareness of the learned policies: {100 * of['mean'].mean():+.1f} pp on average over {len(of)} "
        f"cells, at most {100 * most['mean']:+.1f} at N = {most['robots']:.0f}, R = {most['radius']:g}; "
    )
    if np.isfinite(of["low"]).all():
        text += (
            f"significantly positive in {(of['low'] > 0).sum()} cells, negative in {(of['high'] < 0).sum()} (expected "
            f"by chance: about {_CHANCE * len(of):.0f} each)"
        )
    else:
        text += "one run per cell gives no confidence intervals"
    return f"{text}; see docs/learning.md"


FIGURE_4 = _level_figure("4", _NEIGHBOURS, "random-walk", "random walk")
FIGURE_5 = _level_figure("5", _NEIGHBOURS, "a-cmommt", "A-CMOMMT")
FIGURE_6 = _level_figure("6", _OBSERVED, "centroid", "centroid of the sensed targets, no awareness")
FIGURE_7 = _level_figure("7", _OBSERVED, "a-cmommt", "A-CMOMMT, pairwise awareness")
FIGURE_8 = _difference_figure(
    "8",
    "Gain by awareness: A-CMOMMT − centroid",
    _Contrast("a-cmommt", "centroid", "a-cmommt - centroid", "Fig. 7 − Fig. 6"),
)
FIGURE_10 = _difference_figure(
    "10",
    "Gain by an awareness range of 1 instead of 0.5: A-CMOMMT",
    _Contrast(
        "a-cmommt",
        "half-range",
        "repulsion scaled with sensing range",
        "repulsion scaled with the sensing range (d1, d2 = 0.481, 0.769)",
    ),
    _Contrast(
        "a-cmommt",
        "half-range-scaled",
        "repulsion scaled with awareness range",
        "repulsion scaled with the awareness range (half of that at 0.5)",
    ),
)
FIGURE_11 = _difference_figure(
    "11",
    "Gain by awareness in lazy Q-learning: 32 inputs − 16 inputs, with Fig. 8 for comparison",
    _Contrast(
        "lazy-cooperative",
        "lazy-collective",
        "learned",
        "lazy Q-learning from one memory of 600 transitions: with teammates − without; this row has its own "
        "colour scale; another memory gives another surface (docs/learning.md)",
    ),
    _Contrast("a-cmommt", "centroid", "designed", "designed (Fig. 8): A-CMOMMT − centroid"),
    own_colours=True,
    summarise=_learned_in_words,
)
