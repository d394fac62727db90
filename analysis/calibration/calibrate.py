"""Run the search, and write its table and its page."""

from __future__ import annotations

from pathlib import Path

from teamsight import __version__
from teamsight.analysis.calibration import model, model_page
from teamsight.analysis.calibration.search import Simulator
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import OUTCOMES
from teamsight.analysis.runs.simulate import Watch


def calibrate(
    folder: Path,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    *,
    force: bool = False,
) -> tuple[Path, Path]:
    """Search, write the table of all trials and the page about them, and return the two files.

    After an interruption, the same call resumes.

    Parameters
    ----------
    folder : Path
        An existing folder.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    watch : callable
        Called with the phase, the work done in it and its work in all.
    force : bool
        Replace files that teamsight did not write.

    Raises
    ------
    ValueError
        If a file in `folder` must not be replaced.
    """
    checkpoint = checkpoint_in(folder)
    checkpoint.check()
    table_file, page_file = folder / "calibration.parquet", folder / "calibration.md"
    for file in (table_file, page_file):
        files.check_replaceable(file, force=force)
    table = model.search(Simulator(pool, watch, checkpoint))
    files.write_table(table_file, table, {"version": __version__}, force=force)
    files.write_page(page_file, model_page.page(table), force=force)
    checkpoint.forget()
    return table_file, page_file


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted search left in a folder."""
    return Checkpoint(folder / "calibration.checkpoint", OUTCOMES)
