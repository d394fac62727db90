"""Text for terminals and logs: tables in which no cell is cut, and lines that are broken between words."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import NamedTuple

# Between two columns.
_GAP = "  "
# A column of texts becomes no narrower than this.
_NARROWEST = 12
# What is copied from the screen stays in one line: a command or an address.
_COPIED = re.compile(r"\b(teamsight|pip install) [-a-z'\[].*")


class TextTable(NamedTuple):
    """A table as lines.

    Attributes
    ----------
    head, body : list of str
        Its lines, without blanks at their ends; the head is empty without headings.
    left_out : list of str
        The headings of the columns that there is no room for.
    """

    head: list[str]
    body: list[str]
    left_out: list[str]


def text_table(
    rows: Iterable[Sequence[str]],
    headings: Sequence[str] = (),
    left: Iterable[int] = (0,),
    spare: Iterable[int] = (),
    width: float = float("inf"),
) -> TextTable:
    """Return a table as lines.

    Where it is too wide, first headings are broken between words, then the columns of `spare` are left out one after
    the other, then texts are broken. Numbers are neither broken nor cut: they would be read as others. So the lines may
    be wider in the end.

    Parameters
    ----------
    rows : iterable of sequence of str
        The cells.
    headings : sequence of str
        The headings of all columns; none by default.
    left : iterable of int
        The columns of texts, which begin at the left; numbers end at the right.
    spare : iterable of int
        The columns that can be left out, the first one first.
    width : float
        How many characters fit in a line.
    """
    cells, texts = [list(row) for row in rows], set(left)
    places = list(range(len(headings or cells[0])))
    titles = list(headings) or [""] * len(places)
    natural = {one: max(map(cell_width, (titles[one], *(row[one] for row in cells)))) for one in places}
    # As wide as the cells and the words of the heading need.
    tight = {one: max(map(cell_width, (*titles[one].split(), *(row[one] for row in cells)))) for one in places}
    left_out = []
    for one in spare:
        if _total(tight) > width:
            del tight[one]
            left_out.append(titles[one])
    if left_out:
        # Nothing is left to say of what stands in such a row.
        cells = [row for row in cells if any(row[one] for one in tight.keys() - texts)]
    wide = {one: natural[one] for one in tight}
    words = {one: max(cell_width(word) for row in cells for word in row[one].split() or [""]) for one in texts}
    # Texts are broken within words only if that between them is not enough.
    for least in (tight, tight | words, tight | dict.fromkeys(texts, _NARROWEST)):
        room = {one: wide[one] - least[one] for one in wide}
        while _total(wide) > width and max(room.values()) > 0:
            widest = max(room, key=room.__getitem__)
            wide[widest] -= 1
            room[widest] -= 1
    head = _lines([titles[one] for one in wide], wide, texts, at_top=False) if headings else []
    body = [line for row in cells for line in _lines([row[one] for one in wide], wide, texts)]
    return TextTable(head, body, left_out)


def _total(wide: dict[int, int]) -> int:
    return sum(wide.values()) + len(_GAP) * (len(wide) - 1)


def _lines(cells: Sequence[str], wide: dict[int, int], texts: set[int], *, at_top: bool = True) -> list[str]:
    """Return the lines of a row; a cell that is broken has several, from the top or the bottom on."""
    broken = [
        [cell] if cell_width(cell) <= width else wrap(cell, width, break_on_hyphens=False)
        for cell, width in zip(cells, wide.values(), strict=True)
    ]
    high, lines = max(map(len, broken)), []
    for number in range(high):
        line = []
        for parts, (place, width) in zip(broken, wide.items(), strict=True):
            row = number if at_top else number - high + len(parts)
            part = parts[row] if 0 <= row < len(parts) else ""
            blank = " " * (width - cell_width(part))
            line.append(part + blank if place in texts else blank + part)
        lines.append(_GAP.join(line).rstrip())
    return lines


def cell_width(text: str) -> int:
    """Return how many cells of a terminal a text takes: two for Chinese, Japanese and Korean, none for accents."""
    if text.isascii():
        return len(text)
    return sum(0 if unicodedata.combining(one) else 1 + (unicodedata.east_asian_width(one) in "WF") for one in text)


def broken_lines(text: str, width: int) -> str:
    """Return a text with lines of at most this width, broken between words; words and commands stay whole."""
    bound = _COPIED.sub(lambda found: found[0].replace(" ", "\0"), text)
    return "\n".join(wrap(bound, width, break_long_words=False, break_on_hyphens=False)).replace("\0", " ")
