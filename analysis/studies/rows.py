"""The rows of a study's parts in the order of its plan, as tables of pandas."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.values import hex_of
from teamsight.analysis.studies.folder.run_set import runs_in
from teamsight.analysis.studies.part_tables import OWN_COLUMNS
from teamsight.analysis.studies.standing import Present, values_of

if TYPE_CHECKING:
    import pyarrow as pa

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


def scalars(values: Sequence[object]) -> list[object]:
    """Return values that tables can hold: lists and tables become JSON."""
    return [json.dumps(value) if isinstance(value, dict | list | tuple) else value for value in values]


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
