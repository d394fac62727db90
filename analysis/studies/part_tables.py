"""The tables of a shard: rows are collected as lists, and written as Parquet files whose bytes depend on them alone."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from teamsight.analysis.studies.definition.values import stored
from teamsight.analysis.studies.failure import Failure, one_line
from teamsight.analysis.studies.folder import parts as part_files
from teamsight.analysis.studies.measured import WORDS, Kind

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from teamsight.analysis.studies.recording import MadeRun
    from teamsight.analysis.studies.shard_run import ShardRun

#: What each column holds, by name.
Types = Mapping[str, str]
Kinds = dict[str, Kind]

#: Columns of runs and failed runs that are neither parameters nor measures.
OWN_COLUMNS = frozenset({"run", "setting", "replicate", "seed", "steps", "error", "traceback"})
#: Columns of the event log that are no details of an event.
OWN_COLUMNS_OF_EVENTS = frozenset({"setting", "replicate", "time", "tick", "what", "group", "agent", "source"})
#: What the names of events' details begin with among the kinds of columns.
DETAIL = "events/"


class PartTables:
    """Collects the rows of a shard.

    Parameters
    ----------
    types : dict of str to str
        What the column of each parameter holds: "int", "number", "flag" or "text".
    steps : int
        Steps of each run.
    known : dict of str to str
        What measured columns hold in other parts of the study; a run with other values fails.

    Attributes
    ----------
    done : int
        Number of runs that did not fail.
    failed : list of (str, str)
        Id and error of each run that failed.
    """

    def __init__(self, types: Types, steps: int, known: Mapping[str, Kind]) -> None:
        self._types, self._steps, self._known = types, steps, dict(known)
        self._last: Kinds | None = None
        self._runs: list[tuple[ShardRun, dict[str, Any]]] = []
        self._failures: list[tuple[ShardRun, Failure]] = []
        self._kinds: Kinds = {}
        self._tables: dict[str, list[pa.Table]] = {}

    @property
    def done(self) -> int:
        """Number of runs that did not fail."""
        return len(self._runs)

    @property
    def failed(self) -> list[tuple[str, str]]:
        """Id and error of each run that failed."""
        return [(run.id, failure.error) for run, failure in self._failures]

    @property
    def kinds(self) -> Kinds:
        """What each measured column holds, and each detail of events, as in "events/colour"."""
        return self._kinds

    def add_run(self, run: ShardRun, made: MadeRun) -> None:
        """Add a run; it fails if a column of other runs holds values of another kind."""
        try:
            tables = {kind: _rows_of(run, kind, frame) for kind, frame in made.tables.items()}
            self._take_note({**made.measured.kinds, **_details(tables)})
        except (ValueError, TypeError, NotImplementedError) as error:  # Arrow raises all three
            self.add_failure(run, Failure(one_line(str(error)), ""))
            return
        self._runs.append((run, made.measured.values))
        for kind, table in tables.items():
            self._tables.setdefault(kind, []).append(table)

    def _take_note(self, kinds: Kinds) -> None:
        """Check what the columns of a run hold against those of other runs."""
        if kinds != self._last:
            self._known = merged(self._known, kinds)
            # Apart from those of other shards: the bytes of a part are a function of its runs.
            self._kinds = merged(self._kinds, kinds)
            self._last = kinds

    def add_failure(self, run: ShardRun, failure: Failure) -> None:
        """Add a run that failed."""
        self._failures.append((run, failure))

    def parts(self) -> dict[str, bytes]:
        """Return a Parquet file for each kind of rows that there are."""
        import pyarrow as pa

        found = {}
        for kind, tables in self._tables.items():
            # What a run does not have is null.
            table = pa.concat_tables(tables, promote_options="default")
            if table.num_rows:
                found[kind] = _parquet(table)
        if self._failures:
            runs = [run for run, _ in self._failures]
            found["failed"] = _parquet(
                pa.table(
                    {
                        "run": pa.array([run.id for run in runs], pa.string()),
                        **self._columns(runs),
                        "error": pa.array([failure.error for _, failure in self._failures], pa.string()),
                        "traceback": pa.array([failure.traceback for _, failure in self._failures], pa.string()),
                    }
                )
            )
        # Last, since it is this part that makes the runs done. It says which parts were written beside it.
        if self._runs:
            measured = {
                name: pa.array([values.get(name) for _, values in self._runs], _type(kind))
                for name, kind in self._kinds.items()
                if not name.startswith(DETAIL)
            }
            beside = {kind: part_files.digest(content) for kind, content in found.items() if kind != "failed"}
            metadata = {part_files.BESIDE: json.dumps(beside), part_files.HOLDS: json.dumps(self._kinds)}
            table = pa.table({**self._columns([run for run, _ in self._runs]), **measured})
            found["runs"] = _parquet(table, metadata)
        return found

    def _columns(self, runs: list[ShardRun]) -> dict[str, pa.Array]:
        """Return the columns that identify runs."""
        import pyarrow as pa

        return {
            "setting": pa.array([run.setting for run in runs], pa.string()),
            **{
                name: pa.array([stored(run.parameters[name], kind) for run in runs], _type(kind))
                for name, kind in self._types.items()
            },
            "replicate": pa.array([run.replicate for run in runs], pa.int64()),
            "seed": pa.array([run.seed for run in runs], pa.int64()),
            "steps": pa.array([self._steps] * len(runs), pa.int64()),
        }


def merged(known: Mapping[str, Kind], kinds: Mapping[str, Kind]) -> Kinds:
    """Return what columns hold, with those of further runs.

    Raises
    ------
    ValueError
        If a column would hold two kinds of values.
    """
    found = dict(known)
    for name, kind in kinds.items():
        before = found.get(name)
        if before is not None and kind is not None and before != kind:
            what = f"detail {name[len(DETAIL) :]!r} of an event" if name.startswith(DETAIL) else f"measure {name!r}"
            raise ValueError(
                f"{what} is {WORDS[kind]} in this run and {WORDS[before]} in others; give values of one type in all "
                "runs, and None where there is none"
            )
        found[name] = kind if before is None else before
    return found


def is_at_odds(known: Mapping[str, Kind], kinds: Mapping[str, Kind]) -> bool:
    """Whether a column would hold two kinds of values; see `merged`."""
    return any(kind is not None and known.get(name) not in (None, kind) for name, kind in kinds.items())


def _type(kind: Kind) -> pa.DataType:
    import pyarrow as pa

    return {"int": pa.int64(), "flag": pa.bool_(), "text": pa.string()}.get(kind or "number", pa.float64())


def _rows_of(run: ShardRun, kind: str, frame: pd.DataFrame) -> pa.Table:
    """Return a table of the library with the columns that identify the run; equal columns have equal types."""
    import pyarrow as pa

    table = pa.Table.from_pandas(frame, preserve_index=False)
    size = table.num_rows
    columns = {
        "setting": pa.array([run.setting] * size, pa.string()),
        "replicate": pa.array([run.replicate] * size, pa.int64()),
    }
    for field, column in zip(table.schema, table.columns, strict=True):
        if field.name in columns:
            raise ValueError(f"{kind}: has a column {field.name!r} of its own; give the event's detail another name")
        is_detail = kind == "events" and field.name not in OWN_COLUMNS_OF_EVENTS
        if is_detail and column.null_count == size:
            # In a run without a value it has the type of numbers, whatever it holds in other runs.
            continue
        columns[field.name] = column.cast(_type_in_all_runs(field.type, is_detail))
    return pa.table(columns)


def _type_in_all_runs(found: pa.DataType, is_detail: bool) -> pa.DataType:
    """Return the type of a column in the tables of all runs; that of a detail depends on the run otherwise."""
    import pyarrow as pa

    if pa.types.is_large_string(found) or pa.types.is_null(found):
        return pa.string()
    return pa.float64() if is_detail and not pa.types.is_string(found) else found


def _details(tables: Mapping[str, pa.Table]) -> Kinds:
    """Return what the details of a run's events hold, as far as it has any."""
    import pyarrow as pa

    found: Kinds = {}
    if (events := tables.get("events")) is not None:
        for field, column in zip(events.schema, events.columns, strict=True):
            if field.name not in OWN_COLUMNS_OF_EVENTS and column.null_count < len(column):
                found[DETAIL + field.name] = "text" if pa.types.is_string(field.type) else "number"
    return found


def _parquet(table: pa.Table, metadata: Mapping[str, str] | None = None) -> bytes:
    import pyarrow.parquet as pq

    table = table.replace_schema_metadata({"software": "teamsight", **(metadata or {})})
    target = io.BytesIO()
    pq.write_table(table, target, compression="zstd")
    return target.getvalue()
