"""Both sweeps from runs to files: two tables, two pictures and a page."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Watch, run_rows
from teamsight.analysis.unreliable.figure import draw
from teamsight.analysis.unreliable.page import page
from teamsight.analysis.unreliable.plan import SWEEPS, Plan
from teamsight.analysis.unreliable.points import points

RUNS, POINTS, PAGE = "unreliable.parquet", "unreliable-points.parquet", "unreliable.md"
_PICTURES = {f"unreliable-{sweep}.png": sweep for sweep in SWEEPS}


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
    names = (RUNS, POINTS, PAGE, *_PICTURES)
    about = {"unreliable": plan.conditions()}
    files.check_results(folder, names, about, checkpoint=checkpoint_in(folder), force=force)


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
        One row for each run, see `Plan.planned`; and `points`.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check_results`.
    """
    check_results(plan, folder, force=force)
    checkpoint = checkpoint_in(folder)
    table = run_rows(
        plan.planned(), pool, progress=lambda done, total: watch("simulating", done, total), checkpoint=checkpoint
    )
    found = points(table, plan)
    pictures = {name: draw(found, sweep, plan) for name, sweep in _PICTURES.items()}
    contents: dict[str, files.Content] = {RUNS: table, POINTS: found, **pictures, PAGE: page(table, found, plan)}
    files.write_results(folder, contents, {"unreliable": plan.conditions()}, force=force)
    checkpoint.forget()
    return table, found


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder of results."""
    return Checkpoint(folder / "unreliable.checkpoint")
