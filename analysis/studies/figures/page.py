"""The page of a picture: its title, what it shows, and a warning where runs are missing."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from teamsight.analysis.plot.style import FAINT, INK, canvas
from teamsight.analysis.studies.figures.cells import Cells
from teamsight.analysis.studies.figures.quantity import Quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

_WARNING = "#b02a30"
_NARROWEST = 6.4
# Inches: the margins, and a line of the title and of the rest.
_MARGIN, _TITLE, _LINE = 0.3, 0.3, 0.2
_TITLE_SIZE, _SIZE = 14.0, 9.5
# Mean width of a character in its size.
_CHARACTER, _BOLD = 0.54, 0.6


class Picture(NamedTuple):
    """What is drawn, and what is written above it.

    Attributes
    ----------
    cells : Cells
        The settings with their statistics, in the unit of the quantity.
    quantity : Quantity
        The measure.
    source : str
        The study and its conditions.
    warning : str
        What is missing; empty if nothing is.
    """

    cells: Cells
    quantity: Quantity
    source: str
    warning: str


def page(picture: Picture, title: str, notes: Sequence[str], width: float, height: float) -> Canvas:
    """Return a figure with its head, and with free room below it that is laid out automatically.

    Parameters
    ----------
    picture : Picture
        What is drawn.
    title : str
        The title.
    notes : sequence of str
        How the picture is read; empty ones are left out.
    width, height : float
        Size of the room [inches].
    """
    width = max(width, _NARROWEST)
    room = width - 2 * _MARGIN
    lines = [(line, _TITLE_SIZE, INK) for line in _wrapped(title, room, _TITLE_SIZE * _BOLD)]
    lines += [(line, _SIZE, _WARNING) for line in _wrapped(picture.warning, room, _SIZE * _BOLD)]
    faint = [" · ".join((picture.source, *picture.cells.fixed)), "; ".join(note for note in notes if note)]
    lines += [(line, _SIZE, FAINT) for text in faint for line in _wrapped(text, room, _SIZE * _CHARACTER)]
    head = _MARGIN + sum(_TITLE if size == _TITLE_SIZE else _LINE for _, size, _ in lines) + 0.08
    total = head + height
    figure = canvas(width, total)
    figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, height / total), w_pad=0.08, h_pad=0.08)
    top = 0.6 * _MARGIN
    for text, size, colour in lines:
        top += _TITLE if size == _TITLE_SIZE else _LINE
        weight = "normal" if colour == FAINT else "bold"
        figure.text(_MARGIN / width, 1 - top / total, text, size=size, color=colour, weight=weight)
    return figure


def runs_of(cells: Cells, what: str) -> str:
    """Return how many runs each cell has, as in "10 runs a cell"."""
    n = cells.statistics["n"].to_numpy()
    if not len(n) or not n.max():
        return "no run has a value" if len(cells.values) else "no runs yet"
    least, most = int(n.min()), int(n.max())
    number = f"{most:,}" if least == most else f"{least:,} to {most:,}"
    return f"{number} {'run' if least == most == 1 else 'runs'} {what}"


def _wrapped(text: str, room: float, character: float) -> list[str]:
    """Return lines of a text that fit into some inches; `character` is the mean width of one [points]."""
    return textwrap.wrap(text, max(20, int(room * 72 / character)))
