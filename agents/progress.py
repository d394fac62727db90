"""Progress of a long run, for people who wait for it."""

from __future__ import annotations

import math
from time import monotonic

from teamsight.core.status_line import StatusLine, has_reader, seconds

#: A run that takes longer shows its progress [s].
PATIENCE = 2.0
# How often the line changes [s].
_EVERY = 0.25

# Runs within runs, as of a recorder that runs a world of its own, leave the line to the outermost.
_shown: list[RunProgress] = []


class RunProgress:
    """The progress of one run. It costs a comparison per call of the loop, until it is shown.

    Parameters
    ----------
    steps : int
        The number of steps to make.
    is_wanted : bool
        Whether progress may be shown.

    Attributes
    ----------
    steps : int
        The number of steps to make.
    due : float
        The time on the clock `monotonic` at which `show` should be called next [s].
    """

    def __init__(self, steps: int, is_wanted: bool) -> None:
        self.steps, self._began, self.due = steps, 0.0, math.inf
        self._line: StatusLine | None = None
        if is_wanted and not _shown:
            self._began = monotonic()
            self.due = self._began + PATIENCE

    def show(self, done: int) -> None:
        """Show that `done` steps are made, if anybody can read it."""
        if self._line is None:
            if not has_reader():
                self.due = math.inf
                return
            self._line = StatusLine()
            _shown.append(self)
        now = monotonic()
        self.due = now + _EVERY
        taken = now - self._began
        left = f", {seconds(taken * (self.steps - done) / done)} left" if done else ""
        self._line.show(f"step {done:,} of {self.steps:,} ({done / self.steps:.0%}), {seconds(taken)}{left}")

    def close(self) -> None:
        """Remove what is shown."""
        if self._line is not None:
            _shown.remove(self)
            self._line.close()
