"""Figs. 8 and 10: what awareness, and a longer awareness range, add to the share of observed targets."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.figures.style import FAINT, canvas, head
from teamsight.analysis.figures.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.observation import CELL, cell_means, grid_of, paired

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


class Contrast(NamedTuple):
    """Two experiments whose difference is drawn."""

    treated: str
    base: str
    #: Value of the column `variant`, where a figure shows several.
    variant: str
    caption: str


def difference_figure(name: str, title: str, contrasts: tuple[Contrast, ...]) -> Figure:
    """Return a figure of paired differences in percentage points, one row for each contrast."""

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
        limit = 10.0 * np.ceil(cells["mean"].abs().max() * 10 + 1e-9)
        look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, around_zero=True)
        for row, contrast in enumerate(contrasts):
            of = cells[cells["variant"] == contrast.variant]
            unsure = grid_of(of.assign(open=(of["low"] <= 0) & (of["high"] >= 0)), "open")
            draw_row(figure, grid_of(of) * 100, look, row=row, rows=len(contrasts), open_cells=unsure)
            _caption(figure, contrast.caption, row, len(contrasts))
        return figure

    needs = tuple(dict.fromkeys(name for contrast in contrasts for name in (contrast.treated, contrast.base)))
    return Figure(name, title, needs, tabulate, draw)


def _caption(figure: Canvas, text: str, row: int, rows: int) -> None:
    total = rows * HEIGHT + HEAD
    figure.text(0.03, ((rows - row) * HEIGHT - 0.3) / total, text, size=11, color=FAINT)


def signed(value: float) -> str:
    """Write without decimals; a whisker around nothing is 0, without a sign."""
    rounded = round(value)
    return f"{rounded:+d}".replace("-", "−") if rounded else "0"
