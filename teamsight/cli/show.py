"""What commands print: progress with the time left, tables and lines."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
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
from rich.table import Table
from rich.text import Text

from teamsight.cli.exits import LossyStream, give_up, named, printable

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor
    from teamsight.cli.options import Works

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
        self._began = time.perf_counter()

    def __call__(self, phase: str, done: float, total: float) -> None:
        """Show how much of a phase is done."""
        if phase not in self._bars:
            self._bars[phase] = self.add_task(phase, total=total)
        self.update(self._bars[phase], completed=done, total=total)

    def emit(self, line: str) -> None:
        """Print a line above the bars, without wrapping it."""
        self.console.print(printable(line), highlight=False, markup=False, soft_wrap=True)

    def passed(self) -> str:
        """Return how long the work has taken."""
        return f"{time.perf_counter() - self._began:.0f} s"


@contextlib.contextmanager
def when_stopped(kept: Callable[[], str]) -> Iterator[None]:
    """Add what is kept to the message "interrupted", if Ctrl-C is pressed within the block."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(kept()) from None


@contextlib.contextmanager
def working(
    settings: Works, kept: Callable[[], str] = lambda: "nothing was kept", *, agent_steps: float = math.inf
) -> Iterator[tuple[Watch, Executor]]:
    """Show progress, and start what makes the runs; messages of workers stand above the bars.

    Parameters
    ----------
    settings : Works
        The number of workers, where None stands for the number of cores, or for 1 if the work is short; or the cluster.
    kept : callable
        Returns what is kept if Ctrl-C is pressed.
    agent_steps : float
        Agents × steps × runs of the command.
    """
    import click

    from teamsight.analysis.runs.executor import emitting
    from teamsight.analysis.runs.processes import WorkerPool, cores
    from teamsight.analysis.runs.simulate import ShardsMissingError

    number = settings.workers or (cores() if agent_steps > _SHORT else 1)
    with when_stopped(kept), Watch() as watch, emitting(watch.emit), contextlib.ExitStack() as stack:
        pool = stack.enter_context(settings.executor()) or stack.enter_context(WorkerPool(number))
        pool.shard = getattr(settings, "shard", None)
        try:
            yield watch, pool
        except ShardsMissingError as done:
            shard_done = str(done)
        else:
            return
    say(shard_done)
    raise click.exceptions.Exit(0)


def kept_in(place: Path, count: object, what: str = "runs", otherwise: str = "nothing was kept") -> str:
    """Return how much of the work is kept for the same command, which continues from there."""
    return f"{count} {what} are kept in {place}; the same command continues from there" if count else otherwise


def plural(count: int, noun: str) -> str:
    """Return the number and the noun, in the plural unless the number is 1."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def interval(
    row: Mapping[Any, Any], how: str, scale: float = 1.0, names: Iterable[str] = ("mean", "low", "high")
) -> str:
    """Return a mean and its 95 % confidence interval, which a single run does not have, times a scale."""
    middle, low, high = (scale * row[name] for name in names)
    return f"{middle:{how}} ({low:{how}} to {high:{how}})" if math.isfinite(low) else f"{middle:{how}}"


def say(line: str) -> None:
    """Print a line without wrapping it."""
    wide_console().print(printable(line), highlight=False, soft_wrap=True, markup=False)


def show_table(
    rows: Iterable[Iterable[Any]],
    headings: Sequence[str] = (),
    left: Iterable[int] = (0,),
    spare: Iterable[int] = (),
    **how: Any,
) -> None:
    """Print a table of texts.

    Parameters
    ----------
    rows : iterable of iterable
        The cells.
    headings : sequence of str
        The headings of all columns; none by default.
    left : iterable of int
        The columns whose texts begin at the left; numbers end at the right.
    spare : iterable of int
        The columns that are left out, one after the other, until a terminal is as wide as the table; a line names them.
    **how
        Parameters of the columns, as of `rich.table.Table.add_column`.
    """
    kept = [[Text(printable(str(cell))) for cell in row] for row in rows]
    titles = [Text(title) for title in headings or [""] * len(kept[0])]
    shown, lost = list(range(len(titles))), []
    console, left = wide_console(), set(left)
    widths = [max(row[place].cell_len for row in (titles, *kept)) for place in shown]
    for place in spare:
        if sum(widths[one] for one in shown) + 2 * len(shown) - 2 > console.width:
            shown.remove(place)
            lost.append(titles[place].plain)
    table = Table(box=None, pad_edge=False, show_header=bool(headings))
    for place in shown:
        table.add_column(titles[place], justify="left" if place in left else "right", **how)
    for row in kept:
        table.add_row(*(row[place] for place in shown))
    console.print(table, highlight=False)
    if lost:
        say(f"a wider terminal also shows {', '.join(lost)}")


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
