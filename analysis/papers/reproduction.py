"""What all papers share: the way from the runs of a plan to files, rules of claims, and parts of pages and figures.

Nothing slow is imported here, so that the help of a command answers at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import canvas, head, plain, to_picture
from teamsight.analysis.runs.settings import as_json
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict
from teamsight.core.component import Component

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.runs.planned_runs import Planned
    from teamsight.analysis.runs.results import Content
    from teamsight.analysis.runs.simulate import Watch

Floats = npt.NDArray[np.float64]

#: The source of a claim that was not read: it agrees or differs, and can neither hold nor fail.
RECALLED = "recalled, not verified"
AGREES, DIFFERS = "agrees", "differs"

# The order of runs that are compared in pairs.
_ORDER = ("robots", "attractors", "replicate")


@dataclass(frozen=True)
class Plan(Component):
    """What to simulate; its fields are the options of the paper's command."""

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it."""
        raise NotImplementedError


P = TypeVar("P", bound=Plan)
F = TypeVar("F")


def runs_of(plan: Plan, pool: Executor | None, watch: Watch, checkpoint: Checkpoint | None) -> pd.DataFrame:
    """Make the runs of a plan, and return a table with one row for each."""
    from teamsight.analysis.runs.planned_runs import run_rows

    progress = lambda done, total: watch("simulating", done, total)  # noqa: E731
    return run_rows(plan.planned(), pool, progress=progress, checkpoint=checkpoint)


@dataclass(frozen=True)
class Paper(Generic[P, F]):
    """A reproduction: all that is made of a plan.

    Parameters
    ----------
    plan : type
        The class of the plan.
    name : str
        The name of the files.
    page : callable
        ``page(found, plan)`` returns the page, as Markdown.
    summary : callable
        ``summary(found, plan)`` returns the result in sentences.
    figures : mapping of str to (str, callable)
        By the name of each picture, its title, and ``draw(found, plan)``, which returns the figure.
    tables : mapping of str to callable
        By the name of each further table, ``of(found, plan)``, which returns it.
    make : callable
        ``make(plan, pool, watch, checkpoint)`` returns what was found; by default the table of all runs.
    runs : callable
        ``runs(found)`` returns the table of all runs.
    quick : mapping of str to object
        The values of the plan's fields with which a coarse result is made.
    """

    plan: type[P]
    name: str
    page: Callable[[F, P], str]
    summary: Callable[[F, P], Sequence[str]]
    figures: Mapping[str, tuple[str, Callable[[F, P], Canvas]]]
    tables: Mapping[str, Callable[[F, P], pd.DataFrame]] = field(default_factory=dict)
    make: Callable[[P, Executor | None, Watch, Checkpoint | None], F] = runs_of  # type: ignore[assignment]
    runs: Callable[[F], pd.DataFrame] = lambda found: found  # type: ignore[assignment, return-value]
    quick: Mapping[str, Any] = field(default_factory=dict)

    def checkpoint(self, folder: Path) -> Checkpoint:
        """Return the runs that an interrupted command left in a folder."""
        from teamsight.analysis.runs.checkpoint import Checkpoint

        return Checkpoint(folder / f"{self.name}.checkpoint")

    def check(self, plan: P, folder: Path, formats: Sequence[str] = ("png",), *, force: bool = False) -> None:
        """Raise an error if a file in a folder must not be replaced by a result or by the checkpoint.

        Raises
        ------
        ValueError
            If there is such a file.
        """
        from teamsight.analysis.runs.results import check_results

        pictures = [f"{name}.{kind}" for name in self.figures for kind in formats]
        names = (f"{self.name}.parquet", *self.tables, *pictures, f"{self.name}.md")
        about = {self.name: plan.conditions()}
        check_results(folder, names, about, checkpoint=self.checkpoint(folder), force=force)

    def reproduce(
        self,
        plan: P,
        folder: Path,
        pool: Executor | None = None,
        watch: Watch = lambda phase, done, total: None,
        formats: Sequence[str] = ("png",),
        *,
        force: bool = False,
    ) -> F:
        """Simulate, write all files, and return what was found; after an interruption, the same call resumes.

        Parameters
        ----------
        plan : Plan
            What to simulate.
        folder : Path
            An existing folder.
        pool : Executor, optional
            Who simulates; by default this process. Results do not depend on it.
        watch : callable
            Called with what is done, and how many of how many runs are.
        formats : sequence of str
            Formats of the pictures: names in `teamsight.analysis.plot.style.FORMATS`.
        force : bool
            Replace any regular file by a result.

        Raises
        ------
        ValueError
            If a file must not be replaced.
        """
        from teamsight.analysis.runs.results import write_results

        self.check(plan, folder, formats, force=force)
        checkpoint = self.checkpoint(folder)
        found = self.make(plan, pool, watch, checkpoint)
        contents: dict[str, Content] = {f"{self.name}.parquet": self.runs(found)}
        contents |= {name: of(found, plan) for name, of in self.tables.items()}
        for name in self.figures:
            contents |= {f"{name}.{kind}": self.picture(name, found, plan, kind) for kind in formats}
        contents[f"{self.name}.md"] = self.page(found, plan)
        write_results(folder, contents, {self.name: plan.conditions()}, force=force)
        checkpoint.forget()
        return found

    def picture(self, name: str, found: F, plan: P, kind: str = "png") -> bytes:
        """Return one of the pictures in a format of `teamsight.analysis.plot.style.FORMATS`."""
        title, draw = self.figures[name]
        return to_picture(draw(found, plan), title, kind)


def chosen(table: pd.DataFrame, **values: Any) -> pd.DataFrame:
    """Return the rows whose columns have these values."""
    for name, value in values.items():
        table = table[table[name] == value]
    return table


def column(table: pd.DataFrame, name: str, **values: Any) -> Floats:
    """Return a column of the rows that are `chosen`, in the order of robots, attractors and replicates."""
    order = [one for one in _ORDER if one in table]
    return np.asarray(chosen(table, **values).sort_values(order)[name], float)


def saving(with_: Floats, without: Floats) -> Interval:
    """Return by which share a mean is smaller than another, of runs in pairs.

    The interval is Student's, of the paired differences to first order in the ratio of the means.
    """
    ratio = with_.mean() / without.mean()
    return interval_of(1.0 - ratio + (ratio * without - with_) / without.mean())


def no_less(interval: Interval, margin: float) -> str:
    """Return whether a quantity is at least 0, or short of it by the margin at most, by its interval."""
    return HOLDS if interval.low >= -margin else FAILS if interval.high < -margin else UNDECIDED


def within(interval: Interval, margin: float) -> str:
    """Return whether a quantity differs from 0 by the margin at most, by its interval."""
    if interval.low >= -margin and interval.high <= margin:
        return HOLDS
    return FAILS if interval.high < -margin or interval.low > margin else UNDECIDED


def judged(claim: str, source: str, measured: str, verdict: str) -> Verdict:
    """Return the verdict on a claim; one that is recalled agrees or differs."""
    if source == RECALLED:
        verdict = {HOLDS: AGREES, FAILS: DIFFERS}.get(verdict, verdict)
    return Verdict(claim, source, measured, verdict)


def verdict_table(found: Iterable[Verdict], measured: str = "measured") -> str:
    """Return a table of Markdown with a row for each claim; `measured` is the title of what was measured."""
    return markdown.table(["claim", "source", measured, "verdict"], [list(one) for one in found])


def verdict_counts(found: Sequence[Verdict]) -> str:
    """Return in one sentence how many claims hold, do not hold, and are undecided."""
    held, failed, left = (sum(one.verdict == name for one in found) for name in (HOLDS, FAILS, UNDECIDED))
    return f"Of {len(found)} claims {held} hold, {failed} do not hold, {left} are undecided."


def filled(template: str, **values: Any) -> str:
    """Return a page of Markdown from its template: paragraphs with empty lines between, and values in braces."""
    paragraphs = (" ".join(one.split("\n")) for one in template.strip().split("\n\n"))
    return markdown.page(*(one.format(**values) for one in paragraphs))


def titled(width: float, height: float, title: str, subtitle: str) -> Canvas:
    """Return an empty figure of this size [inches] with its title."""
    figure = canvas(width, height)
    head(figure, title, subtitle)
    return figure


def panel(figure: Canvas, place: tuple[float, float, float, float], title: str, x: str = "", y: str = "") -> Axes:
    """Add a panel to a figure, with its title and the labels of its axes."""
    axes = figure.add_axes(place)
    plain(axes)
    axes.set_title(title, loc="left", size=10)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    return axes


def error_bars(axes: Axes, x: Sequence[float], samples: Iterable[npt.ArrayLike], **style: Any) -> None:
    """Draw the mean of each sample with its 95 % interval; none where a single run gives none."""
    found = [interval_of(np.asarray(one, float)) for one in samples]
    wide = [max(one.high - one.mean, 0.0) if np.isfinite(one.high) else 0.0 for one in found]
    axes.errorbar(x, [one.mean for one in found], wide, **{"marker": "o", "capsize": 2, **style})


def band(
    axes: Axes, x: npt.ArrayLike, values: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike], opacity: float = 0.2,
    **style: Any,
) -> None:  # fmt: skip
    """Draw means as a line, and a band from their lower to their upper bounds, unless a single run gives none."""
    axes.plot(x, values[0], **{"linewidth": 1.6, **style})
    if np.isfinite(values[1]).all():
        axes.fill_between(x, *values[1:], color=style["color"], alpha=opacity, linewidth=0)
