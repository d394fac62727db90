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
from rich.text import Text

from teamsight.cli.exits import LossyStream, give_up, named, printable
from teamsight.core.plain_text import broken_lines, text_table

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
            console=console, transient=True, disable=not console.is_terminal or console.is_dumb_terminal,
        )  # fmt: skip
        self._bars: dict[str, TaskID] = {}
        self._began = time.perf_counter()

    def __call__(self, phase: str, done: float, total: float) -> None:
        """Show how much of a phase is done."""
        if phase not in self._bars:
            self._bars[phase] = self.add_task(phase, total=total)
        self.update(self._bars[phase], completed=done, total=total)

    def emit(self, line: str) -> None:
        """Print a line above the bars."""
        _print_line(self.console, line)

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
    """Print a line; a terminal breaks it between words."""
    _print_line(wide_console(), line)


def _print_line(console: Console, line: str) -> None:
    text = printable(line)
    if console.is_terminal:
        text = broken_lines(text, console.width)
    console.print(text, highlight=False, soft_wrap=True, markup=False)


def show_table(
    rows: Iterable[Iterable[Any]],
    headings: Sequence[str] = (),
    left: Iterable[int] = (0,),
    spare: Iterable[int] = (),
) -> None:
    """Print a table of texts.

    Parameters
    ----------
    rows, headings, left, spare
        As for `text_table`; cells are printed as by `str`.
    """
    console = wide_console()
    width = console.width if console.is_terminal else math.inf
    cells = [[printable(str(cell)) for cell in row] for row in rows]
    table = text_table(cells, headings, left, spare, width)
    for lines, style in ((table.head, "bold"), (table.body, "")):
        if lines:
            console.print(Text("\n".join(lines), style), highlight=False, soft_wrap=True)
    if table.left_out:
        say(f"a wider terminal also shows {', '.join(table.left_out)}")


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
