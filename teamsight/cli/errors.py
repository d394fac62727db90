"""What an error says on the command line: one line of bounded length for each thing that is wrong."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

# The end of a line is the cure.
_MOST, _END = 360, 140


def lines(error: Exception) -> list[str]:
    """Return the messages of `error`, each on one line.

    An error that is not about the input is a mistake of this package; its line asks to report it.
    """
    from pydantic import ValidationError

    from teamsight.analysis.runs.workers import JobError

    if isinstance(error, ValidationError):
        return [one_line(found["msg"].removeprefix("Value error, ")) for found in error.errors()]
    if isinstance(error, ValueError | TypeError | JobError):
        return [one_line(str(error))]
    if isinstance(error, OSError):
        return [one_line(f"{error.filename or 'a file'}: {error.strerror or error}")]
    if isinstance(error, MemoryError):
        return [one_line(f"not enough memory ({error or 'none left'}); give fewer robots, targets, steps or runs")]
    told = f"{type(error).__name__}: {error}"
    return [one_line(f"{told} (a mistake in teamsight: please report it, with what TEAMSIGHT_TRACEBACK=1 shows)")]


def printable(text: str) -> str:
    """Return a text without what a terminal would obey or could not encode; names of files may hold anything."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def one_line(text: str) -> str:
    """Return a text on one line that a terminal can show, its middle left out where it is long."""
    shown = printable(" ".join(text.split()))
    return shown if len(shown) <= _MOST else f"{shown[: _MOST - _END - 3]} … {shown[-_END:]}"


@contextlib.contextmanager
def when_stopped(kept: Callable[[], str]) -> Iterator[None]:
    """Tell what is kept when Ctrl-C comes, after the word "interrupted"."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(kept()) from None
