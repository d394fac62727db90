"""What all papers share: the way from the runs of a plan to files, rules of claims, and parts of pages and figures.

Nothing slow is imported here, so that the help of a command answers at once.
"""

from __future__ import annotations

import contextlib
import re
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import to_picture
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.seeds import run_seed
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above, interval_text
from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Positive, Seed
from teamsight.core.interrupts import is_interrupt

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.runs.files import Content
    from teamsight.analysis.runs.run import Measure, Run
    from teamsight.analysis.runs.simulate import Planned, Watch
    from teamsight.tasks.task import Task

Floats = npt.NDArray[np.float64]

#: The source of a claim that was not read: it agrees or differs, and can neither hold nor fail.
RECALLED = "recalled, not verified"
AGREES, DIFFERS = "agrees", "differs"

# The order of runs that are compared in pairs.
_ORDER = ("robots", "attractors", "mass", "replicate")


@dataclass(frozen=True)
class PaperPlan(Component):
    """What to simulate; its fields that can be given as texts are the options of the paper's command."""

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it; not called if the paper makes its runs in another way."""
        raise NotImplementedError


#: The option by which conditions are chosen.
NAMES = Allowed(is_repeated=True, shown="all", metavar="NAME")


@dataclass(frozen=True)
class NamedConditions(PaperPlan):
    """What to simulate of a paper whose conditions have names.

    Parameters
    ----------
    runs : int
        Runs of each condition. Run r of all conditions has the same seed.
    share : float
        How much of each condition's own work is done.
    seed : int
        Seed of all runs.
    names : tuple of str
        A condition. May be given several times.
    """

    runs: limits.Runs = 10
    share: Positive = 1.0
    seed: Seed = 0
    names: tuple[str, ...] = ()
    #: All conditions by name.
    known: ClassVar[Mapping[str, Any]] = {}

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "names", self.names or tuple(self.known))

    def work(self, condition: Any) -> tuple[dict[str, Any], Callable[[int], Run]]:
        """Return further columns of the runs of a condition, and what returns the run with a seed."""
        raise NotImplementedError

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: condition, replicate, seed, and those of its work."""
        for name in self.names:
            columns, run = self.work(self.known[name])
            for replicate in range(self.runs):
                seed = run_seed(self.seed, replicate)
                yield {"condition": name, "replicate": replicate, "seed": seed, **columns}, run(seed)


P = TypeVar("P", bound=PaperPlan)
F = TypeVar("F")
#: Files that are written together, by name, and what their tables hold beside what all results are about.
Contents = tuple[dict[str, "Content"], dict[str, Any]]


def runs_of(plan: PaperPlan, pool: Executor | None, watch: Watch, checkpoint: Checkpoint | None) -> pd.DataFrame:
    """Make the runs of a plan, and return a table with one row for each."""
    from teamsight.analysis.runs.simulate import run_rows

    return run_rows(plan.planned(), pool, progress=partial(watch, "simulating"), checkpoint=checkpoint)


class PaperError(ValueError):
    """Raised when something in the file of a paper fails; the message names the file, the line and what it was for."""


@dataclass(frozen=True, kw_only=True)
class Reproduction(Generic[P, F]):
    """The way from a plan to files: what is made, which files result, and what is said of it.

    Parameters
    ----------
    plan : type
        The class of the plan.
    name : str
        The name of the files.
    make : callable
        ``make(plan, pool, watch, checkpoint)`` returns what was found; by default the table of all runs.
    quick, small : mapping of str to object
        The values of the plan's fields with which a coarse result is made, and those of a test, in a second.
    """

    plan: type[P]
    name: str
    make: Callable[[P, Executor | None, Watch, Checkpoint | None], F] = runs_of  # type: ignore[assignment]
    quick: Mapping[str, Any] = field(default_factory=dict)
    small: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("quick", "small"):
            for one in getattr(self, name):
                checks.choice(name, one, [each.name for each in fields(self.plan)])

    @contextlib.contextmanager
    def blamed(
        self, what: str, known: Callable[[], Iterable[str]] = tuple, but: tuple[type[Exception], ...] = ()
    ) -> Iterator[None]:
        """Name the file of the paper, and what fails, in an error that the paper causes within the block.

        Parameters
        ----------
        what : str
            What the block makes, such as "figure 'pursuit'".
        known : callable
            Returns the names that it can read; they are listed if it reads another.
        but : tuple of type
            Errors that are left as they are.

        Raises
        ------
        PaperError
            In place of the error.
        """
        from teamsight.analysis.runs.executor import JobError, error_text

        try:
            yield
        except Exception as error:
            file, line, claim = self._place_of(error)
            # An optional package has an error that says how to install it; a job may fail in other files.
            is_other = isinstance(error, JobError) and not line
            is_other |= isinstance(error, ModuleNotFoundError) and error.name is None
            if is_other or is_interrupt(error) or isinstance(error, (PaperError, OSError, MemoryError, *but)):
                raise
            names = ", ".join(known()) if isinstance(error, KeyError) else ""
            reason = error_text(error) + (f" (claim {claim!r})" if claim else "")
            raise PaperError(f"{file}{line}: {what}: {reason}" + (f"; known are {names}" if names else "")) from error

    def _place_of(self, error: BaseException) -> tuple[str, str, str]:
        """Return the paper's file, the last line of it through which an error went, and the claim that it judged."""
        file = sys.modules[self.plan.__module__].__file__ or ""
        frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
        claims = (frame.f_locals.get("claim") for frame in frames if frame.f_code.co_filename == file)
        # As text, since that of a job is from another process.
        lines = re.findall(rf'File "{re.escape(file)}", line (\d+)', "".join(traceback.format_exception(error)))
        return file, f", line {lines[-1]}" if lines else "", next((one for one in claims if isinstance(one, str)), "")

    def checkpoint(self, folder: Path) -> Checkpoint:
        """Return the runs that an interrupted command left in a folder."""
        from teamsight.analysis.runs.checkpoint import Checkpoint

        return Checkpoint(folder / f"{self.name}.checkpoint")

    def names(self, plan: P, folder: Path, formats: Sequence[str]) -> list[str]:
        """Return the names of all files that `reproduce` writes to a folder."""
        raise NotImplementedError

    def contents(
        self, found: F, plan: P, formats: Sequence[str], pool: Executor | None, watch: Watch
    ) -> Iterator[Contents]:
        """Yield the files."""
        raise NotImplementedError

    def summary(self, found: F, plan: P) -> Sequence[str]:
        """Return the result in sentences."""
        raise NotImplementedError

    def about(self, plan: P) -> dict[str, Any]:
        """Return the settings that tables hold; those with others are not replaced."""
        return {self.name: found} if (found := plan.conditions()) else {}

    def title(self, plan: P) -> str:
        """Return what is made, in words."""
        return self.plan.__module__.rpartition(".")[2]

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
        plan : PaperPlan
            What to simulate.
        folder : Path
            An existing folder.
        pool : Executor, optional
            Who simulates; by default this process. Results do not depend on it.
        watch : callable
            Called with the phase, the work done in it, and its work in all; see `Watch` in `simulate.py`.
        formats : sequence of str
            Formats of the pictures: names in `teamsight.analysis.plot.style.FORMATS`.
        force : bool
            Replace any regular file by a result.

        Raises
        ------
        ValueError
            If a file must not be replaced by a result or by the checkpoint; before anything is simulated.
        """
        from teamsight.analysis.runs.files import check_results, write_results
        from teamsight.analysis.runs.simulate import ShardsMissingError

        checkpoint, about = self.checkpoint(folder), self.about(plan)
        check_results(folder, self.names(plan, folder, formats), about, checkpoint=checkpoint, force=force)
        # What a user gives may be wrong, too.
        with self.blamed("runs", but=(ValueError, TypeError, ShardsMissingError)):
            found = self.make(plan, pool, watch, checkpoint)
        for contents, further in self.contents(found, plan, formats, pool, watch):
            for name in contents:
                (folder / name).parent.mkdir(exist_ok=True)
            write_results(folder, contents, about | further, force=force)
        checkpoint.forget()
        return found


@dataclass(frozen=True, kw_only=True)
class Paper(Reproduction[P, F]):
    """A reproduction with one table of runs, one page and some figures.

    Parameters
    ----------
    template : str
        The page: paragraphs, lists and tables of Markdown with values in braces, such as the rows of a table.
    values : callable
        ``values(found, plan)`` returns the values of the template by name, beside ``plan``, ``claims`` (the table of
        the verdicts) and ``number``, that of the claims.
    figures : mapping of str to callable
        By the name of each picture, ``draw(found, plan)``, which returns the figure; its label is its title.
    verdicts : callable
        ``verdicts(found, plan)`` returns the verdicts on all claims.
    measured : str
        The title of what was measured, in the table of the verdicts.
    sentences : callable
        ``sentences(found, plan)`` returns what is said of the result beside the verdicts.
    tables : mapping of str to callable
        By the name of each further table, ``of(found, plan)``, which returns it.
    runs : callable
        ``runs(found)`` returns the table of all runs.
    page : str
        The page of the documentation about the result, without ``.md``. Beside it stands the table from which its
        tables and its pictures are made, NAME.parquet.
    restore : callable
        Returns what was found from that table; by default, this is the table.
    """

    template: str
    values: Callable[[F, P], Mapping[str, Any]]
    figures: Mapping[str, Callable[[F, P], Canvas]]
    verdicts: Callable[[F, P], Sequence[Verdict]] = lambda found, plan: ()
    measured: str = "measured"
    sentences: Callable[[F, P], Sequence[str]] = lambda found, plan: ()
    tables: Mapping[str, Callable[[F, P], pd.DataFrame]] = field(default_factory=dict)
    runs: Callable[[F], pd.DataFrame] = lambda found: found  # type: ignore[assignment, return-value]
    page: str = ""
    restore: Callable[[pd.DataFrame], F] = lambda table: table  # type: ignore[assignment, return-value]

    def names(self, plan: P, folder: Path, formats: Sequence[str]) -> list[str]:
        pictures = [f"{name}.{kind}" for name in self.figures for kind in formats]
        return [f"{self.name}.parquet", *self.tables, *pictures, f"{self.name}.md"]

    def contents(
        self, found: F, plan: P, formats: Sequence[str], pool: Executor | None, watch: Watch
    ) -> Iterator[Contents]:
        contents: dict[str, Content] = {f"{self.name}.parquet": self.runs(found)}
        for name, of in self.tables.items():
            with self._reading(f"table {name}", found):
                contents[name] = of(found, plan)
        for name in self.figures:
            contents |= {f"{name}.{kind}": self.picture(name, found, plan, kind) for kind in formats}
        yield contents | {f"{self.name}.md": self.text(found, plan)}, {}

    def picture(self, name: str, found: F, plan: P, kind: str = "png") -> bytes:
        """Return one of the pictures in a format of `teamsight.analysis.plot.style.FORMATS`."""
        with self._reading(f"figure {name!r}", found):
            return to_picture(self.figures[name](found, plan), kind=kind)

    def text(self, found: F, plan: P) -> str:
        """Return the page, as Markdown."""
        verdicts = self._judged(found, plan)
        claims = {"claims": verdict_table(verdicts, self.measured), "number": len(verdicts)}
        with self._reading("values of the page", found):
            values = {"plan": plan, **claims, **self.values(found, plan)}
        with self.blamed("template", lambda: values):
            return filled(self.template, **values)

    def summary(self, found: F, plan: P) -> Sequence[str]:
        verdicts = self._judged(found, plan)
        with self._reading("sentences", found):
            said = self.sentences(found, plan)
        claims = [verdict_counts(verdicts), *(f"{one.claim}: {one.measured}, {one.verdict}." for one in verdicts)]
        return [*(claims if verdicts or not said else ()), *said]

    def _judged(self, found: F, plan: P) -> Sequence[Verdict]:
        with self._reading("claims", found):
            return self.verdicts(found, plan)

    def _reading(self, what: str, found: F) -> contextlib.AbstractContextManager[None]:
        """Blame the paper for what reads its table; see `blamed`."""
        return self.blamed(what, lambda: self.runs(found).columns)


def rows_of(table: pd.DataFrame, **values: Any) -> pd.DataFrame:
    """Return the rows whose columns have these values."""
    for name, value in values.items():
        table = table[table[name] == value]
    return table


def column(table: pd.DataFrame, name: str, **values: Any) -> Floats:
    """Return a column of the rows with these values, in the order of robots, attractors, masses and replicates."""
    order = [one for one in _ORDER if one in table]
    return np.asarray(rows_of(table, **values).sort_values(order)[name], float)


def saving(with_: Floats, without: Floats) -> Interval:
    """Return by which share a mean is smaller than another, of runs in pairs.

    The interval is Student's, of the paired differences to first order in the ratio of the means.
    """
    ratio = with_.mean() / without.mean()
    return interval_of(1.0 - ratio + (ratio * without - with_) / without.mean())


def judged(claim: str, source: str, measured: str, verdict: str) -> Verdict:
    """Return the verdict on a claim; one that is recalled agrees or differs."""
    if source == RECALLED:
        verdict = {HOLDS: AGREES, FAILS: DIFFERS}.get(verdict, verdict)
    return Verdict(claim, source, measured, verdict)


def verdict_of(
    claim: str, source: str, interval: Interval, unit: str, rule: Callable[[Interval], str] = above, *,
    said: str = "{}", digits: int = 1,
) -> Verdict:  # fmt: skip
    """Return the verdict on a claim by an interval.

    Parameters
    ----------
    claim, source : str
        The claim, and where it stands.
    interval : Interval
        What was measured.
    unit : str
        Its unit; "%" and "points" of a share.
    rule : callable
        Returns the verdict on an interval; by default whether it is above 0.
    said : str
        What is said of the interval, which stands in the place of the braces.
    digits : int
        Digits after the point.
    """
    scale = 100.0 if unit in ("%", "points") else 1.0
    return judged(claim, source, said.format(interval_text(interval, unit, digits, scale)), rule(interval))


def run_until(is_done: Callable[[World], bool], world: World, steps: int, part: int) -> None:
    """Run a world for so many steps at most, or up to the first multiple of `part` steps at which it is done."""
    left = steps
    while left > 0 and not (left < steps and is_done(world)):
        world.run(min(part, left))
        left -= part


def paired_runs(
    task: Task, root: int, runs: int, cell: Mapping[str, Any], teams: Mapping[str, Any], steps: int, measure: Measure
) -> Iterator[tuple[str, int, int, Run]]:
    """Yield name, replicate, seed and run of each team in a cell of a scenario; they meet the same worlds."""
    from teamsight.analysis.runs.run import task_run, task_seed

    for replicate in range(runs):
        seed = task_seed(task, root, replicate, cell)
        for name, team in teams.items():
            yield name, replicate, seed, task_run(task, task.parameters(team, cell), seed, steps, measure)


def verdict_table(found: Iterable[Verdict], measured: str = "measured") -> str:
    """Return a table of Markdown with a row for each claim; `measured` is the title of what was measured."""
    return markdown.table(["claim", "source", measured, "verdict"], [list(one) for one in found])


def verdict_counts(found: Sequence[Verdict]) -> str:
    """Return in one sentence how many claims hold, do not hold, agree, differ, and are undecided."""
    counts = Counter(one.verdict for one in found)
    always = {HOLDS: "hold", FAILS: "do not hold", UNDECIDED: "are undecided"}
    recalled = {one: one.rstrip("s") for one in (AGREES, DIFFERS) if counts[one]}
    words = ", ".join(f"{counts[name]} {word}" for name, word in (always | recalled).items())
    return f"Of {len(found)} claims {words}."


def filled(template: str, **values: Any) -> str:
    """Return a page of Markdown from its template: paragraphs, lists and tables, and values in braces."""
    paragraphs = (re.sub(r"(?<!\|)\n(?!- |\d+\. |\|)", " ", one) for one in template.strip().split("\n\n"))
    return markdown.page(*(one.format(**values) for one in paragraphs))


def intervals(samples: Iterable[npt.ArrayLike]) -> list[Interval]:
    """Return the mean of each sample with its 95 % interval."""
    return [interval_of(np.asarray(one, float)) for one in samples]
