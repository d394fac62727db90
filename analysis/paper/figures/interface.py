"""The interface of figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Tables: TypeAlias = Mapping[str, pd.DataFrame]


class Conditions(NamedTuple):
    """What all runs of a figure have in common.

    Attributes
    ----------
    name : str
        Name of the setting: "defaults" or a preset.
    setting : mapping
        Keyword parameters of CMOMMT.
    root : int
        Root seed.
    runs, steps : int
        Runs of each cell, and steps of each run.
    """

    name: str
    setting: Mapping[str, Any]
    root: int
    runs: int
    steps: int

    def line(self) -> str:
        """Return the conditions on one line, for the subtitle."""
        return f"{self.runs} runs of {self.steps} steps, setting {self.name}, seed {self.root}"


@dataclass(frozen=True)
class Figure:
    """A figure: the experiments that it reads, and how their tables become its tables and its drawing.

    Parameters
    ----------
    name : str
        Its name on the command line, such as "4".
    title : str
        What it shows, on one line.
    needs : tuple of str
        Names of the experiments whose tables it reads.
    tabulate : callable
        Takes the tables of the experiments and the conditions, and returns the figure's tidy tables by the suffix of
        their file names. The table "" holds every run; the others are computed from it.
    draw : callable
        Takes the figure's tables and the conditions, and returns the drawing.
    summarise : callable, optional
        Takes the figure's tables by suffix, except that of all runs, and returns the result in one line, for the
        terminal.
    """

    name: str
    title: str
    needs: tuple[str, ...]
    tabulate: Callable[[Tables, Conditions], dict[str, pd.DataFrame]]
    draw: Callable[[Tables, Conditions], Canvas]
    summarise: Callable[[Tables], str] | None = None


class Drawn(NamedTuple):
    """The tables of a figure by suffix, and its drawing by format."""

    name: str
    tables: dict[str, pd.DataFrame]
    pictures: dict[str, bytes]
