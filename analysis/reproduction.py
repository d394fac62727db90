"""One reproduction: what it is asked for, and the way from the runs of a plan to a table, pictures and a page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.files import Content, check_results, write_results
from teamsight.analysis.runs.simulate import Planned, run_rows

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.runs.processes import WorkerPool
    from teamsight.analysis.runs.simulate import Watch


@dataclass(frozen=True)
class Request:
    """What a reproduction is asked for.

    Attributes
    ----------
    folder : Path
        Where to write; it exists.
    seed, runs, steps : int or None
        The root seed, the replicates of each cell and the steps of each run; None for those of the reproduction.
    quick : bool
        Whether a coarse result is enough.
    formats : tuple of str
        Formats of the pictures: names in `teamsight.analysis.plot.style.FORMATS`.
    force : bool
        Whether files that teamsight did not write may be replaced.
    """

    folder: Path
    seed: int | None = None
    runs: int | None = None
    steps: int | None = None
    quick: bool = False
    formats: tuple[str, ...] = ("png",)
    force: bool = False


class Plan(Protocol):
    """What to simulate."""

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        ...

    def planned(self) -> Iterable[Planned]:
        """Return the runs, each with the columns that identify it."""
        ...


P = TypeVar("P", bound=Plan)


@dataclass(frozen=True)
class Reproduction(Generic[P]):
    """Makes the runs of a plan and writes NAME.parquet, NAME.md and a picture.

    Parameters
    ----------
    name : str
        The name of the files.
    draw : callable
        ``draw(table, plan, format)`` returns the picture.
    page : callable
        ``page(table, plan)`` returns the page, as Markdown.
    summary : callable
        ``summary(table, plan)`` returns the result in sentences.
    tables : mapping of str to callable
        Further tables by the name of their file: each is made from that of all runs.
    doing : str
        What is done while it runs, in a word or two.
    """

    name: str
    draw: Callable[[pd.DataFrame, P, str], bytes]
    page: Callable[[pd.DataFrame, P], str]
    summary: Callable[[pd.DataFrame, P], Sequence[str]]
    tables: Mapping[str, Callable[[pd.DataFrame], pd.DataFrame]]
    doing: str = "simulating"

    def check(self, plan: P, request: Request) -> None:
        """Raise an error if a file must not be replaced by a result or by the checkpoint.

        Parameters
        ----------
        plan : Plan
            What to simulate.
        request : Request
            Where to write, and what may be replaced.

        Raises
        ------
        ValueError
            If there is such a file.
        """
        names = (f"{self.name}.parquet", f"{self.name}.md", *self.tables, *self._pictures(request))
        checkpoint = self._checkpoint(request)
        check_results(request.folder, names, self._about(plan), checkpoint=checkpoint, force=request.force)

    def make(self, plan: P, request: Request, pool: WorkerPool | None, watch: Watch) -> Sequence[str]:
        """Simulate, write all files, and return the result in sentences.

        After an interruption, the same call resumes.

        Parameters
        ----------
        plan : Plan
            What to simulate.
        request : Request
            Where to write, in which formats, and what may be replaced.
        pool : WorkerPool or None
            Who simulates; None for this process.
        watch : callable
            Called with what is done, and how many of how many runs are.

        Raises
        ------
        ValueError
            If a file must not be replaced.
        """
        self.check(plan, request)
        checkpoint = self._checkpoint(request)
        table = run_rows(
            plan.planned(), pool, progress=lambda done, total: watch(self.doing, done, total), checkpoint=checkpoint
        )
        contents: dict[str, Content] = {f"{self.name}.parquet": table}
        contents |= {name: of_runs(table) for name, of_runs in self.tables.items()}
        contents |= {name: self.draw(table, plan, kind) for name, kind in self._pictures(request).items()}
        contents[f"{self.name}.md"] = self.page(table, plan)
        write_results(request.folder, contents, self._about(plan), force=request.force)
        checkpoint.forget()
        return self.summary(table, plan)

    def _pictures(self, request: Request) -> dict[str, str]:
        return {f"{self.name}.{kind}": kind for kind in request.formats}

    def _about(self, plan: P) -> dict[str, Any]:
        return {self.name: plan.conditions()}

    def _checkpoint(self, request: Request) -> Checkpoint:
        return Checkpoint(request.folder / f"{self.name}.checkpoint")
