"""Markdown pages: wrapped paragraphs and lists, and tables."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence

#: Characters in a line of a page.
WIDTH = 120
# Beginnings of lines that are not prose.
_UNWRAPPED = ("|", "#", "<", "    ", "```")
_ITEM = re.compile(r"(\s*)(- |\d+\. )")


def page(*parts: str) -> str:
    """Return the parts of a page, separated by empty lines, with lines of at most `WIDTH` characters.

    Parameters
    ----------
    *parts : str
        Headings, paragraphs, lists and tables, in Markdown. Lists have one item a line; tables, headings and blocks of
        code are left as they are.
    """
    return "\n\n".join(wrapped(part) for part in parts if part) + "\n"


def wrapped(text: str) -> str:
    """Return Markdown with long lines wrapped; each is a paragraph, a list item, a heading or the row of a table."""
    lines, code = [], False
    for line in text.split("\n"):
        code ^= line.startswith("```")
        lines.append(line if code or line.startswith(_UNWRAPPED) else _wrapped_line(line))
    return "\n".join(lines)


def _wrapped_line(line: str) -> str:
    item = _ITEM.match(line)
    # The space before a dash or a number stays in its line: at the start of the next it would begin a list.
    bound = re.sub(r" (?=([-+*#]|\d+\.) )", "\0", line)
    indent = " " * item.end() if item else ""
    lines = textwrap.wrap(bound, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace("\0", " ")


def table(columns: Sequence[str], rows: Iterable[Sequence[str]], *, align: str = "") -> str:
    """Return a table.

    Parameters
    ----------
    columns : sequence of str
        Titles of the columns.
    rows : iterable of sequence of str
        One text for each column.
    align : str
        One letter for each column, "l" or "r"; columns without a letter are aligned as Markdown does.
    """
    marks = {"l": ":---", "r": "---:"}
    rule = [marks.get(align[number : number + 1], "---") for number in range(len(columns))]
    lines = ((cell.replace("|", "\\|") for cell in line) for line in (columns, rule, *rows))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
