"""What a figure is: the experiments that it reads, the tables that it makes of them, and the drawing of those."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Tables: TypeAlias = Mapping[str, pd.DataFrame]


class Conditions(NamedTuple):
    """What holds for all runs of a figure."""

    #: "defaults" or the name of a preset.
    name: str
    #: Keyword parameters of CMOMMT.
    setting: Mapping[str, Any]
    root: int
    runs: int
    steps: int

    def line(self) -> str:
        """Return the conditions on one line, to stand under a title."""
        return f"{self.runs} runs of {self.steps} steps, setting {self.name}, seed {self.root}"


@dataclass(frozen=True)
class Figure:
    """A figure of the paper, or one that it lacks.

    Parameters
    ----------
    name : str
        What the command line calls it, such as "4".
    title : str
        What it shows, on one line.
    needs : tuple of str
        Experiments whose tables it reads.
    tabulate : callable
        Takes the tables of the experiments and the conditions, and returns the figure's tidy tables: the first holds
        every run, further ones what was computed of them; each is stored under its key, a suffix of the file's name.
    draw : callable
        Takes the figure's tables and the conditions and returns the drawing.
    tell : callable, optional
        Takes the table `cells` and returns in one line what the figure comes to, to be read beside it.
    """

    name: str
    title: str
    needs: tuple[str, ...]
    tabulate: Callable[[Tables, Conditions], dict[str, pd.DataFrame]]
    draw: Callable[[Tables, Conditions], Canvas]
    tell: Callable[[pd.DataFrame], str] | None = None


class Drawn(NamedTuple):
    """A figure ready to be stored."""

    name: str
    tables: dict[str, pd.DataFrame]
    png: bytes
