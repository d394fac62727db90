"""`open_study`: the runs of a study as tables, also while some are missing."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.studies import rows
from teamsight.analysis.studies.describe import conditions, described, described_in_html, what_is_missing
from teamsight.analysis.studies.summary import summarise
from teamsight.core import checks

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray
    from matplotlib.figure import Figure

    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.analysis.studies.plan import Plan
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
    from teamsight.analysis.studies.folder.reading import read_parts
    from teamsight.analysis.studies.folder.study_folder import StudyFolder

    found = StudyFolder(folder)
    study = found.study
    # What is made in the meantime is then at most in both, and counts as done. The folder's own `read` would leave such
    # runs out, for which it reads all parts of the others once more.
    failed = read_parts(found.path, "failed")
    return StudyResults(found, study, found.read("runs"), failed)


class StudyResults:
    """What a study has found so far; see `open_study`.

    Parameters
    ----------
    folder : StudyFolder
        Where it is.
    study : Study
        What was asked.
    runs, failed : pyarrow.Table
        Rows of the runs that are done, and of those that have failed.

    Attributes
    ----------
    study : Study
        What was asked.
    plan : Plan
        All its runs.
    folder : Path
        Where it was read.
    axes : tuple of str
        Names of the parameters that vary.
    measures : tuple of str
        Names of what was measured; none before the first run is done.
    planned, done, failed, missing : int
        Numbers of runs. An adaptive study plans those that it needs as far as its runs tell.
    """

    def __init__(self, folder: StudyFolder, study: Study, runs: pa.Table, failed: pa.Table) -> None:
        self._folder = folder
        self.study: Study = study
        self.folder: Path = folder.path
        self.plan: Plan = study.plan()
        self.axes: tuple[str, ...] = self.plan.swept
        self.measures: tuple[str, ...] = rows.measures_of(runs, self.plan.names)
        self._made = rows.together(runs, failed, self.plan)
        self.failed: int = self._made.failed
        self.done: int = self._made.table.num_rows - self.failed
        self.planned, self.missing = rows.planned_and_missing(study, self.plan, self._made)

    @property
    def is_complete(self) -> bool:
        """Whether each planned run is done or has failed."""
        return not self.missing

    @cached_property
    def frame(self) -> pd.DataFrame:
        """One row for each run that is done or has failed, in the order of the plan; the index is the run id.

        Columns: the parameters, replicate, seed, steps, the measures, and error, which is None for runs that are done.
        The measures of a failed run are NaN.
        """
        return rows.frame_of(self._made, self.plan.names, self.measures)

    @cached_property
    def settings(self) -> pd.DataFrame:
        """One row for each setting, with or without runs, in the order of the plan: its axes; the index is its id."""
        return rows.settings_of(self.plan)

    @property
    def setting_numbers(self) -> NDArray[np.int64]:
        """The row of `settings` of each row of `frame`, (runs,)."""
        return self._made.setting

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """The axes; those that advance together in one group."""
        return rows.groups_of(self.study)

    @property
    def numeric(self) -> tuple[str, ...]:
        """The measures that are numbers or truth values."""
        return rows.numeric_measures(self._made.table, self.measures)

    def measured(self, measure: str | None = None) -> str:
        """Return the name of a measure of numbers; the first by default.

        Raises
        ------
        ValueError
            If there is no such measure, or it is a text.
        """
        if not self.measures:
            raise ValueError(f"{self.folder}: no run is done yet; run teamsight sweep, or wait")
        if measure is None and self.numeric:
            return self.numeric[0]
        name = checks.choice("measure", measure or self.measures[0], self.measures)
        if name not in self.numeric:
            raise ValueError(f"measure={name}: is a text; give one of numbers: {', '.join(self.numeric) or 'none'}")
        return name

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
        found = self.statistics(self.measured(measure))
        return pd.concat([self.settings, found.set_index(self.settings.index)], axis=1)

    def statistics(self, measure: str) -> pd.DataFrame:
        """Return n, mean, low, high and maximum of a measure for each row of `settings`."""
        values = rows.numbers(self._made.table, measure)
        return summarise(values, self._made.setting, self.plan.settings)

    def to_xarray(self) -> xarray.Dataset:
        """Return the statistics of all measures as an xarray Dataset on the axes; needs the extra ``xarray``.

        Each axis is a dimension. Axes that advance together share one, named after the first; points and samples have
        the dimension "setting". A measure named m has the variables m (the mean), m_low and m_high (the ends of the
        95 % interval), m_maximum and m_n (the number of runs); without runs they are NaN. "failed" is the number of
        failed runs. Attributes name the study and say what is missing.
        """
        from teamsight.analysis.studies.to_xarray import to_xarray

        return to_xarray(self)

    @cached_property
    def steps(self) -> pd.DataFrame:
        """The history of each run, if it was recorded; the index is the run id."""
        return self._recorded("steps")

    @cached_property
    def trajectories(self) -> pd.DataFrame:
        """The positions of each run, if they were recorded; the index is the run id."""
        return self._recorded("trajectories")

    @cached_property
    def events(self) -> pd.DataFrame:
        """The events of each run, if they were recorded; the index is the run id."""
        return self._recorded("events")

    @cached_property
    def failures(self) -> pd.DataFrame:
        """The failed runs: `frame` without measures, and with the traceback of each."""
        return rows.failures_of(self._made, self.plan.names)

    @property
    def name(self) -> str:
        """The name of the study, or else of its folder."""
        return self.study.name or self.folder.resolve().name

    @property
    def source(self) -> str:
        """The study and its conditions, on one line."""
        return conditions(self)

    @property
    def warning(self) -> str:
        """What is missing, on one line; empty if nothing is."""
        return what_is_missing(self)

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
        """Draw a measure over the axes.

        Parameters
        ----------
        out : path, optional
            A file to write: PNG, SVG or PDF by its suffix.
        kind : {"auto", "heat-map", "lines", "surface", "scatter", "runs"}
            The kind of picture; "auto" chooses one that suits the axes.
        x, y : str, optional
            The axes along the picture's two directions; lines have a line for each value of `y`. Further axes become
            panels.
        measure : str, optional
            What is drawn; the first measure by default.
        minus : StudyResults or path, optional
            A study that is subtracted, run by run under the same noise.
        where : mapping, optional
            Values of axes; only settings with these values are drawn.
        force : bool
            Replace a file that teamsight did not write.

        Returns
        -------
        matplotlib Figure
            The picture.

        Raises
        ------
        ValueError
            If there is nothing to draw, the axes do not suit the kind, or the file cannot be written.
        """
        from teamsight.analysis.studies.figures.draw import draw
        from teamsight.analysis.studies.figures.save import check_picture, save_picture

        if out is not None:
            check_picture(out, force=force)
        other = minus if isinstance(minus, StudyResults) or minus is None else open_study(minus)
        figure = draw(self, kind=kind, x=x, y=y, measure=measure, minus=other, where=where)
        if out is not None:
            save_picture(figure, out, self.name, force=force)
        return figure

    def _recorded(self, kind: str) -> pd.DataFrame:
        if not getattr(self.study.record, kind):
            raise ValueError(f"{kind}: were not recorded; set {kind} under [record] in a new study")
        return rows.recorded(self._folder.read(kind), self.plan)

    def __repr__(self) -> str:
        return described(self)

    def _repr_html_(self) -> str:
        return described_in_html(self)
