"""Figs. 8 and 10: a paired difference of each team size in each arena."""

from __future__ import annotations

import textwrap
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


class _Contrast(NamedTuple):
    """A difference, treated − base, of two experiments; its value in the column `variant`; text above its surface."""

    treated: str
    base: str
    variant: str
    caption: str


def _difference_figure(name: str, title: str, *contrasts: _Contrast) -> Figure:
    """Return a figure of paired differences in percentage points, one row for each contrast, all on one scale."""

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
        limit = _limit(cells)
        heights = (min(0.0, 10.0 * np.floor(cells["mean"].min() * 10 + 0.05)), limit)
        for row, contrast in enumerate(contrasts):
            of = cells[cells["variant"] == contrast.variant]
            look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, True, heights)
            draw_row(figure, grid_of(of) * 100, look, row=row, open_cells=includes_zero(of))
            caption(figure, contrast.caption, row)
        return figure

    needs = tuple(dict.fromkeys(name for contrast in contrasts for name in (contrast.treated, contrast.base)))
    return Figure(name, title, needs, tabulate, draw)


def _limit(cells: pd.DataFrame) -> float:
    """Return the smallest multiple of ten percentage points that no cell exceeds."""
    return float(10.0 * np.ceil(cells["mean"].abs().max() * 10 + 1e-9))


def caption(figure: Canvas, text: str, row: int) -> None:
    """Write a text above the surface of a row."""
    total = figure.get_figheight()
    lines = textwrap.fill(text, _CAPTION, break_long_words=False, break_on_hyphens=False)
    figure.text(0.03, 1 - (HEAD + row * HEIGHT + 0.12) / total, lines, size=11, color=FAINT, va="top", linespacing=1.4)


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
