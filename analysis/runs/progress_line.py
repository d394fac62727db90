"""The progress of many runs on one line, of a terminal or below a cell of a notebook, as that of one long run."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from time import monotonic
from typing import Any

from teamsight.core import checks, status_line
from teamsight.core.status_line import StatusLine, has_reader, seconds

_EVERY = 0.25


def check_progress(progress: object) -> None:
    """Refuse what is neither a truth value nor a function.

    Raises
    ------
    TypeError
        If it is none.
    """
    if not callable(progress) and not isinstance(progress, bool):
        raise TypeError(
            f"progress={checks.shown(progress)}: must be a function that is called as progress(done, total), True for "
            "a line after two seconds, or False for none"
        )


@contextlib.contextmanager
def reported(progress: Callable[..., Any] | bool) -> Iterator[Callable[..., Any]]:
    """Yield the function to call with the work done and the work in all.

    Parameters
    ----------
    progress : callable or bool
        What to call; or whether a line is shown while the work takes longer than two seconds. It is removed in any
        case.
    """
    if callable(progress):
        yield progress
        return
    line = _Line() if progress else None
    try:
        yield line or (lambda *how: None)
    finally:
        if line is not None:
            line.close()


class _Line:
    """Shows how far the work is; only the outermost of works within works does."""

    def __init__(self) -> None:
        self._began = monotonic()
        self._due = self._began + status_line.PATIENCE
        self._line: StatusLine | None = None

    def __call__(self, done: float, total: float, left: float | None = None) -> None:
        now = monotonic()
        if now < self._due or not total or (self._line is None and (status_line.shown_lines or not has_reader())):
            return
        if self._line is None:
            self._line = StatusLine()
            status_line.shown_lines.append(self)
        self._due, taken = now + _EVERY, now - self._began
        if left is None and done:
            left = taken * (total - done) / done
        rest = "" if left is None else f", {seconds(left)} left"
        self._line.show(f"{done / total:.0%} of the runs, {seconds(taken)}{rest}")

    def close(self) -> None:
        """Remove the line."""
        if self._line is not None:
            status_line.shown_lines.remove(self)
            self._line.close()
