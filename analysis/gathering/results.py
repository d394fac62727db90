"""The gathering index from runs to files: two tables, a picture and a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from teamsight import __version__
from teamsight.analysis.gathering.cells import Cell, cell, delta_of, frame
from teamsight.analysis.gathering.claims import Verdict, judge
from teamsight.analysis.gathering.figure import draw
from teamsight.analysis.gathering.page import page
from teamsight.analysis.gathering.plan import Plan, deltas
from teamsight.analysis.gathering.simulate import Team, both_teams, simulate
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool

#: The files that are written.
RUNS, INDEX, PAGE, PICTURE = "gathering.parquet", "gathering-index.parquet", "gathering.md", "gathering"


class Gathering(NamedTuple):
    """What was found.

    Attributes
    ----------
    runs : DataFrame
        One row for each run; see `simulate`.
    cells : list of Cell
        One for each task and team size.
    verdicts : list of Verdict
        On G1 to G4.
    """

    runs: pd.DataFrame
    cells: list[Cell]
    verdicts: list[Verdict]

    @property
    def frame(self) -> pd.DataFrame:
        """The cells as a table."""
        return frame(self.cells)


def gather(
    plan: Plan,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    checkpoint: Checkpoint | None = None,
) -> Gathering:
    """Simulate, and judge the claims.

    Parameters
    ----------
    plan : Plan
        What to simulate.
    pool : WorkerPool, optional
        Processes that do the work. The result does not depend on it.
    watch : callable
        Called with the phase, the work done in it and its work in all.
    checkpoint : Checkpoint, optional
        File of finished runs.
    """
    teams = simulate(
        plan, both_teams(plan), pool, progress=lambda *done: watch("both teams", *done), checkpoint=checkpoint
    )  # fmt: skip
    curves = [
        Team(task, size, "skilled", delta)
        for task in plan.all_tasks
        for size in plan.sizes
        for delta in deltas(size, (delta_of(plan, teams, task, size, one).delta for one in ("explore", "skilled")))
    ]
    against = simulate(plan, curves, pool, progress=lambda *done: watch("against δ", *done), checkpoint=checkpoint)
    table = pd.concat([teams, against], ignore_index=True)
    cells = [cell(plan, table, task, size) for task in plan.all_tasks for size in plan.sizes]
    return Gathering(table, cells, judge(cells))


def check_results(plan: Plan, folder: Path, formats: Sequence[str] = ("png",), *, force: bool = False) -> None:
    """Raise an error if a file in the folder must not be replaced by a result or by the checkpoint.

    Parameters
    ----------
    plan : Plan
        What to simulate.
    folder : Path
        Where to write.
    formats : sequence of str
        Formats of the picture.
    force : bool
        Replace any regular file by a result.

    Raises
    ------
    ValueError
        If there is such a file.
    """
    for name in (RUNS, INDEX):
        files.check_replaceable(folder / name, {"gathering": plan.conditions()}, force=force)
    for name in (PAGE, *(f"{PICTURE}.{kind}" for kind in formats)):
        files.check_replaceable(folder / name, force=force)
    checkpoint_in(folder).check()


def make_results(
    plan: Plan,
    folder: Path,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    formats: Sequence[str] = ("png",),
    *,
    force: bool = False,
) -> Gathering:
    """Simulate, draw and write all results to a folder. After an interruption, the same call resumes.

    Parameters
    ----------
    plan, pool, watch
        See `gather`.
    folder : Path
        An existing folder.
    formats : sequence of str
        Formats of the picture.
    force : bool
        Replace any regular file by a result.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check_results`.
    """
    check_results(plan, folder, formats, force=force)
    checkpoint = checkpoint_in(folder)
    found = gather(plan, pool, watch, checkpoint)
    about = {"gathering": plan.conditions(), "version": __version__}
    files.write_table(folder / RUNS, found.runs, about, force=force)
    files.write_table(folder / INDEX, found.frame, about, force=force)
    for kind in formats:
        files.write_bytes(folder / f"{PICTURE}.{kind}", draw(found.cells, plan, kind), force=force)
    files.write_page(folder / PAGE, page(found.cells, found.verdicts, plan), force=force)
    checkpoint.forget()
    return found


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder of results."""
    return Checkpoint(folder / "gathering.checkpoint")
