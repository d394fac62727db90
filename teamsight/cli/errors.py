"""What an error says on the command line: one line for each thing that is wrong."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator


def lines(error: Exception) -> list[str]:
    """Return the messages of `error`, each on one line.

    An error that is not about the input is a mistake of this package; its line asks to report it.
    """
    from pydantic import ValidationError

    from teamsight.analysis.crew import JobError

    if isinstance(error, ValidationError):
        return [_one_line(found["msg"].removeprefix("Value error, ")) for found in error.errors()]
    if isinstance(error, ValueError | TypeError | JobError):
        return [_one_line(str(error))]
    if isinstance(error, OSError):
        return [_one_line(f"{error.filename or 'a file'}: {error.strerror or error}")]
    told = _one_line(f"{type(error).__name__}: {error}")
    return [f"{told} (a mistake in teamsight: please report it, with what TEAMSIGHT_TRACEBACK=1 shows)"]


@contextlib.contextmanager
def when_stopped(kept: Callable[[], str]) -> Iterator[None]:
    """Tell what is kept when Ctrl-C comes, after the word "interrupted"."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(kept()) from None


def _one_line(text: str) -> str:
    return " ".join(text.split())
