"""Figs. 8, 10 and 11: what awareness, and a longer awareness range, add to the share of observed targets."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import FAINT, canvas, head
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import CELL, cell_means, grid_of, paired

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


# How many letters of a caption stand above a surface, beside the heat map.
_CAPTION = 84
_CHANCE = 0.025


class Contrast(NamedTuple):
    """Two experiments whose difference is drawn."""

    treated: str
    base: str
    #: Value of the column `variant`, where a figure shows several.
    variant: str
    caption: str


def difference_figure(
    name: str,
    title: str,
    contrasts: tuple[Contrast, ...],
    *,
    own_colours: bool = False,
    tell: Callable[[pd.DataFrame], str] | None = None,
) -> Figure:
    """Return a figure of paired differences in percentage points, one row for each contrast.

    All surfaces have one height; with `own_colours` each row has its own colours, so that the small can be seen beside
    the large.
    """

    def tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
        runs = pd.concat(
            [
                paired(tables[contrast.treated], tables[contrast.base]).assign(variant=contrast.variant)
                for contrast in contrasts
            ],
            ignore_index=True,
        )
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
        # Differences are mostly of one sign: leave out what no cell reaches of the other.
        heights = (min(0.0, 10.0 * np.floor(cells["mean"].min() * 10 + 0.05)), _limit(cells))
        for row, contrast in enumerate(contrasts):
            of = cells[cells["variant"] == contrast.variant]
            limit = _limit(of if own_colours else cells)
            look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, True, heights)
            unsure = grid_of(of.assign(open=(of["low"] <= 0) & (of["high"] >= 0)), "open")
            draw_row(figure, grid_of(of) * 100, look, row=row, rows=len(contrasts), open_cells=unsure)
            _caption(figure, contrast.caption, row, len(contrasts))
        return figure

    needs = tuple(dict.fromkeys(name for contrast in contrasts for name in (contrast.treated, contrast.base)))
    return Figure(name, title, needs, tabulate, draw, tell)


def _limit(cells: pd.DataFrame) -> float:
    """Return the next ten percentage points beyond all cells."""
    return float(10.0 * np.ceil(cells["mean"].abs().max() * 10 + 1e-9))


def _caption(figure: Canvas, text: str, row: int, rows: int) -> None:
    total = rows * HEIGHT + HEAD
    lines = textwrap.fill(text, _CAPTION, break_long_words=False, break_on_hyphens=False)
    figure.text(0.03, ((rows - row) * HEIGHT - 0.12) / total, lines, size=11, color=FAINT, va="top", linespacing=1.4)


def tell_gain(cells: pd.DataFrame, variant: str) -> str:
    """Return in one line what a contrast comes to.

    Parameters
    ----------
    cells : DataFrame
        The figure's table of cells.
    variant : str
        Of which contrast.

    Returns
    -------
    str
        The mean over the cells, the largest and where, and how many cells are clearly above and clearly below 0: those
        whose 95 % interval does not include it.
    """
    of = cells[cells["variant"] == variant]
    most = of.iloc[int(np.argmax(of["mean"].to_numpy()))]
    told = (
        f"{100 * of['mean'].mean():+.1f} pp on the mean of {len(of)} cells, at most {100 * most['mean']:+.1f} at "
        f"N = {most['robots']:.0f}, R = {most['radius']:g}"
    )
    if not np.isfinite(of["low"]).all():
        return f"{told}; one run a cell does not tell what of it is chance"
    more, less = int((of["low"] > 0).sum()), int((of["high"] < 0).sum())
    return f"{told}; clearly more in {more}, clearly less in {less} (by chance about {_CHANCE * len(of):.0f} each)"


def signed(value: float) -> str:
    """Write without decimals; a whisker around nothing is 0, without a sign."""
    rounded = round(value)
    return f"{rounded:+d}".replace("-", "−") if rounded else "0"
