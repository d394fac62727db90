"""`open_study`: the runs of a study as tables, also while some are missing."""

from __future__ import annotations

import os
import warnings
from collections.abc import Collection, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import pandas as pd

from teamsight.analysis.studies import rows
from teamsight.analysis.studies.describe import conditions, described, described_in_html, what_is_missing
from teamsight.analysis.studies.study_tables import StudyTables

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


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
    runs = found.read("runs")
    recorded = study.record.steps or study.record.trajectories or study.record.events
    return StudyResults(found, study, runs, failed, found.lost() if recorded else None)


class StudyResults(StudyTables):
    """What a study has found so far; see `open_study`. All that it has is in the order of the plan.

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
        Numbers of runs. An adaptive study plans those that it needs as far as its runs show.
    lost : int
        Those of the missing runs whose measures are there, but not all that was recorded: a part is lost. They have
        rows in `frame`, and none in `steps`, `trajectories` or `events`, which warn.
    wide : int
        The number of settings of an adaptive study that have reached its limit with a wider interval than wanted.
    frame, settings : DataFrame
        One row for each run that is there, and one for each setting.
    """

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
            the mean; maximum. A setting without runs has n = 0 and NaN. The interval of numbers is Student's, which is
            infinite for one run, and may end beyond the bounds of a measure such as a fraction; that of a measure of
            True and False, whose mean is a rate, is Wilson's. The runs that fail are not counted: if failing depends on
            what is measured, the mean is that of the others.
        """
        found = self.statistics(self.measured(measure))
        return pd.concat([self.settings, found.set_index(self.settings.index)], axis=1)

    def to_xarray(self) -> xarray.Dataset:
        """Return the statistics of all measures as an xarray Dataset on the axes; needs the extra ``xarray``.

        Each axis is a dimension. Axes that advance together share one, named after the first; points and samples have
        the dimension "setting". A measure named m has the variables m (the mean), m_low and m_high (the ends of the
        95 % interval), m_maximum and m_n (the number of runs); without runs they are NaN. "failed" is the number of
        failed runs. Attributes name the study and what is missing.
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
        across: Collection[str] = (),
        where: Mapping[str, object] | None = None,
        force: bool = False,
    ) -> Figure:
        """Draw a measure over the axes.

        Parameters
        ----------
        out : path, optional
            A file to write: PNG, SVG or PDF by its suffix.
        kind : {"auto", "heat-map", "lines", "distribution", "scatter"}
            The kind of picture; "auto" chooses one that suits the axes.
        x, y : str, optional
            The axes along the picture's two directions; lines and distributions have a curve for each value of
            `y`. Further axes become panels.
        measure : str, optional
            What is drawn; the first measure by default.
        minus : StudyResults or path, optional
            A study that is subtracted, run by run under the same noise. It needs the same steps and model, and a
            parameter that one of the two varies must not have other values in the other.
        across : collection of str
            Parameters, or "model", in which runs that are subtracted may differ nevertheless.
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
        from teamsight.analysis.studies.figures.draw import check_picture, draw, save_picture

        if out is not None:
            check_picture(out, force=force)
        other = minus if isinstance(minus, StudyResults) or minus is None else open_study(minus)
        figure = draw(self, kind=kind, x=x, y=y, measure=measure, minus=other, across=across, where=where)
        if out is not None:
            save_picture(figure, out, self.name, force=force)
        return figure

    def _recorded(self, kind: str) -> pd.DataFrame:
        if not getattr(self.study.record, kind):
            raise ValueError(f"{kind}: were not recorded; set {kind} under [record] in a new study")
        found = rows.recorded(self._folder.read(kind), self.plan)
        if lost := self._folder.lost().size:
            warnings.warn(
                f"{kind}: rows of {lost:,} of {self.planned:,} runs may lack, since parts of what they recorded are "
                "lost; teamsight sweep makes them again",
                UserWarning, stacklevel=4,
            )  # fmt: skip
        return found

    @property
    def is_running(self) -> bool:
        """Whether a sweep fills the folder at this moment; `open_study` shows what it has made."""
        from teamsight.analysis.studies.folder.lock import holders

        return bool(holders(self.folder))

    def __repr__(self) -> str:
        return described(self, is_running=self.is_running)

    def _repr_html_(self) -> str:
        return described_in_html(self, is_running=self.is_running)
