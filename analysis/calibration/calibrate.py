"""Run a search by name, and write its table and its page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pandas as pd

from teamsight import __version__
from teamsight.analysis.calibration import lazy, lazy_page, model, model_page
from teamsight.analysis.calibration.search import Simulator
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.run import OUTCOMES
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool


class Search(NamedTuple):
    """A search over open constants.

    Attributes
    ----------
    stem : str
        Name of its two files, without the suffix.
    search : callable
        Takes a `Simulator` and returns the table: one row for each trial.
    page : callable
        Takes the table and returns the page in Markdown.
    """

    stem: str
    search: Callable[[Simulator], pd.DataFrame]
    page: Callable[[pd.DataFrame], str]


#: Every search by name.
SEARCHES: Mapping[str, Search] = MappingProxyType(
    {
        "model": Search("calibration", model.search, model_page.page),
        "lazy": Search("lazy-search", lazy.search, lazy_page.page),
    }
)


def calibrate(
    name: str,
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
    name : str
        A key of `SEARCHES`.
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
    checkpoint = checkpoint_in(folder, name)
    checkpoint.check()
    chosen = SEARCHES[name]
    table_file, page_file = folder / f"{chosen.stem}.parquet", folder / f"{chosen.stem}.md"
    for file in (table_file, page_file):
        files.check_replaceable(file, force=force)
    table = chosen.search(Simulator(pool, watch, checkpoint))
    files.write_table(table_file, table, {"version": __version__}, force=force)
    files.write_page(page_file, chosen.page(table), force=force)
    checkpoint.forget()
    return table_file, page_file


def checkpoint_in(folder: Path, name: str) -> Checkpoint:
    """Return the runs that an interrupted search left in a folder."""
    return Checkpoint(folder / f"{SEARCHES[name].stem}.checkpoint", OUTCOMES)
