"""The results of a study as tables of pandas, and what is summarised of them."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.values import hex_of, scalars
from teamsight.analysis.studies.describe import conditions, described, described_in_html, what_is_missing
from teamsight.analysis.studies.folder.parts import runs_in
from teamsight.analysis.studies.shard import OWN_COLUMNS
from teamsight.analysis.studies.standing import Present, standing, values_of
from teamsight.analysis.studies.summary import summarise
from teamsight.core import checks
from teamsight.core.extras import extra
from teamsight.core.version import __version__

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray
    from matplotlib.figure import Figure

    from teamsight.analysis.studies.folder.parts import RunSet
    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

class Made(NamedTuple):
    """Runs that are done or have failed, in the order of the plan.

    Attributes
    ----------
    table : pyarrow.Table
        Their rows; the measures of failed runs, and the errors of others, are null.
    setting, replicate : ndarray of int64, shape (runs,)
        The number of the setting in the plan, and of the run.
    has_failed : ndarray of bool, shape (runs,)
        Whether each has failed.
    """

    table: pa.Table
    setting: NDArray[np.int64]
    replicate: NDArray[np.int64]
    has_failed: NDArray[np.bool_]

    @property
    def failed(self) -> int:
        """How many have failed."""
        return int(self.has_failed.sum())


def measures_of(runs: pa.Table, parameters: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the columns that are measures."""
    return tuple(name for name in runs.column_names if name not in OWN_COLUMNS and name not in parameters)


def together(runs: pa.Table, failed: pa.Table, plan: Plan) -> Made:
    """Return the runs that are done and those that have failed as one table; runs that are not planned are left out."""
    import pyarrow as pa

    tables = [table for table in (runs, failed) if table.num_columns]
    if not tables:
        nothing = np.empty(0, np.int64)
        return Made(pa.table({}), nothing, nothing, np.empty(0, bool))
    table = pa.concat_tables(tables, promote_options="permissive")
    setting = plan.index_of(runs_in(table).ids)
    replicate = table["replicate"].to_numpy().astype(np.int64)
    # A run that is done may have failed before: of equal runs the first is kept.
    has_failed = np.arange(len(setting)) >= (runs.num_rows if runs.num_columns else 0)
    order = np.lexsort((has_failed, replicate, setting))
    order = order[setting[order] >= 0]
    same = np.zeros(len(order), bool)
    same[1:] = (np.diff(setting[order]) == 0) & (np.diff(replicate[order]) == 0)
    order = order[~same]
    if not np.array_equal(order, np.arange(table.num_rows)):
        table = table.take(order)
    return Made(table, setting[order], replicate[order], has_failed[order])


def run_ids(table: pa.Table) -> pd.Index[str]:
    """Return the run id of each row as an index."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if not table.num_columns:
        return pd.Index([], dtype="str", name="run")
    joined = pc.binary_join_element_wise(table["setting"], table["replicate"].cast(pa.string()), "-")
    found: pd.Index[str] = pd.Index(joined.to_pandas(), name="run")
    return found


def frame_of(made: Made, parameters: Sequence[str], measures: Sequence[str]) -> pd.DataFrame:
    """Return one row for each run: parameters, replicate, seed, steps, measures and error; see `StudyResults.frame`."""
    table = made.table
    names = [name for name in (*parameters, "replicate", "seed", "steps", *measures) if name in table.column_names]
    frame = pd.DataFrame({name: table[name].to_pandas() for name in names})
    errors = np.full(table.num_rows, None, object)
    if made.failed:
        errors[:] = table["error"].to_pylist()
    frame["error"] = pd.Series(errors, dtype=object)
    return frame.set_index(run_ids(table))


def failures_of(made: Made, parameters: Sequence[str]) -> pd.DataFrame:
    """Return one row for each failed run; see `StudyResults.failures`."""
    import pyarrow.compute as pc

    table = made.table
    if not made.failed:
        return pd.DataFrame(columns=[*parameters, "replicate", "seed", "steps", "error", "traceback"])
    table = table.filter(pc.is_valid(table["error"]))
    names = (*parameters, "replicate", "seed", "steps", "error", "traceback")
    found: pd.DataFrame = table.select([name for name in names if name in table.column_names]).to_pandas()
    return found.set_index(run_ids(table))


def numeric_measures(table: pa.Table, measures: Sequence[str]) -> tuple[str, ...]:
    """Return the measures that are numbers or truth values."""
    import pyarrow as pa

    def is_number(kind: pa.DataType) -> bool:
        return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind))

    return tuple(name for name in measures if is_number(table.schema.field(name).type))


def is_flag(table: pa.Table, measure: str) -> bool:
    """Whether a measure is a truth value."""
    import pyarrow as pa

    return bool(pa.types.is_boolean(table.schema.field(measure).type))


def numbers(table: pa.Table, measure: str) -> NDArray[np.float64]:
    """Return a measure of all runs; NaN for failed ones."""
    import pyarrow as pa

    found: NDArray[np.float64] = table[measure].cast(pa.float64()).to_numpy()
    return found


def real_columns(table: pa.Table) -> frozenset[str]:
    """Return the names of the columns of real numbers."""
    import pyarrow as pa

    return frozenset(field.name for field in table.schema if pa.types.is_floating(field.type))


def settings_of(plan: Plan, real: Collection[str] = ()) -> pd.DataFrame:
    """Return one row for each setting: its axes; see `StudyResults.settings`.

    Parameters
    ----------
    plan : Plan
        All runs.
    real : collection of str
        Axes of real numbers, even if all of their values are whole.
    """
    columns = {}
    for name in plan.swept:
        values = pd.Series(scalars(plan.values(name)))
        columns[name] = (values.astype(float) if name in real else values).take(plan.places(name)).array
    index = pd.Index(list(map(hex_of, plan.ids.tolist())), name="setting", dtype="str")
    return pd.DataFrame(columns, index=index)


def groups_of(study: Study) -> tuple[tuple[str, ...], ...]:
    """Return the axes of a study; those that advance together in one group, columns of points and samples alone."""
    found: list[tuple[str, ...]] = []
    for block in study.blocks:
        found += [tuple(block.columns)] if is_of_axes(study, block.columns) else [(name,) for name in block.columns]
    return tuple(found)


def is_of_axes(study: Study, names: Iterable[str]) -> bool:
    """Whether parameters are axes rather than columns of points or of a sample."""
    return all(name in study.axes for name in names)


def present_of(study: Study, made: Made) -> Present:
    """Return the runs as `standing` counts them."""
    measure = "" if study.until is None else study.until.measure
    return Present(made.setting, made.replicate, made.has_failed, *values_of(made.table, measure))


def recorded(table: pa.Table, plan: Plan) -> pd.DataFrame:
    """Return what was recorded of each run in the order of the plan, by run id."""
    if not table.num_columns:
        return pd.DataFrame(index=run_ids(table))
    setting = plan.index_of(runs_in(table).ids)
    # Stable: the rows of a run stay in their order.
    order = np.lexsort((table["replicate"].to_numpy(), setting))
    order = order[setting[order] >= 0]
    table = table.take(order)
    found: pd.DataFrame = table.to_pandas()
    return found.set_index(run_ids(table))


class StudyTables:
    """What a study has found so far, as tables; `StudyResults` explains the attributes.

    Parameters
    ----------
    folder : StudyFolder
        Where it is.
    study : Study
        What was asked.
    runs, failed : pyarrow.Table
        Rows of the runs that are done, and of those that have failed.
    lost : RunSet, optional
        Those of the runs that are done of which a part beside them is lost.
    """

    def __init__(
        self, folder: StudyFolder, study: Study, runs: pa.Table, failed: pa.Table, lost: RunSet | None = None
    ) -> None:
        self._folder = folder
        self.study: Study = study
        self.folder: Path = folder.path
        self.plan: Plan = study.plan()
        self.axes: tuple[str, ...] = self.plan.swept
        self.measures: tuple[str, ...] = measures_of(runs, self.plan.names)
        self._made = together(runs, failed, self.plan)
        there = present_of(study, self._made)
        present = there if lost is None else there.without(lost, self.plan)
        found = standing(study, self.plan, present)
        self.planned: int = found.planned
        self.done: int = found.done
        self.failed: int = found.failed
        self.missing: int = found.missing
        self.lost: int = len(there.setting) - len(present.setting)
        self.wide: int = int(found.is_wide.sum())

    @property
    def is_complete(self) -> bool:
        """Whether each planned run is done or has failed."""
        return not self.missing

    @property
    def name(self) -> str:
        """The name of the study, or else of its folder."""
        return self.study.name or self.folder.resolve().name

    @cached_property
    def frame(self) -> pd.DataFrame:
        """One row for each run that is done or has failed, in the order of the plan; the index is the run id.

        Columns: the parameters, replicate, seed, steps, the measures, and error, which is None for runs that are done.
        The measures of a failed run are NaN.
        """
        return frame_of(self._made, self.plan.names, self.measures)

    @cached_property
    def settings(self) -> pd.DataFrame:
        """One row for each setting, with or without runs, in the order of the plan: its axes; the index is its id."""
        return settings_of(self.plan, real_columns(self._made.table))

    @property
    def setting_numbers(self) -> NDArray[np.int64]:
        """The row of `settings` of each row of `frame`, (runs,)."""
        return self._made.setting

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """The axes; those that advance together in one group."""
        return groups_of(self.study)

    @property
    def numeric(self) -> tuple[str, ...]:
        """The measures that are numbers or truth values."""
        return numeric_measures(self._made.table, self.measures)

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

    def statistics(self, measure: str) -> pd.DataFrame:
        """Return n, mean, low, high and maximum of a measure for each row of `settings`."""
        values = numbers(self._made.table, measure)
        return summarise(values, self._made.setting, self.plan.settings, are_flags=self.is_flag(measure))

    def is_flag(self, measure: str) -> bool:
        """Whether a measure is True or False for each run."""
        return is_flag(self._made.table, measure)


#: The dimension of settings that are listed or drawn one by one.
SETTING = "setting"
_KINDS = {"mean": ("", "mean"), "low": ("_low", "lower end of the 95 % interval of the mean"),
          "high": ("_high", "upper end of the 95 % interval of the mean"), "maximum": ("_maximum", "largest value"),
          "n": ("_n", "number of runs")}  # fmt: skip


def to_xarray(results: StudyTables) -> xarray.Dataset:
    """Return the statistics of all measures; see `StudyResults.to_xarray`.

    Raises
    ------
    ModuleNotFoundError
        If xarray is not installed.
    """
    module = extra("xarray", "to_xarray", "xarray")
    dimensions, coordinates = _dimensions(results)
    shape = tuple(dimensions.values())
    variables: dict[str, Any] = {}
    made = results.setting_numbers
    for measure in results.numeric:
        statistics = results.statistics(measure)
        for statistic, (suffix, words) in _KINDS.items():
            values = statistics[statistic].to_numpy().reshape(shape)
            about = {"long_name": f"{measure.replace('_', ' ')}: {words}"}
            variables[measure + suffix] = (tuple(dimensions), values, about)
    failed = results.frame["error"].notna().to_numpy()
    counts = np.bincount(made[failed], minlength=results.plan.settings).reshape(shape)
    variables["failed"] = (tuple(dimensions), counts, {"long_name": "number of failed runs"})
    found: xarray.Dataset = module.Dataset(variables, coordinates, _attributes(results))
    return found


def _dimensions(results: StudyTables) -> tuple[dict[str, int], dict[str, Any]]:
    """Return the size of each dimension, and the coordinates along them."""
    study = results.study
    listed = [block for block in study.blocks if not is_of_axes(study, block.columns)]
    dimensions: dict[str, int] = {}
    coordinates: dict[str, Any] = {}
    for block in study.blocks:
        name = next(iter(block.columns))
        if block in listed:
            # Points crossed with a sample: two dimensions need two names.
            name = SETTING if len(listed) == 1 else block.where
        dimensions[name] = block.size
        for axis in block.columns:
            values = pd.Series(scalars(results.plan.values(axis)), dtype=results.settings[axis].dtype)
            coordinates[axis] = (name, values.to_numpy())
    return dimensions, coordinates


def _attributes(results: StudyTables) -> dict[str, Any]:
    # Texts and numbers only, which netCDF can hold.
    return {
        "study": json.dumps(results.study.as_dict()), "teamsight": __version__, "planned": results.planned,
        "done": results.done, "failed": results.failed, "missing": results.missing,
        "partial": what_is_missing(results),
    }  # fmt: skip


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
    from teamsight.analysis.studies.folder.parts import read_parts
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
        return failures_of(self._made, self.plan.names)

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
        found = recorded(self._folder.read(kind), self.plan)
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
