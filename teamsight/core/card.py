"""Cards: how objects look in a notebook. Plain HTML without scripts, styles of its own or outside resources."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import ParamSpec

P = ParamSpec("P")

# Lines in a colour between black and white, and text in the notebook's colour, are readable on light and dark pages.
_BOX = "display:inline-block;border:1px solid #8888;border-radius:4px;padding:6px 10px;vertical-align:top"
_CELL = "text-align:left;padding:1px 8px 1px 0;background:none"
# Longer texts are cut, such as the description of an object of the user's.
_LONGEST = 200


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
