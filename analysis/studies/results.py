"""The results of a study, or of a table of runs that a command wrote: tables of pandas, summaries and pictures."""

from __future__ import annotations

import contextlib
import html
import json
import os
import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.runs.files import read_table
from teamsight.analysis.studies.definition.values import hex_of, scalars
from teamsight.analysis.studies.folder.lock import holders
from teamsight.analysis.studies.folder.parts import read_parts, runs_in
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.shard import OWN_COLUMNS
from teamsight.analysis.studies.standing import Present, standing, values_of, wide_note
from teamsight.analysis.studies.summary import summarise
from teamsight.core import checks
from teamsight.core.extras import extra
from teamsight.core.version import __version__

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray
    from matplotlib.figure import Figure

    from teamsight.analysis.studies.folder.parts import RunSet
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

# Characters of the parameters that are fixed.
_LONGEST = 90
#: The dimension of settings that are listed or drawn one by one.
SETTING = "setting"
_KINDS = {"mean": ("", "mean"), "low": ("_low", "lower end of the 95 % interval of the mean"),
          "high": ("_high", "upper end of the 95 % interval of the mean"), "maximum": ("_maximum", "largest value"),
          "n": ("_n", "number of runs")}  # fmt: skip


def run_ids(table: pa.Table) -> pd.Index[str]:
    """Return the run id of each row as an index."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if not table.num_columns:
        return pd.Index([], dtype="str", name="run")
    joined = pc.binary_join_element_wise(table["setting"], table["replicate"].cast(pa.string()), "-")
    found: pd.Index[str] = pd.Index(joined.to_pandas(), name="run")
    return found


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
        found += [tuple(block.columns)] if _is_of_axes(study, block.columns) else [(name,) for name in block.columns]
    return tuple(found)


def _is_of_axes(study: Study, names: Iterable[str]) -> bool:
    """Whether parameters are axes rather than columns of points or of a sample."""
    return all(name in study.axes for name in names)


class Results:
    """Runs over settings, which can be read, summarised and drawn.

    Parameters
    ----------
    place : Path
        Where they were read.
    table : pyarrow.Table
        A row for each run.
    setting : ndarray of int64, shape (runs,)
        The row of `settings` of each run.
    settings : DataFrame
        A row for each setting, with a column for each axis.
    groups : sequence of sequence of str
        The axes; those that advance together in one group.
    measures : sequence of str
        Names of what was measured.
    """

    #: What was asked, if it is a study.
    study: Study | None = None

    def __init__(
        self, place: Path, table: pa.Table, setting: NDArray[np.int64], settings: pd.DataFrame,
        groups: Sequence[tuple[str, ...]], measures: Iterable[str],
    ) -> None:  # fmt: skip
        self._place, self._table = place, table
        self.setting_numbers, self.settings, self.groups = setting, settings, tuple(groups)
        self.axes: tuple[str, ...] = tuple(settings.columns)
        self.measures: tuple[str, ...] = tuple(measures)
        #: What is missing, on one line; empty if nothing is.
        self.warning = ""

    @property
    def name(self) -> str:
        """The name in titles."""
        return self._place.stem

    @property
    def source(self) -> str:
        """What was run and its conditions, on one line."""
        return self.name

    @cached_property
    def frame(self) -> pd.DataFrame:
        """One row for each run."""
        found: pd.DataFrame = self._table.to_pandas()
        return found

    @property
    def numeric(self) -> tuple[str, ...]:
        """The measures that are numbers or truth values."""
        import pyarrow as pa

        are_numbers = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean)
        kinds = {name: self._table.schema.field(name).type for name in self.measures}
        return tuple(name for name, kind in kinds.items() if any(is_one(kind) for is_one in are_numbers))

    def measured(self, measure: str | None = None) -> str:
        """Return the name of a measure of numbers; the first by default.

        Raises
        ------
        ValueError
            If there is no such measure, or it is a text.
        """
        if not self.measures:
            raise ValueError(f"{self._place}: no run is done yet; run teamsight sweep, or wait")
        if measure is None and self.numeric:
            return self.numeric[0]
        name = checks.choice("measure", measure or self.measures[0], self.measures)
        if name not in self.numeric:
            raise ValueError(f"measure={name}: is a text; give one of numbers: {', '.join(self.numeric) or 'none'}")
        return name

    def is_flag(self, measure: str) -> bool:
        """Whether a measure is True or False for each run."""
        import pyarrow as pa

        return bool(pa.types.is_boolean(self._table.schema.field(measure).type))

    def statistics(self, measure: str) -> pd.DataFrame:
        """Return n, mean, low, high and maximum of a measure for each row of `settings`."""
        values = self._table[measure].cast("float64").to_numpy()
        return summarise(values, self.setting_numbers, len(self.settings), are_flags=self.is_flag(measure))

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

    def plot(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        kind: str = "auto",
        x: str | None = None,
        y: str | None = None,
        measure: str | None = None,
        minus: Results | str | os.PathLike[str] | None = None,
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
        other = minus if isinstance(minus, Results) or minus is None else open_study(minus)
        figure = draw(self, kind=kind, x=x, y=y, measure=measure, minus=other, across=across, where=where)
        if out is not None:
            save_picture(figure, out, self.name, force=force)
        return figure

    def _lines(self) -> list[tuple[str, str]]:
        """Return what the repr and the table of notebooks say: names and texts."""
        levels = {group: len(self.settings[list(group)].drop_duplicates()) for group in self.groups}
        return [
            ("axes", "; ".join(f"{', '.join(group)} ({size:,})" for group, size in levels.items()) or "none"),
            ("measures", ", ".join(self.measures) or "none yet"),
        ]

    def __repr__(self) -> str:
        lines = [f"  {name}: {text}" for name, text in self._lines()]
        return "\n".join([f"{type(self).__name__} of {self.name!r}", *lines])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
            f"<td style='text-align:left'>{html.escape(text)}</td></tr>"
            for name, text in self._lines()
        )
        return f"<table><caption>{html.escape(self.name)}</caption>{rows}</table>"


class TableResults(Results):
    """A table of runs that a command wrote, as of ``teamsight reproduce tan1993``; see `open_study`.

    Axes are the columns that identify runs and vary. One that another decides forms a group with it.

    Parameters
    ----------
    path : Path
        The Parquet file.

    Attributes
    ----------
    path : Path
        The file.
    about : mapping of str to object
        The settings of the command.
    frame, settings : DataFrame
        One row for each run, and one for each setting.
    axes, measures : tuple of str
        Columns that identify runs and vary, and columns that were measured.

    Raises
    ------
    ValueError
        If no command of teamsight wrote it, or it does not say which of its columns were measured.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        table, found = read_table(path)
        names = table.column_names
        measures = found.pop("measures", ())
        if not measures or not {"seed", *measures} <= set(names):
            raise ValueError(
                f"{path}: is no table of runs that says what was measured; read it with pandas.read_parquet"
            )
        self.about: Mapping[str, Any] = found
        frame: pd.DataFrame = table.to_pandas()
        given = [name for name in names if name not in measures and name not in ("replicate", "seed", "steps")]
        # Lists, such as the points of a curve, are no axes.
        given = [name for name in given if not frame[name].map(np.ndim).any() and frame[name].nunique(dropna=False) > 1]
        groups: list[tuple[str, ...]] = []
        for name in given:
            of = next((one for one in groups if frame.groupby(one[0])[name].nunique(dropna=False).max() == 1), None)
            groups = [*groups, (name,)] if of is None else [(*one, name) if one == of else one for one in groups]
        settings = frame[given].drop_duplicates() if given else frame[given].head(1)
        setting = np.zeros(len(frame), np.int64)
        if given:
            setting[:] = frame.groupby(given, sort=False, dropna=False).ngroup()
        settings = settings.reset_index(drop=True).rename_axis("setting")
        super().__init__(path, table, setting, settings, groups, measures)

    def _lines(self) -> list[tuple[str, str]]:
        about = json.dumps(self.about, ensure_ascii=False)
        shown = about if len(about) <= _LONGEST else f"{about[: _LONGEST - 1]}…"
        return [("file", str(self.path)), ("settings", shown), *super()._lines(), ("runs", f"{len(self.frame):,}")]


# Any stands for `TableResults`: a type checker knows what a study has, and whose path it is it cannot know.
def open_study(path: str | os.PathLike[str]) -> StudyResults | Any:
    """Open the folder of a study, also one that is incomplete or that a sweep is still filling, or a table of runs.

    Parameters
    ----------
    path : path
        The folder that ``teamsight sweep`` or `Study.run` has made, or a Parquet file of runs that another command
        wrote, such as ``results/pursuit.parquet`` of ``teamsight reproduce tan1993``.

    Returns
    -------
    StudyResults or TableResults
        The runs that are there now; call `open_study` again to see later ones. A table of runs is read, summarised and
        drawn in the same way.

    Raises
    ------
    ValueError
        If it is neither, or a part of the study is damaged.
    """
    place = Path(path)
    if place.is_file():
        if place.suffix == ".toml":
            raise ValueError(f"{place}: is a study file; make its runs with teamsight sweep, and give their folder")
        return TableResults(place)
    if not place.exists():
        raise ValueError(f"{place}: does not exist; give the folder of a study, or a table of runs")
    found = StudyFolder(path)
    if not found.is_prepared and (tables := _tables_in(place)):
        raise ValueError(f"{place}: is not the folder of a study; give a table of runs that it holds: {tables}")
    study = found.study
    # What is made in the meantime is then at most in both, and counts as done. The folder's own `read` would leave such
    # runs out, for which it reads all parts of the others once more.
    failed = read_parts(found.path, "failed")
    runs = found.read("runs")
    recorded = study.record.steps or study.record.trajectories or study.record.events
    return StudyResults(found, study, runs, failed, found.lost() if recorded else None)


def _tables_in(folder: Path) -> str:
    """Return the names of the tables of runs in a folder."""
    found = []
    for file in sorted(folder.glob("*.parquet")):
        with contextlib.suppress(ValueError):
            found.append(TableResults(file).path.name)
    return ", ".join(found)


class StudyResults(Results):
    """What a study has found so far; see `open_study`. All that it has is in the order of the plan.

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

    def __init__(
        self, folder: StudyFolder, study: Study, runs: pa.Table, failed: pa.Table, lost: RunSet | None = None
    ) -> None:
        import pyarrow as pa

        self._folder = folder
        self.study: Study = study
        self.folder: Path = folder.path
        self.plan: Plan = study.plan()
        table, present = _together(study, self.plan, runs, failed)
        measures = [name for name in runs.column_names if name not in OWN_COLUMNS and name not in self.plan.names]
        real = [field.name for field in table.schema if pa.types.is_floating(field.type)]
        super().__init__(
            folder.path, table, present.setting, settings_of(self.plan, real), groups_of(study), measures
        )  # fmt: skip
        self._has_failed, there = present.has_failed, len(present.setting)
        if lost is not None:
            present = present.without(lost, self.plan)
        found = standing(study, self.plan, present)
        self.planned, self.done, self.failed, self.missing = found[2:]
        self.lost: int = there - len(present.setting)
        self.wide: int = int(found.is_wide.sum())
        of_failed = f", {self.failed:,} failed" * bool(self.failed) + f", parts of {self.lost:,} lost" * bool(self.lost)
        if self.missing:
            self.warning = f"partial: {self.done:,} of {self.planned:,} runs{of_failed}"
        elif of_failed:
            self.warning = f"{self.failed:,} of {self.planned:,} runs failed"

    @property
    def is_complete(self) -> bool:
        """Whether each planned run is done or has failed."""
        return not self.missing

    @property
    def name(self) -> str:
        """The name of the study, or else of its folder."""
        return self.study.name or self.folder.resolve().name

    @property
    def source(self) -> str:
        """The study and its conditions, on one line."""
        study = self.study
        fixed = ", ".join(f"{name} = {value}" for name, value in study.fixed.items())
        shown = fixed if len(fixed) <= _LONGEST else f"{fixed[: _LONGEST - 1]}…"
        model = "" if study.model == "cmommt" else f"{study.model}, "
        steps = f"{study.steps:,} {'step' if study.steps == 1 else 'steps'}"
        return f"{self.name}: {model}{shown}{', ' * bool(shown)}{steps}, seed {study.seed}"

    @cached_property
    def frame(self) -> pd.DataFrame:
        """One row for each run that is done or has failed, in the order of the plan; the index is the run id.

        Columns: the parameters, replicate, seed, steps, the measures, and error, which is None for runs that are done.
        The measures of a failed run are NaN.
        """
        table = self._table
        names = (*self.plan.names, "replicate", "seed", "steps", *self.measures)
        frame = pd.DataFrame({name: table[name].to_pandas() for name in names if name in table.column_names})
        # pandas would make NaN of None.
        frame["error"] = pd.Series([None] * table.num_rows, dtype=object)
        if self._has_failed.any():
            frame.loc[self._has_failed, "error"] = table.filter(self._has_failed)["error"].to_pylist()
        return frame.set_index(run_ids(table))

    @cached_property
    def failures(self) -> pd.DataFrame:
        """The failed runs: `frame` without measures, and with the traceback of each."""
        names = (*self.plan.names, "replicate", "seed", "steps", "error", "traceback")
        if not self._has_failed.any():
            return pd.DataFrame(columns=list(names))
        table = self._table.filter(self._has_failed)
        found: pd.DataFrame = table.select([name for name in names if name in table.column_names]).to_pandas()
        return found.set_index(run_ids(table))

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

    def _recorded(self, kind: str) -> pd.DataFrame:
        """Return what was recorded of each run in the order of the plan, by run id."""
        if not getattr(self.study.record, kind):
            raise ValueError(f"{kind}: were not recorded; set {kind} under [record] in a new study")
        table = self._folder.read(kind)
        if lost := self._folder.lost().size:
            warnings.warn(
                f"{kind}: rows of {lost:,} of {self.planned:,} runs may lack, since parts of what they recorded are "
                "lost; teamsight sweep makes them again",
                UserWarning, stacklevel=4,
            )  # fmt: skip
        if not table.num_columns:
            return pd.DataFrame(index=run_ids(table))
        setting = self.plan.index_of(runs_in(table).ids)
        # Stable: the rows of a run stay in their order.
        order = np.lexsort((table["replicate"].to_numpy(), setting))
        table = table.take(order[setting[order] >= 0])
        found: pd.DataFrame = table.to_pandas()
        return found.set_index(run_ids(table))

    def to_xarray(self) -> xarray.Dataset:
        """Return the statistics of all measures as an xarray Dataset on the axes; needs the extra ``xarray``.

        Each axis is a dimension. Axes that advance together share one, named after the first; points and samples have
        the dimension "setting". A measure named m has the variables m (the mean), m_low and m_high (the ends of the
        95 % interval), m_maximum and m_n (the number of runs); without runs they are NaN. "failed" is the number of
        failed runs. Attributes name the study and what is missing.

        Raises
        ------
        ModuleNotFoundError
            If xarray is not installed.
        """
        module = extra("xarray", "to_xarray", "xarray")
        blocks = self.study.blocks
        listed = [block for block in blocks if not _is_of_axes(self.study, block.columns)]
        dimensions: dict[str, int] = {}
        coordinates: dict[str, Any] = {}
        for block in blocks:
            dimension = next(iter(block.columns))
            if block in listed:
                # Points crossed with a sample: two dimensions need two names.
                dimension = SETTING if len(listed) == 1 else block.where
            dimensions[dimension] = block.size
            for axis in block.columns:
                levels = pd.Series(scalars(self.plan.values(axis)), dtype=self.settings[axis].dtype)
                coordinates[axis] = (dimension, levels.to_numpy())
        shape = tuple(dimensions.values())
        variables: dict[str, Any] = {}
        for measure in self.numeric:
            statistics = self.statistics(measure)
            for statistic, (suffix, words) in _KINDS.items():
                values = statistics[statistic].to_numpy().reshape(shape)
                about = {"long_name": f"{measure.replace('_', ' ')}: {words}"}
                variables[measure + suffix] = (tuple(dimensions), values, about)
        has_failed = self.frame["error"].notna().to_numpy()
        counts = np.bincount(self.setting_numbers[has_failed], minlength=self.plan.settings).reshape(shape)
        variables["failed"] = (tuple(dimensions), counts, {"long_name": "number of failed runs"})
        # Texts and numbers only, which netCDF can hold.
        attributes = {name: getattr(self, name) for name in ("planned", "done", "failed", "missing")}
        attributes |= {"study": json.dumps(self.study.as_dict()), "teamsight": __version__, "partial": self.warning}
        found: xarray.Dataset = module.Dataset(variables, coordinates, attributes)
        return found

    @property
    def is_running(self) -> bool:
        """Whether a sweep fills the folder at this moment; `open_study` shows what it has made."""
        return bool(holders(self.folder))

    def _lines(self) -> list[tuple[str, str]]:
        runs = f"{self.done:,} of {self.planned:,} done"
        if self.failed:
            runs += f", {self.failed:,} failed"
        if self.missing:
            how = "a sweep is running: open the study again" if self.is_running else "teamsight sweep continues"
            lost = f" (of {self.lost:,} a recorded part is lost)" if self.lost else ""
            runs += f", {self.missing:,} missing{lost}: {how}"
        wide = wide_note(self.wide, self.plan.settings, self.study.until)
        intervals = [("intervals", wide)] if wide else []
        return [("folder", str(self.folder)), *super()._lines(), ("runs", runs), *intervals]


def _together(study: Study, plan: Plan, runs: pa.Table, failed: pa.Table) -> tuple[pa.Table, Present]:
    """Return the runs that are done and those that have failed in the order of the plan, as one table and as counted.

    Runs that are not planned are left out. The measures of failed runs, and the errors of others, are null.
    """
    import pyarrow as pa

    tables = [table for table in (runs, failed) if table.num_columns]
    table = pa.concat_tables(tables, promote_options="permissive") if tables else pa.table({})
    found = runs_in(table)
    setting = plan.index_of(found.ids)
    # A run that is done may have failed before: of equal runs the first is kept.
    has_failed = np.arange(found.size) >= (runs.num_rows if runs.num_columns else 0)
    order = np.lexsort((has_failed, found.replicates, setting))
    order = order[setting[order] >= 0]
    same = np.zeros(len(order), bool)
    same[1:] = (np.diff(setting[order]) == 0) & (np.diff(found.replicates[order]) == 0)
    order = order[~same]
    if not np.array_equal(order, np.arange(table.num_rows)):
        table = table.take(order)
    measure = "" if study.until is None else study.until.measure
    return table, Present(setting[order], found.replicates[order], has_failed[order], *values_of(table, measure))
