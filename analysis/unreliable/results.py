"""Both sweeps from runs to files: two tables, two pictures and a page."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from teamsight import __version__
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.analysis.unreliable.figure import draw
from teamsight.analysis.unreliable.page import page
from teamsight.analysis.unreliable.plan import MEASURED, SWEEPS, Plan, simulate
from teamsight.analysis.unreliable.points import points

RUNS, POINTS, PAGE = "unreliable.parquet", "unreliable-points.parquet", "unreliable.md"


def check_results(plan: Plan, folder: Path, *, force: bool = False) -> None:
    """Raise an error if a file in the folder must not be replaced by a result or by the checkpoint.

    Parameters
    ----------
    plan : Plan
        What to simulate.
    folder : Path
        Where to write.
    force : bool
        Replace any regular file by a result.

    Raises
    ------
    ValueError
        If there is such a file.
    """
    for name in (RUNS, POINTS):
        files.check_replaceable(folder / name, {"unreliable": plan.conditions()}, force=force)
    for name in (PAGE, *(f"unreliable-{sweep}.png" for sweep in SWEEPS)):
        files.check_replaceable(folder / name, force=force)
    checkpoint_in(folder).check()


def make_results(
    plan: Plan,
    folder: Path,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    *,
    force: bool = False,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Simulate, draw and write all results to a folder. After an interruption, the same call resumes.

    Parameters
    ----------
    plan : Plan
        What to simulate.
    folder : Path
        An existing folder.
    pool : WorkerPool, optional
        Processes that do the work. Results do not depend on it.
    watch : callable
        Called with the phase, the work done in it and its work in all.
    force : bool
        Replace any regular file by a result.

    Returns
    -------
    table, points : DataFrame
        See `simulate` and `points`.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check_results`.
    """
    check_results(plan, folder, force=force)
    checkpoint = checkpoint_in(folder)
    table = simulate(plan, pool, progress=lambda done, total: watch("simulating", done, total), checkpoint=checkpoint)
    found = points(table)
    about = {"unreliable": plan.conditions(), "version": __version__}
    files.write_table(folder / RUNS, table, about, force=force)
    files.write_table(folder / POINTS, found, about, force=force)
    for sweep in SWEEPS:
        files.write_bytes(folder / f"unreliable-{sweep}.png", draw(found, sweep, plan), force=force)
    files.write_page(folder / PAGE, page(table, found, plan), force=force)
    checkpoint.forget()
    return table, found


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder of results."""
    return Checkpoint(folder / "unreliable.checkpoint", MEASURED)
