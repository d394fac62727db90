"""Every figure by the name that the command line knows it by."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from teamsight.analysis.paper.figures import arena, delta, repulsion, search_space
from teamsight.analysis.paper.figures.differences import Contrast, difference_figure, tell_gain
from teamsight.analysis.paper.figures.interface import Conditions, Drawn, Figure, Tables
from teamsight.analysis.paper.figures.levels import neighbours_figure, observed_figure
from teamsight.analysis.plot.style import to_png


def _tell_learned(cells: pd.DataFrame) -> str:
    """Return what Fig. 11 comes to: the colours do not tell, and the paper's surface is another."""
    return f"awareness adds to what is learned {tell_gain(cells, 'learned')}; other explorations: docs/lazy-search.md"


_FIGURES: tuple[Figure, ...] = (
    search_space.FIGURE,
    arena.FIGURE,
    neighbours_figure("4", "random-walk", "random walk"),
    neighbours_figure("5", "a-cmommt", "A-CMOMMT"),
    observed_figure("6", "centroid", "centroid of the sensed targets, no awareness"),
    observed_figure("7", "a-cmommt", "A-CMOMMT, pairwise awareness"),
    difference_figure(
        "8",
        "Gain by awareness: A-CMOMMT less centroid",
        (Contrast("a-cmommt", "centroid", "a-cmommt - centroid", "Fig. 7 less Fig. 6"),),
    ),
    repulsion.FIGURE,
    difference_figure(
        "10",
        "Gain by an awareness range of 1 instead of 0.5: A-CMOMMT",
        (
            Contrast(
                "a-cmommt",
                "half-range",
                "repulsion scaled with sensing range",
                "repulsion scaled with the sensing range (d1, d2 = 0.481, 0.769)",
            ),
            Contrast(
                "a-cmommt",
                "half-range-scaled",
                "repulsion scaled with awareness range",
                "repulsion scaled with the awareness range (half of that at 0.5)",
            ),
        ),
    ),
    difference_figure(
        "11",
        "Gain by awareness, learned: lazy Q-learning with 32 inputs less with 16, and Fig. 8 beside it",
        (
            Contrast(
                "lazy-cooperative",
                "lazy-collective",
                "learned",
                "lazily learned from one memory of 600 pairs: targets and teammates less targets alone; its colours "
                "have their own scale; another memory, another surface (docs/lazy-search.md)",
            ),
            Contrast("a-cmommt", "centroid", "designed", "designed (Fig. 8): A-CMOMMT less centroid"),
        ),
        own_colours=True,
        tell=_tell_learned,
    ),
    delta.FIGURE,
)

#: Every figure by name, in the order of the paper.
FIGURES: dict[str, Figure] = {figure.name: figure for figure in _FIGURES}


class Job(NamedTuple):
    """A figure to be made of tables that are at hand."""

    name: str
    tables: Tables
    conditions: Conditions


def make(job: Job) -> Drawn:
    """Return the figure's tables and its drawing."""
    figure = FIGURES[job.name]
    tables = figure.tabulate(job.tables, job.conditions)
    drawing = figure.draw(tables, job.conditions)
    return Drawn(job.name, tables, to_png(drawing, f"{figure.title}; {job.conditions.line()}"))
