"""Figures of paired differences: one experiment less another, cell by cell."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import FAINT, canvas, head, signed
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import CELL, cell_means, grid_of, includes_zero, paired

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

# Letters in a line of a caption, which stands above a surface, beside the heat map.
_CAPTION = 84
_CHANCE = 0.025


class Contrast(NamedTuple):
    """Two experiments whose difference is drawn.

    Attributes
    ----------
    treated, base : str
        Names of the experiments; `base` is subtracted.
    variant : str
        Value of the column `variant`, which identifies the contrast in the tables.
    caption : str
        Text above the surface.
    """

    treated: str
    base: str
    variant: str
    caption: str


def difference_figure(
    name: str,
    title: str,
    contrasts: tuple[Contrast, ...],
    *,
    own_colours: bool = False,
    summarise: Callable[[pd.DataFrame], str] | None = None,
) -> Figure:
    """Return a figure of paired differences in percentage points, one row for each contrast.

    Parameters
    ----------
    name, title : str
        See `Figure`.
    contrasts : tuple of Contrast
        The rows, from the top. All surfaces have the same height.
    own_colours : bool
        Give each row its own colour scale, so that small differences stay visible beside large ones.
    summarise : callable, optional
        See `Figure`.
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
        # Most differences have one sign: cut the axis where no cell reaches.
        heights = (min(0.0, 10.0 * np.floor(cells["mean"].min() * 10 + 0.05)), _limit(cells))
        for row, contrast in enumerate(contrasts):
            of = cells[cells["variant"] == contrast.variant]
            limit = _limit(of if own_colours else cells)
            look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, True, heights)
            draw_row(figure, grid_of(of) * 100, look, row=row, rows=len(contrasts), open_cells=includes_zero(of))
            _caption(figure, contrast.caption, row, len(contrasts))
        return figure

    needs = tuple(dict.fromkeys(name for contrast in contrasts for name in (contrast.treated, contrast.base)))
    return Figure(name, title, needs, tabulate, draw, summarise)


def _limit(cells: pd.DataFrame) -> float:
    """Return the smallest multiple of ten percentage points that no cell exceeds."""
    return float(10.0 * np.ceil(cells["mean"].abs().max() * 10 + 1e-9))


def _caption(figure: Canvas, text: str, row: int, rows: int) -> None:
    total = rows * HEIGHT + HEAD
    lines = textwrap.fill(text, _CAPTION, break_long_words=False, break_on_hyphens=False)
    figure.text(0.03, ((rows - row) * HEIGHT - 0.12) / total, lines, size=11, color=FAINT, va="top", linespacing=1.4)


def gain_in_words(cells: pd.DataFrame, variant: str) -> str:
    """Return one contrast in one line.

    Parameters
    ----------
    cells : DataFrame
        The figure's table of cells.
    variant : str
        Which contrast.

    Returns
    -------
    str
        The mean over the cells, the largest gain and its cell, and the numbers of cells significantly above and below
        0, whose 95 % interval excludes 0.
    """
    of = cells[cells["variant"] == variant]
    most = of.iloc[int(np.argmax(of["mean"].to_numpy()))]
    text = (
        f"{100 * of['mean'].mean():+.1f} pp on average over {len(of)} cells, at most {100 * most['mean']:+.1f} at "
        f"N = {most['robots']:.0f}, R = {most['radius']:g}"
    )
    if not np.isfinite(of["low"]).all():
        return f"{text}; one run per cell gives no confidence intervals"
    more, less = int((of["low"] > 0).sum()), int((of["high"] < 0).sum())
    return (
        f"{text}; significantly positive in {more} cells, negative in {less} (expected by chance: about "
        f"{_CHANCE * len(of):.0f} each)"
    )
