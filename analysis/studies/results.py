"""`open_study`: the runs of a study as tables, also while some are missing."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from teamsight.analysis.studies.study import Study


def open_study(folder: str | os.PathLike[str]) -> StudyResults:
    """Open the folder of a study, also one that is incomplete or that a sweep is still filling.

    Parameters
    ----------
    folder : path
        The folder that ``teamsight sweep`` or `Study.run` has made.

    Returns
    -------
    StudyResults
        The runs that are there now; call `open_study` again to see later ones.

    Raises
    ------
    ValueError
        If it is not the folder of a study, or a part of it is damaged.
    """
    raise NotImplementedError


class StudyResults:
    """What a study has found so far.

    Attributes
    ----------
    study : Study
        What was asked.
    folder : Path
        Where it was read.
    axes : tuple of str
        Names of the parameters that vary.
    measures : tuple of str
        Names of what was measured.
    planned, done, failed, missing : int
        Numbers of runs.
    """

    study: Study
    folder: Path
    axes: tuple[str, ...]
    measures: tuple[str, ...]
    planned: int
    done: int
    failed: int
    missing: int

    @property
    def is_complete(self) -> bool:
        """Whether each planned run is done or has failed."""
        return not self.missing

    @cached_property
    def frame(self) -> pd.DataFrame:
        """One row for each run that is done or has failed, in the order of the plan, by run id.

        Columns: the parameters, replicate, seed, steps, the measures, and error, which is None for runs that are done.
        The measures of a failed run are NaN.
        """
        raise NotImplementedError

    def summary(self, measure: str | None = None) -> pd.DataFrame:
        """Return the statistics of a measure, one row for each setting, by setting id.

        Parameters
        ----------
        measure : str, optional
            Name of the measure; the first by default.

        Returns
        -------
        DataFrame
            Columns: the axes; n, the number of runs with a value; mean; low and high, the ends of the 95 % interval of
            the mean; maximum. A setting without runs has n = 0 and NaN, and one run has an infinite interval.
        """
        raise NotImplementedError

    def to_xarray(self) -> xarray.Dataset:
        """Return the statistics of all measures as an xarray Dataset on the axes; needs ``teamsight[xarray]``."""
        raise NotImplementedError

    @property
    def steps(self) -> pd.DataFrame:
        """The history of each run, if it was recorded: setting, replicate, step and the columns of the history."""
        raise NotImplementedError

    @property
    def trajectories(self) -> pd.DataFrame:
        """The positions of each run, if they were recorded."""
        raise NotImplementedError

    @property
    def events(self) -> pd.DataFrame:
        """The events of each run, if they were recorded."""
        raise NotImplementedError

    def plot(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        kind: str = "auto",
        x: str | None = None,
        y: str | None = None,
        measure: str | None = None,
        minus: StudyResults | str | os.PathLike[str] | None = None,
        where: Mapping[str, object] | None = None,
        force: bool = False,
    ) -> Figure:
        """Draw a measure over the axes; see `teamsight.analysis.studies.figures.draw.draw`."""
        raise NotImplementedError
