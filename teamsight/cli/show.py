"""What commands print: progress with the time left, tables and lines."""

from __future__ import annotations

import contextlib
import math
import sys
from collections.abc import Iterator
from textwrap import wrap
from typing import TYPE_CHECKING, Any, TextIO, cast

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from teamsight.cli.errors import printable
from teamsight.cli.streams import LossyStream, give_up, named

if TYPE_CHECKING:
    from teamsight.analysis.papers.touzet2000.ledger import Ledger
    from teamsight.analysis.runs.processes import WorkerPool

# Agents × steps of less work than workers save: they import everything anew, which takes each more than a second.
_SHORT = 1e8


class Watch(Progress):
    """Progress on standard error: a bar for each phase, and lines above the bars; lines only if it is no terminal."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        if sys.stderr is not None:
            console.file = cast(TextIO, LossyStream(sys.stderr))
        super().__init__(
            TextColumn("{task.description:<12}"),
            BarColumn(bar_width=32),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console, transient=True, disable=not console.is_terminal,
        )  # fmt: skip
        self._bars: dict[str, TaskID] = {}

    def __call__(self, phase: str, done: float, total: float) -> None:
        """Show how much of a phase is done."""
        if phase not in self._bars:
            self._bars[phase] = self.add_task(phase, total=total)
        self.update(self._bars[phase], completed=done, total=total)

    def emit(self, line: str) -> None:
        """Print a line above the bars."""
        self.console.print(line, highlight=False, markup=False)


@contextlib.contextmanager
def working(workers: int | None, agent_steps: float = math.inf) -> Iterator[tuple[Watch, WorkerPool]]:
    """Show progress, and start a worker pool whose messages stand above the bars.

    Parameters
    ----------
    workers : int or None
        The number of workers; None stands for the number of cores, or for 1 if the work is short.
    agent_steps : float
        Agents × steps × runs of the command.
    """
    from teamsight.analysis.runs.processes import WorkerPool, cores

    number = workers or (cores() if agent_steps > _SHORT else 1)
    with Watch() as watch, WorkerPool(number, watch.emit) as pool:
        yield watch, pool


def plural(count: int, noun: str) -> str:
    """Return the number and the noun, in the plural unless the number is 1."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def interval(middle: float, low: float, high: float, how: str) -> str:
    """Return a mean and its 95 % confidence interval in percent; a single run has no interval."""
    if low == float("-inf"):
        return f"{100 * middle:{how}}"
    return f"{100 * middle:{how}} ({100 * low:{how}} to {100 * high:{how}})"


def say(line: str) -> None:
    """Print a line without wrapping it."""
    wide_console().print(printable(line), highlight=False, soft_wrap=True, markup=False)


def show_ledger(ledger: Ledger) -> None:
    """Print the ledger, one line for each claim, and what it comes to."""
    for line in (*ledger.lines(), "", *(part for text in ledger.summaries() for part in wrap(text, 80))):
        say(line)


class _Output(Console):
    """Standard output whose errors have a name; after its reader has gone away, output is discarded."""

    def print(self, *objects: Any, **how: Any) -> None:
        try:
            super().print(*objects, **how)
        except OSError as error:
            raise named(error) from error

    def on_broken_pipe(self) -> None:
        give_up(sys.stdout)


def wide_console() -> Console:
    """Return the console of standard output; in a file or pipe, lines are long rather than wrapped."""
    console = _Output()
    return console if console.is_terminal else _Output(width=180)
