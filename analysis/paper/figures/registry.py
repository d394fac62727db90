"""Every figure by the name that the command line uses."""

from __future__ import annotations

from typing import NamedTuple

from teamsight.analysis.paper.figures import arena, delta, learned, levels, repulsion, search_space, surfaces
from teamsight.analysis.paper.figures.interface import Conditions, Drawn, Figure, Tables
from teamsight.analysis.plot.style import to_picture

#: Every figure, in the order of the paper.
FIGURES: dict[str, Figure] = {
    "2": search_space.FIGURE,
    "3": arena.FIGURE,
    "4": levels.FIGURE_4,
    "5": levels.FIGURE_5,
    "6": levels.FIGURE_6,
    "7": levels.FIGURE_7,
    "8": surfaces.FIGURE_8,
    "9": repulsion.FIGURE,
    "10": surfaces.FIGURE_10,
    "11": learned.FIGURE,
    "delta": delta.FIGURE,
}


class Job(NamedTuple):
    """A figure to draw, with the tables of the experiments that it reads, and the formats of its picture."""

    name: str
    tables: Tables
    conditions: Conditions
    formats: tuple[str, ...] = ("png",)


def make(job: Job) -> Drawn:
    """Return the tables of a figure and its pictures."""
    figure = FIGURES[job.name]
    tables = figure.tabulate(job.tables, job.conditions)
    drawing = figure.draw(tables, job.conditions)
    description = f"{figure.title}; {job.conditions.line()}"
    return Drawn(job.name, tables, {kind: to_picture(drawing, description, kind) for kind in job.formats})
