"""Progress with the time left, and tables, on the terminal."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, TextIO, cast

from rich import box
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

from teamsight.cli.errors import printable
from teamsight.cli.streams import Forgiving, give_up, named

if TYPE_CHECKING:
    from teamsight.analysis.paper.claims import Ledger


class Watch:
    """Shows work as it is done: one bar a phase, and lines above the bars."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._bars: dict[str, TaskID] = {}

    def __call__(self, phase: str, done: float, total: float) -> None:
        """Show that `done` of `total` is done in `phase`."""
        if phase not in self._bars:
            self._bars[phase] = self._progress.add_task(phase, total=total)
        self._progress.update(self._bars[phase], completed=done, total=total)

    def tell(self, line: str) -> None:
        """Show a line."""
        self._progress.console.print(line, highlight=False, markup=False)


@contextlib.contextmanager
def watching() -> Iterator[Watch]:
    """Give a watch on standard error; where that is no terminal, only its lines appear."""
    columns = (
        TextColumn("{task.description:<12}"),
        BarColumn(bar_width=32),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    if sys.stderr is not None:
        console.file = cast(TextIO, Forgiving(sys.stderr))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        yield Watch(progress)


def plural(count: int, noun: str) -> str:
    """Return the number and the noun, in the plural unless it is one."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def interval(middle: float, low: float, high: float, how: str) -> str:
    """Write a mean and its 95 % interval in percent; one run leaves the interval unknown."""
    if low == float("-inf"):
        return f"{100 * middle:{how}}"
    return f"{100 * middle:{how}} ({100 * low:{how}} to {100 * high:{how}})"


def say(line: str) -> None:
    """Print a line as it is, never folded."""
    wide_console().print(printable(line), highlight=False, soft_wrap=True, markup=False)


def show_ledger(ledger: Ledger) -> None:
    """Print the ledger with one column for each setting."""
    console = wide_console()
    table = Table(title="The paper's claims", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("claim", no_wrap=True)
    table.add_column("the paper says", max_width=44)
    table.add_column("its figure", max_width=16)
    for setting in ledger.settings:
        table.add_column(setting, max_width=40)
    for name, claim in ledger.claims().items():
        found = [ledger.verdicts[setting][name] for setting in ledger.settings]
        words = (
            f"[{'green' if v.holds else 'red'}]{'holds' if v.holds else 'differs'}[/]  {v.measured}" for v in found
        )
        table.add_row(name, f"{claim.statement} ({claim.where})", claim.figure, *words)
    console.print(table)
    total = len(ledger.claims())
    for setting in ledger.settings:
        console.print(f"{setting}: {ledger.holding(setting)} of {total} claims hold", highlight=False)


class _Output(Console):
    """Standard output: what is wrong with it is named, and what nobody reads any more goes nowhere."""

    def print(self, *objects: Any, **how: Any) -> None:
        try:
            super().print(*objects, **how)
        except OSError as error:
            raise named(error) from error

    def on_broken_pipe(self) -> None:
        give_up(sys.stdout)


def wide_console() -> Console:
    """Return the console of standard output; into a file or pipe lines are long rather than folded."""
    console = _Output()
    return console if console.is_terminal else _Output(width=180)
