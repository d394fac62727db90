"""A shard: some runs of a study, which one worker makes in one go and returns as files."""

from __future__ import annotations

import contextlib
import io
import json
import re
import signal
import threading
import time
import traceback
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from teamsight.analysis.runs.executor import advance, shortened, without_middle
from teamsight.analysis.studies.definition.model import TASK_PREFIX, measure_of, model_of, task_named
from teamsight.analysis.studies.definition.values import Components, stored
from teamsight.analysis.studies.folder import parts as part_files
from teamsight.analysis.studies.same_code import check_same_code
from teamsight.core import checks, plugins, references
from teamsight.tasks.model import TaskModel

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.agents.world import World
    from teamsight.analysis.studies.study import Record

class ShardRun(NamedTuple):
    """One run of a shard.

    Attributes
    ----------
    setting : str
        The setting's id, 16 hexadecimal digits.
    replicate : int
        The number of the replicate.
    seed : int
        The seed of the world.
    parameters : dict of str to object
        Values of the model's parameters as a study file writes them; components are texts or tables.
    """

    setting: str
    replicate: int
    seed: int
    parameters: dict[str, object]

    @property
    def id(self) -> str:
        """The run's id: the setting's id and the replicate."""
        return f"{self.setting}-{self.replicate}"


class MadeRun(NamedTuple):
    """What is recorded of a run: its measures, and the library's own tables by kind of part."""

    measured: Measured
    tables: dict[str, pd.DataFrame]


class Recorder:
    """Makes runs and records them.

    Parameters
    ----------
    record : Record
        What is recorded.
    steps : int
        Steps of each run.
    taken : frozenset of str
        Names of columns that a measure must not return.
    """

    def __init__(self, record: Record, steps: int, taken: frozenset[str]) -> None:
        self._record, self._steps, self._taken = record, steps, taken

    def make(self, worlds: ReusedWorlds, resolved: Resolved, parameters: Mapping[str, Any], seed: int) -> MadeRun:
        """Make a run and return what is recorded of it."""
        from teamsight.agents.world import World

        world = worlds.begin(resolved.model, parameters, seed)
        if not isinstance(world, World):
            raise TypeError(f"model returned {checks.shown(world)}: must return a World, such as CMOMMT(robots=5)")
        if self._record.trajectories:
            world.recording.record_positions(self._record.trajectories)
        found = resolved.measure(world, self._steps)
        return MadeRun(measured_of(found, self._taken, resolved.measure), self._tables(world))

    def _tables(self, world: World) -> dict[str, pd.DataFrame]:
        record = self._record
        tables = {}
        if record.steps:
            tables["steps"] = world.recording.history.reset_index()
        if record.trajectories:
            tables["trajectories"] = world.recording.trajectory
        if record.events:
            tables["events"] = world.events
        return tables


# Characters of an error, and of its traceback, that are kept.
_LONGEST_ERROR, _LONGEST_TRACEBACK = 280, 20_000
_ADDRESS = re.compile(r"\b0x[0-9a-fA-F]{6,}\b")
# Errors that are meant to be read alone; others are named.
_READABLE = (ValueError, TypeError, OSError)


class Failure(NamedTuple):
    """Why a run failed.

    Attributes
    ----------
    error : str
        The error on one line.
    traceback : str
        The traceback, from the shard's function on; empty for a run whose workers died.
    """

    error: str
    traceback: str


def failure_of(error: BaseException) -> Failure:
    """Return what is kept of an error; raise it again if it is an interrupt of this process.

    Addresses in memory are left out, so that the same error gives the same text in each process.
    """
    if isinstance(error, KeyboardInterrupt) and _receives_interrupts():
        raise error
    text, name = _plain(" ".join(message_of(error).split())), type(error).__name__
    if not isinstance(error, _READABLE):
        text = f"{name}: {text}" if text else name
    trace = _plain("".join(traceback.format_exception(error)))
    return Failure(one_line(text or name), without_middle(trace, _LONGEST_TRACEBACK))


def message_of(error: BaseException) -> str:
    """Return the message of an error, also of one whose class cannot make it."""
    try:
        return str(error)
    except Exception:
        return "(its message cannot be shown)"


def _receives_interrupts() -> bool:
    """Whether Ctrl-C reaches this thread; in workers it does not, so there it is the model that raises it."""
    is_main = threading.current_thread() is threading.main_thread()
    return is_main and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def one_line(text: str) -> str:
    """Return a text on one line, without the middle of a long one."""
    return shortened(text, _LONGEST_ERROR)


def _plain(text: str) -> str:
    """Return a text without addresses, with what no file holds, or a terminal acts on, escaped."""
    text = _ADDRESS.sub("0x…", text)
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() or one == "\n" else ascii(one)[1:-1] for one in text)


class Resolved:
    """The model and the measure of a study, and the components of its parameters.

    Parameters
    ----------
    model, measure : str
        Names as a study has them.
    path : tuple of str
        Folders in which modules are found, besides those that Python searches.

    Raises
    ------
    TypeError, ValueError
        If a name does not lead to a function or class.
    """

    def __init__(self, model: str, measure: str, path: tuple[str, ...]) -> None:
        references.search_in(path)
        task = task_named(model)
        self._task = None if task is None else TaskModel(task)
        # The world of a task itself, so that runs of CMOMMT share one.
        self.model: Callable[..., World] = model_of(model) if task is None else task.world
        self.measure: Callable[[World, int], Any] = measure_of(measure, model)
        self._components = Components()

    def parameters(self, given: Mapping[str, object]) -> dict[str, Any]:
        """Return the keyword arguments of the model for parameters as a study has them."""
        found = self._components.resolved(given)
        return found if self._task is None else self._task.parameters(found)


def modules_of(values: Mapping[str, object]) -> set[str]:
    """Return the names of the modules of all objects that the values of a study name, plug-ins included."""
    texts = {text.removeprefix(TASK_PREFIX) for text in _texts_in(values)}
    named = {text for text in texts if references.is_reference(text)}
    named |= {plug_in.reference for plug_in in plugins.plug_ins() if plug_in.name in texts}
    return {reference.partition(":")[0] for reference in named}


def _texts_in(value: object) -> list[str]:
    """Return all texts in lists and tables."""
    if isinstance(value, str):
        return [value]
    inner = value.values() if isinstance(value, Mapping) else value if isinstance(value, (list, tuple)) else ()
    return [text for one in inner for text in _texts_in(one)]


#: What a column holds: "int", "number", "flag" or "text"; None where it is not known.
Kind = str | None

_KINDS: dict[object, Kind] = {int: "int", float: "number", bool: "flag", str: "text"}
#: What a column holds, in words.
WORDS = {"int": "a whole number", "number": "a number", "flag": "True or False", "text": "a text"}
_MOST_INT = 2**63


class Measured(typing.NamedTuple):
    """The values of one run by column, and what each column holds."""

    values: dict[str, object]
    kinds: dict[str, Kind]


def measured_of(found: object, taken: frozenset[str], measure: Callable[..., object]) -> Measured:
    """Return the columns that a measure returned.

    Parameters
    ----------
    found : object
        A NamedTuple or a mapping of columns.
    taken : frozenset of str
        Names of the other columns.
    measure : callable
        The function that returned it; its annotation names the types of a mapping.

    Raises
    ------
    TypeError, ValueError
        If it is something else, or a value is no number, text, True, False or None.
    """
    if isinstance(found, tuple) and hasattr(found, "_asdict"):
        declared = _declared(type(found))
        found = found._asdict()
    else:
        declared = _returned(measure)
    if not isinstance(found, Mapping):
        raise TypeError(f"measure returned {type(found).__name__}: must be a NamedTuple or a mapping of columns")
    if not taken.isdisjoint(found):
        name = next(name for name in found if name in taken)
        raise ValueError(f"measure returned {name!r}: the table has this column; take another name")
    values: dict[str, object] = {}
    kinds: dict[str, Kind] = {}
    for name, value in found.items():
        if type(name) is not str or not name or not name.isascii():
            _check_name(name)
        kind = declared.get(name)
        if type(value) is float and kind in (None, "number"):  # the usual case
            values[name], kinds[name] = value, "number"
        else:
            values[name], kinds[name] = _value(name, value, kind)
    return Measured(values, kinds)


def _check_name(name: object) -> None:
    """Raise an error unless a file can hold the name of a column."""
    given = f"measure returned the name {checks.shown(name)}"
    if not isinstance(name, str) or not name:
        raise TypeError(f"{given}: must be a text, such as 'distance'")
    try:
        name.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{given}: has half a character, which no file can hold; leave it out") from None


def _value(name: object, value: object, kind: Kind) -> tuple[object, Kind]:
    """Return a value as its column holds it, and what the column holds."""
    if isinstance(value, (np.generic, np.ndarray)) and value.ndim == 0:
        value = value.item()
    if value is None:
        return None, kind
    if isinstance(value, str) and kind in (None, "text"):
        return value.encode("utf-8", "backslashreplace").decode(), "text"
    if kind == "flag" and isinstance(value, bool):
        return value, kind
    if kind == "int" and isinstance(value, Integral) and -_MOST_INT <= int(value) < _MOST_INT:
        return int(value), kind
    if kind in (None, "number") and isinstance(value, Real):
        return float(value), "number"
    wanted = "a number, a text, True, False or None" if kind is None else f"{WORDS[kind]}, as it is annotated"
    cure = "give its parts as columns of their own" if kind is None else "correct the annotation or the value"
    raise TypeError(f"measure returned {name}={checks.shown(value)}: must be {wanted}; {cure}")


@lru_cache(maxsize=64)
def _declared(kind: type) -> dict[str, Kind]:
    """Return what the fields of a NamedTuple or a TypedDict hold by their annotations."""
    try:
        hints = typing.get_type_hints(kind)
    except Exception:  # annotations may name what only a type checker imports
        hints = {}
    return {name: found for name, hint in hints.items() if (found := _KINDS.get(_without_none(hint))) is not None}


@lru_cache(maxsize=64)
def _returned(measure: Callable[..., object]) -> dict[str, Kind]:
    """Return what the columns hold by the annotation of a function's result."""
    hint = _result(measure)
    return _declared(hint) if hint is not None else {}


def declared_columns(measure: Callable[..., object]) -> dict[str, Kind] | None:
    """Return the columns that a measure returns by its annotation, and what each holds; None if it does not say.

    Parameters
    ----------
    measure : callable
        A function whose result is annotated as a NamedTuple or a TypedDict, or another.
    """
    hint = _result(measure)
    if hint is None or not (hasattr(hint, "_fields") or typing.is_typeddict(hint)):
        return None
    return dict.fromkeys(hint.__annotations__) | _declared(hint)


def _result(measure: Callable[..., object]) -> type | None:
    """Return the class that a function returns by its annotation; None if it does not say."""
    found = getattr(measure, "__annotations__", {}).get("return")
    if isinstance(found, str):
        # Alone: the annotations of its parameters may name what only a type checker imports.
        alone = types.SimpleNamespace(__annotations__={"return": found})
        try:
            found = typing.get_type_hints(alone, getattr(measure, "__globals__", {}))["return"]
        except Exception:
            return None
    return found if isinstance(found, type) and hasattr(found, "__annotations__") else None


def _without_none(hint: object) -> object:
    """Return T for ``T | None``."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        rest = [one for one in typing.get_args(hint) if one is not type(None)]
        return rest[0] if len(rest) == 1 else hint
    return hint


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


T = TypeVar("T")

# Seconds between two reports of how many runs of a shard are made.
_PERIOD = 0.2


class Common(NamedTuple):
    """What all runs of a study share.

    Attributes
    ----------
    model : str
        ``"cmommt"``, ``"package.module:Name"``, or the name of a plug-in.
    steps : int
        Steps of each run.
    record : Record
        What is recorded.
    types : dict of str to str
        The type of each parameter's column: "int", "number", "flag" or "text".
    path : tuple of str
        Folders in which modules of the study are found, besides those that Python searches.
    code : str
        The digest of teamsight's code; see `code_digest`.
    sources : dict of str to str
        The digest of the file of each module that the study names, and of those beside it that these import.
    kinds : dict of str to str
        What measured columns hold in the parts that are there.
    """

    model: str
    steps: int
    record: Record
    types: Types
    path: tuple[str, ...]
    code: str
    sources: dict[str, str]
    kinds: Mapping[str, Kind]


class Shard(NamedTuple):
    """Runs that one worker makes in one go."""

    common: Common
    runs: tuple[ShardRun, ...]

    @property
    def name(self) -> str:
        """The id of the first run."""
        return self.runs[0].id

    def describe(self) -> str:
        """Return the shard in words, for errors."""
        first = f"run {self.name}"
        return first if len(self.runs) == 1 else f"{len(self.runs)} runs, the first of which is {first}"


class ShardResult(NamedTuple):
    """What `make_shard` returns.

    Attributes
    ----------
    parts : dict of str to bytes
        Parquet files by kind: "runs", "failed", "steps", "trajectories", "events"; kinds without rows are left out.
    done : int
        Number of runs that did not fail.
    failed : tuple of (str, str)
        The id and the one-line error of each run that failed.
    seconds : float
        Time that the shard took.
    kinds : dict of str to str
        What each measured column holds: "int", "number", "flag" or "text".
    """

    parts: dict[str, bytes]
    done: int
    failed: tuple[tuple[str, str], ...]
    seconds: float
    kinds: Kinds


def make_shard(shard: Shard) -> ShardResult:
    """Make the runs of a shard. All engines run this function; it reports how many are made, under the shard's name.

    A run that raises is a row of "failed", and so is one whose measures are of other types than those of other runs.

    Raises
    ------
    SourceError
        If this process has another version of the code, or of a module that the study names.
    """
    began = reported = time.perf_counter()
    common = shard.common
    check_same_code(common)
    tables = PartTables(common.types, common.steps, common.kinds)
    for count, (run, made) in enumerate(_made(shard), 1):
        if isinstance(made, Failure):
            tables.add_failure(run, made)
        else:
            tables.add_run(run, made)
        if (now := time.perf_counter()) - reported >= _PERIOD:
            reported = now
            advance(shard.name, count)
    parts = tables.parts()
    return ShardResult(parts, tables.done, tuple(tables.failed), time.perf_counter() - began, tables.kinds)


def died(shard: Shard, error: str) -> ShardResult:
    """Return the result of a shard that no worker survived: all its runs failed."""
    tables = PartTables(shard.common.types, shard.common.steps, {})
    for run in shard.runs:
        tables.add_failure(run, Failure(error, ""))
    return ShardResult(tables.parts(), 0, tuple(tables.failed), 0.0, {})


def _made(shard: Shard) -> Iterator[tuple[ShardRun, MadeRun | Failure]]:
    """Make one run after the other, reusing worlds."""
    # Slow to import: only where worlds are made.
    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.analysis.runs.simulate import announcing

    common = shard.common
    with contextlib.closing(ReusedWorlds()) as worlds, announcing():
        resolved = Resolved(common.model, common.record.measure, common.path)
        recorder = Recorder(common.record, common.steps, OWN_COLUMNS.union(common.types))
        prepared = [(run, _attempt(resolved.parameters, run.parameters)) for run in shard.runs]
        worlds.expect((found, run.seed) for run, found in prepared if not isinstance(found, Failure))
        for run, parameters in prepared:
            if isinstance(parameters, Failure):
                yield run, parameters
            else:
                yield run, _attempt(recorder.make, worlds, resolved, parameters, run.seed)


def _attempt(function: Callable[..., T], *arguments: object) -> T | Failure:
    """Return what a function returns, or its failure."""
    try:
        return function(*arguments)
    except BaseException as error:
        return failure_of(error)
