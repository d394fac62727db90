"""Cards: how objects look in a notebook. Plain HTML without scripts, styles of its own or outside resources."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from html import escape
from typing import ParamSpec

P = ParamSpec("P")

# Lines in a colour between black and white, and text in the notebook's colour, are readable on light and dark pages.
_BOX = "display:inline-block;border:1px solid #8888;border-radius:4px;padding:6px 10px;vertical-align:top"
_CELL = "text-align:left;padding:1px 8px 1px 0;background:none"
#: The colours of groups by number, then again from the first; pages move them until they stand out.
COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#bcbd22")
#: The corners of an arrow, ahead and to its left, in radii of a dot, as in view.js.
ARROW = ((1.5, 0.0), (-1.1, 1.0), (-0.5, 0.0), (-1.1, -1.0))
# What is drawn stands out from a white page and from a dark one (VS Code's is the lighter) by as much as icons must.
_LIGHT, _DARK, _CONTRAST = 1.0, 0.013, 3.0
# Longer texts are cut, such as the description of an object of the user's.
_LONGEST = 200


@cache
def legible(colour: str) -> str:
    """Return a colour like "#1f77b4", moved toward black or white until it stands out from light and dark pages."""
    rgb = [int(colour[place : place + 2], 16) for place in (1, 3, 5)]
    while (_LIGHT + 0.05) / (luminance(rgb) + 0.05) < _CONTRAST:
        rgb = [round(0.97 * part) for part in rgb]
    while (luminance(rgb) + 0.05) / (_DARK + 0.05) < _CONTRAST:
        rgb = [255 - round(0.97 * (255 - part)) for part in rgb]
    return "#" + "".join(f"{part:02x}" for part in rgb)


def luminance(rgb: Sequence[int]) -> float:
    """Return the relative luminance of a colour, from 0 to 1, as WCAG 2 defines it."""
    linear = [part / 3294.6 if part <= 10 else ((part / 255 + 0.055) / 1.055) ** 2.4 for part in rgb]
    return sum(share * part for share, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def legend(entries: Iterable[tuple[str, str, str]]) -> str:
    """Return the line below a picture as HTML: marks, their colours (may be empty), and what they mean."""
    parts = (
        f'<span style="color:{colour or "inherit"}">{mark}</span> {_text(name)}' for mark, colour, name in entries
    )
    return f'<small style="display:block">{" &#160; ".join(parts)}</small>'


def card(title: str, rows: Iterable[tuple[str, object]], *parts: str) -> str:
    """Return a card as HTML.

    Parameters
    ----------
    title : str
        Its first line.
    rows : iterable of (str, object)
        Names and values, which are shown as by `str`.
    *parts : str
        HTML that follows, such as a `table` or a picture.
    """
    lines = [[name, str(value)] for name, value in rows]
    body = table((), lines) if lines else ""
    return f'<div style="{_BOX}"><b>{_text(title)}</b>{body}{"".join(parts)}</div>'


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as HTML; all texts are escaped."""
    first = _row("th", header) if header else ""
    return f'<table style="border:none;margin:2px 0">{first}{"".join(_row("td", row) for row in rows)}</table>'


def shown(make: Callable[P, str], *arguments: P.args, **named: P.kwargs) -> str | None:
    """Return the HTML that a function makes; None, and so the object's `repr`, if that fails."""
    try:
        return make(*arguments, **named)
    except Exception:  # what is displayed may be half built, or use a component of the user's that fails
        return None


def _row(tag: str, cells: Sequence[str]) -> str:
    joined = "".join(f'<{tag} style="{_CELL}">{_text(cell)}</{tag}>' for cell in cells)
    return f'<tr style="background:none">{joined}</tr>'


def _text(text: str) -> str:
    return escape(text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…")
