"""Tan's pursuit from runs to files: two tables, a picture and a page."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from teamsight import __version__
from teamsight.analysis.pursuit.figure import draw
from teamsight.analysis.pursuit.ledger import frame, rows
from teamsight.analysis.pursuit.page import page
from teamsight.analysis.pursuit.plan import Plan, simulate
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool

RUNS, LEDGER, PAGE, PICTURE = "pursuit.parquet", "pursuit-ledger.parquet", "pursuit.md", "pursuit.png"


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
    for name in (RUNS, LEDGER):
        files.check_replaceable(folder / name, {"pursuit": plan.conditions()}, force=force)
    for name in (PAGE, PICTURE):
        files.check_replaceable(folder / name, force=force)
    checkpoint_in(folder).check()


def make_results(
    plan: Plan,
    folder: Path,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    *,
    force: bool = False,
) -> pd.DataFrame:
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
    DataFrame
        See `simulate`.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check_results`.
    """
    check_results(plan, folder, force=force)
    checkpoint = checkpoint_in(folder)
    table = simulate(plan, pool, progress=lambda done, total: watch("simulating", done, total), checkpoint=checkpoint)
    about = {"pursuit": plan.conditions(), "version": __version__}
    files.write_table(folder / RUNS, table, about, force=force)
    files.write_table(folder / LEDGER, frame(rows(table)), about, force=force)
    files.write_bytes(folder / PICTURE, draw(table, plan), force=force)
    files.write_page(folder / PAGE, page(table, plan), force=force)
    checkpoint.forget()
    return table


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder of results."""
    return Checkpoint(folder / "pursuit.checkpoint")
