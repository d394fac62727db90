"""Error messages of the command line: one line of limited length for each thing that is wrong."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from teamsight.cli.options import InputError

# A line that is too long keeps its end, which is the cure.
_MOST, _END = 360, 140


def lines(error: Exception) -> list[str]:
    """Return the messages of `error`, each on one line.

    An error that does not come from the input is a bug in teamsight; its line asks to report it.
    """
    from teamsight.analysis.runs.executor import JobError

    if isinstance(error, InputError):
        return [one_line(message) for message in error.messages]
    if isinstance(error, ValueError | TypeError | JobError):
        return [one_line(str(error))]
    if isinstance(error, ModuleNotFoundError) and error.name is None:
        # An optional package, whose error says how to install it.
        return [one_line(str(error))]
    if isinstance(error, OSError):
        return [one_line(f"{error.filename or 'a file'}: {error.strerror or error}")]
    if isinstance(error, MemoryError):
        return [one_line(f"not enough memory ({error or 'none left'}); give fewer robots, targets, steps or runs")]
    text = f"{type(error).__name__}: {error}"
    return [one_line(f"{text} (a bug in teamsight: please report it, with the output under TEAMSIGHT_TRACEBACK=1)")]


def printable(text: str) -> str:
    """Return a text with control characters, and characters that cannot be encoded, as escape sequences."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def one_line(text: str) -> str:
    """Return a text on one printable line; the middle of a long text is left out."""
    shown = printable(" ".join(text.split()))
    return shown if len(shown) <= _MOST else f"{shown[: _MOST - _END - 3]} … {shown[-_END:]}"


@contextlib.contextmanager
def when_stopped(kept: Callable[[], str]) -> Iterator[None]:
    """Add what is kept to the message "interrupted", if Ctrl-C is pressed within the block."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(kept()) from None
