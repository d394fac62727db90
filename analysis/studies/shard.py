"""A shard: some runs of a study, which one worker makes in one go and returns as files; all workers have one code."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import io
import json
import os
import re
import signal
import sys
import threading
import time
import traceback
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, lru_cache
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from teamsight.analysis.runs import checkpoint
from teamsight.analysis.runs.executor import advance, error_text, shortened, without_middle
from teamsight.analysis.runs.run import columns_of, expect_world
from teamsight.analysis.studies.definition.model import TASK_PREFIX, measure_of, model_of, task_named
from teamsight.analysis.studies.definition.values import Components, stored
from teamsight.analysis.studies.folder import parts as part_files
from teamsight.core import plugins, references
from teamsight.core.checks import shown
from teamsight.tasks.model import TaskModel

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from teamsight.agents.world import World
    from teamsight.analysis.studies.study import Record, Study

#: The modules of teamsight that decide the rows of a study, besides those that decide every run: the seeds, the rows.
DECIDING = ("teamsight.analysis.studies.plan", "teamsight.analysis.studies.shard")


class SourceError(RuntimeError):
    """Raised by a worker that has other code than the sweep; the message names both versions."""


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
    types: Mapping[str, str]
    path: tuple[str, ...]
    code: str
    sources: dict[str, str]
    kinds: Mapping[str, Kind]


class Shard(NamedTuple):
    """Runs that one worker makes in one go, and their expected work in the unit of `Run.cost`."""

    common: Common
    runs: tuple[ShardRun, ...]
    cost: float = 0.0

    @property
    def name(self) -> str:
        """The id of the first run."""
        return self.runs[0].id

    def describe(self) -> str:
        """Return the shard in words, for errors."""
        first = f"run {self.name}"
        return first if len(self.runs) == 1 else f"{len(self.runs)} runs, the first of which is {first}"


def common_of(study: Study, types: Mapping[str, str]) -> Common:
    """Return what all runs of a study share. The modules that it names are imported already; see `Study.check`.

    Parameters
    ----------
    study : Study
        The study.
    types : dict of str to str
        The type of each parameter's column.
    """
    path = () if study.path is None else (os.path.abspath(study.path),)
    references.search_in(path)
    texts = {text.removeprefix(TASK_PREFIX) for text in _texts_in(study.as_dict())}
    named = {text for text in texts if references.is_reference(text)}
    named |= plugins.references_of(texts)
    sources = source_digests({reference.partition(":")[0] for reference in named}, path)
    # Weights, for example: a file that a run reads decides it too.
    sources |= {f"{_FILE}{text}": _digest(f"{_FILE}{text}") for text in sorted(texts) if os.path.isfile(text)}
    code = checkpoint.code_digest(*DECIDING)
    return Common(study.model, study.steps, study.record, dict(types), path, code, sources, {})


def _texts_in(value: object) -> Iterator[str]:
    """Yield all texts in lists and tables."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (Mapping, list, tuple)):
        for one in value.values() if isinstance(value, Mapping) else value:
            yield from _texts_in(one)


# What the name of a file begins with among those of modules.
_FILE = "file "
# The digest of each file that was asked for, and the specification of its module at that time: a module that is
# imported again gets another one.
_known: dict[str, tuple[object, str]] = {}


def source_digests(modules: Iterable[str], folders: Iterable[str] = ()) -> dict[str, str]:
    """Return a digest of the file of each module, 16 hexadecimal digits.

    Modules that these import are among them if they stand in the same package, or in one of the folders. A module that
    a function imports when it is called is not known before.

    Parameters
    ----------
    modules : iterable of str
        Names of modules, which are imported already as far as that is possible.
    folders : iterable of str
        Folders of the study.

    Raises
    ------
    ValueError
        If a module was edited after this process has imported it, or stands in the folder of another study.
    """
    names = set(modules)
    return {name: _digest(name) for name in sorted(names.union(_beside(names, tuple(folders))))}


def _beside(names: set[str], folders: tuple[str, ...]) -> Iterator[str]:
    """Yield the names of loaded modules that stand in the packages of others, or in the folders."""
    packages = {top for top in (name.partition(".")[0] for name in names) if hasattr(sys.modules.get(top), "__path__")}
    added = references.added()
    if not (packages or folders or added):
        return
    # Most modules stand in a few folders.
    absolute = cache(os.path.abspath)
    for name, module in tuple(sys.modules.items()):
        top = name.partition(".")[0]
        # Those of this package are in its own digest.
        if top in ("teamsight", "__main__", "__mp_main__") or not (file := getattr(module, "__file__", None)):
            continue
        place, stem = os.sep + name.replace(".", os.sep), file.removesuffix(".py").removesuffix(f"{os.sep}__init__")
        home = absolute(stem.removesuffix(place) or os.sep) if stem.endswith(place) else ""
        if top in packages or home in folders:
            yield name
        elif home in added and (two := references.hidden(name)):
            raise ValueError(references.mixed_up(name, *two))


def check_same_code(common: Common) -> None:
    """Raise an error if this process has another version of the code than the sweep.

    Raises
    ------
    SourceError
        Naming both versions.
    """
    references.search_in(common.path)
    _check(common.code, tuple(common.sources.items()))


@cache
def _check(code: str, sources: tuple[tuple[str, str], ...]) -> None:
    own = checkpoint.code_digest(*DECIDING)
    if own != code:
        raise SourceError(
            f"worker: has version {own} of teamsight's code, the sweep has {code}; install the same version "
            "for all workers and start them again"
        )
    for name, digest in sources:
        if _digest(name) != digest:
            raise SourceError(
                f"worker: has version {_digest(name)} of module {name!r}, the sweep has {digest}; give all workers the "
                "same file and start them again"
            )


def _digest(name: str) -> str:
    """Return the digest of a file, or of a module's file, which must be as it was when the module was imported."""
    if name.startswith(_FILE):
        with contextlib.suppress(OSError), open(name.removeprefix(_FILE), "rb") as content:
            return hashlib.blake2b(content.read(), digest_size=8).hexdigest()
        return "no file"
    module = sys.modules.get(name)
    try:
        spec = importlib.util.find_spec(name) if module is None else module.__spec__
    except (ImportError, ValueError):
        spec = None
    file = getattr(spec, "origin", None) or getattr(module, "__file__", None) or ""
    try:
        with open(file, "rb") as content:
            found = hashlib.blake2b(content.read(), digest_size=8).hexdigest()
    except OSError:
        return "no file"
    before, digest = _known.setdefault(file, (spec, found))
    if digest != found and before is spec:
        raise ValueError(f"module {name!r} ({file}) was edited after it was imported; start Python again, or reload it")
    _known[file] = spec, found
    return found


# Characters of an error, and of its traceback, that are kept.
_LONGEST_ERROR, _LONGEST_TRACEBACK = 280, 20_000
_ADDRESS = re.compile(r"\b0x[0-9a-fA-F]{6,}\b")


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
    # In workers Ctrl-C is ignored, so there it is the model that raises it.
    is_main = threading.current_thread() is threading.main_thread()
    if isinstance(error, KeyboardInterrupt) and is_main and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        raise error
    text = _plain(" ".join(error_text(error).split()))
    trace = _plain("".join(traceback.format_exception(error)))
    return Failure(shortened(text, _LONGEST_ERROR), without_middle(trace, _LONGEST_TRACEBACK))


def _plain(text: str) -> str:
    """Return a text without addresses, with what no file holds, or a terminal acts on, escaped."""
    text = _ADDRESS.sub("0x…", text)
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() or one == "\n" else ascii(one)[1:-1] for one in text)


class Recorder:
    """Makes runs of a study, in worlds that are reused, and records them.

    Parameters
    ----------
    common : Common
        What the runs share; their kinds do not matter.

    Raises
    ------
    TypeError, ValueError
        If the name of the model or the measure does not lead to a function or class.
    """

    def __init__(self, common: Common) -> None:
        # Slow to import: only where worlds are made.
        from teamsight.agents.reused_worlds import ReusedWorlds

        references.search_in(common.path)
        task = task_named(common.model)
        self.common, self.worlds = common._replace(kinds={}), ReusedWorlds()
        self._task = None if task is None else TaskModel(task)
        # The world of a task itself, so that runs of CMOMMT share one.
        self._model: Callable[..., World] = model_of(common.model) if task is None else task.world
        self._measure: Callable[[World, int], Any] = measure_of(common.record.measure, common.model)
        self._taken = OWN_COLUMNS.union(common.types)
        self._components = Components()
        self._last: tuple[object, dict[str, Any]] = None, {}
        self._class: type | None = None

    def parameters(self, given: Mapping[str, object]) -> dict[str, Any]:
        """Return the keyword arguments of the model for parameters as a study has them."""
        if given is self._last[0]:
            return self._last[1]
        before = self._components.unshared
        found = self._components.resolved(given)
        if self._task is not None:
            return self._task.parameters(found)
        # The runs of a setting share what no run can change.
        if self._components.unshared == before and not any(isinstance(one, (list, dict)) for one in found.values()):
            self._last = given, found
        return found

    @property
    def model(self) -> Callable[..., World]:
        """What builds the worlds, from such arguments and the seed as ``rng``."""
        return self._model

    def begin(self, parameters: Mapping[str, Any], seed: int) -> World:
        """Return a world before its first step."""
        world = self.worlds.begin(self._model, parameters, seed)
        if type(world) is not self._class:
            self._class = type(expect_world(world))
        return world

    def make(self, run: ShardRun, parameters: Mapping[str, Any]) -> tuple[object, dict[str, pa.Table]]:
        """Make a run; return what `measured` takes, and the rows of the library's own tables by kind of part."""
        world, record = self.begin(parameters, run.seed), self.common.record
        if record.trajectories:
            world.recording.record_positions(record.trajectories)
        found = self._measure(world, self.common.steps)
        # What no later run can change is examined after the last one: right after a run, which displaces all else from
        # the caches of the processor, that takes several times as long.
        if not (isinstance(found, tuple) and _SCALARS.issuperset(map(type, found))):
            found = self.measured(found)
        if not (record.steps or record.trajectories or record.events):
            return found, {}
        frames = {}
        if record.steps:
            frames["steps"] = world.recording.history.reset_index()
        if record.trajectories:
            frames["trajectories"] = world.recording.trajectory
        if record.events:
            frames["events"] = world.events
        return found, {kind: _rows_of(run, kind, frame) for kind, frame in frames.items()}

    def measured(self, found: object) -> Measured:
        """Return the values of the columns that the measure returned, and what each column holds."""
        return found if isinstance(found, Measured) else measured_of(found, self._taken, self._measure)


#: What a column holds: "int", "number", "flag" or "text"; None where it is not known.
Kind = str | None

_KINDS: dict[object, Kind] = {int: "int", float: "number", bool: "flag", str: "text"}
_SCALARS = frozenset(_KINDS)
#: What a column holds, in words.
WORDS = {"int": "a whole number", "number": "a number", "flag": "True or False", "text": "a text"}
_MOST_INT = 2**63


class Measured(NamedTuple):
    """What a run measured: the values of its columns, and what each column holds."""

    values: dict[str, object]
    kinds: dict[str, Kind]


def measured_of(found: object, taken: frozenset[str], measure: Callable[..., object]) -> Measured:
    """Return the values of the columns that a measure returned, and what each column holds.

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
    kind: type = type(found)
    declared = _declared(kind) if hasattr(found, "_asdict") else _returned(measure)
    values: dict[str, object] = {}
    kinds: dict[str, Kind] = {}
    for name, value in columns_of(found, taken).items():
        if type(name) is not str or not name or not name.isascii():
            _check_name(name)
        wanted, type_ = declared.get(name), type(value)
        # The usual cases: checks against abstract classes are slow.
        if type_ is float and wanted in (None, "number"):
            values[name], kinds[name] = value, "number"
        elif type_ is int and wanted == "int" and -_MOST_INT <= value < _MOST_INT:
            values[name], kinds[name] = value, wanted
        else:
            values[name], kinds[name] = _value(name, value, wanted)
    return Measured(values, kinds)


def _check_name(name: object) -> None:
    """Raise an error unless a file can hold the name of a column."""
    given = f"measure returned the name {shown(name)}"
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
    raise TypeError(f"measure returned {name}={shown(value)}: must be {wanted}; {cure}")


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
Kinds = dict[str, Kind]

#: Columns of runs and failed runs that are neither parameters nor measures.
OWN_COLUMNS = frozenset({"run", "setting", "replicate", "seed", "steps", "error", "traceback"})
#: Columns of the event log that are no details of an event.
OWN_COLUMNS_OF_EVENTS = frozenset({"setting", "replicate", "time", "tick", "what", "group", "agent", "source"})
#: What the names of events' details begin with among the kinds of columns.
DETAIL = "events/"


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
        What each measured column holds, and each detail of events, as in "events/colour".
    """

    parts: dict[str, bytes]
    done: int
    failed: tuple[tuple[str, str], ...]
    seconds: float
    kinds: Kinds


class PartTables:
    """The rows of a shard, which become Parquet files.

    Parameters
    ----------
    common : Common
        What the runs share. A run whose measures are of other kinds than those of other parts fails.
    """

    def __init__(self, common: Common) -> None:
        self._common, self._known = common, dict(common.kinds)
        # Apart from those of other shards: the bytes of a part are a function of its runs.
        self._kinds: Kinds = {}
        self._last: Kinds | None = None
        self._runs: list[tuple[ShardRun, dict[str, Any]]] = []
        self._failures: list[tuple[ShardRun, Failure]] = []
        self._tables: dict[str, list[pa.Table]] = {}

    def add(self, run: ShardRun, found: Measured | Failure, tables: Mapping[str, pa.Table]) -> None:
        """Add what a run measured, or why it failed, and its rows of other kinds of parts."""
        if isinstance(found, Failure):
            self._failures.append((run, found))
            return
        kinds = found.kinds | _details(tables["events"]) if "events" in tables else found.kinds
        if kinds != self._last:
            try:
                self._known, self._kinds = merged(self._known, kinds), merged(self._kinds, kinds)
            except ValueError as error:
                self._failures.append((run, Failure(shortened(str(error), _LONGEST_ERROR), "")))
                return
            self._last = kinds
        self._runs.append((run, found.values))
        for kind, table in tables.items():
            self._tables.setdefault(kind, []).append(table)

    def result(self, seconds: float = 0.0) -> ShardResult:
        """Return a Parquet file for each kind of rows that there are, and what is in them."""
        import pyarrow as pa

        found = {}
        for kind, tables in self._tables.items():
            # What a run does not have is null.
            table = pa.concat_tables(tables, promote_options="default")
            if table.num_rows:
                found[kind] = _parquet(table)
        if self._failures:
            errors = {name: [getattr(one, name) for _, one in self._failures] for name in Failure._fields}
            runs = [run for run, _ in self._failures]
            columns = {"run": [run.id for run in runs], **self._columns(runs), **errors}
            texts = {name: pa.array(columns[name], pa.string()) for name in ("run", *errors)}
            found["failed"] = _parquet(pa.table(columns | texts))
        # Last, since it is this part that makes the runs done. It says which parts were written beside it.
        if self._runs:
            measured = {
                name: pa.array([values.get(name) for _, values in self._runs], _type(kind))
                for name, kind in self._kinds.items()
                if not name.startswith(DETAIL)
            }
            beside = {kind: part_files.digest(content) for kind, content in found.items() if kind != "failed"}
            about = {part_files.BESIDE: json.dumps(beside), part_files.HOLDS: json.dumps(self._kinds)}
            found["runs"] = _parquet(pa.table({**self._columns([run for run, _ in self._runs]), **measured}), about)
        failed = tuple((run.id, failure.error) for run, failure in self._failures)
        return ShardResult(found, len(self._runs), failed, seconds, self._kinds)

    def _columns(self, runs: list[ShardRun]) -> dict[str, Any]:
        """Return the columns that identify runs."""
        import pyarrow as pa

        return {
            "setting": pa.array([run.setting for run in runs], pa.string()),
            **{
                name: pa.array([stored(run.parameters[name], kind) for run in runs], _type(kind))
                for name, kind in self._common.types.items()
            },
            "replicate": pa.array([run.replicate for run in runs], pa.int64()),
            "seed": pa.array([run.seed for run in runs], pa.int64()),
            "steps": pa.array([self._common.steps] * len(runs), pa.int64()),
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
    for name, column in zip(table.column_names, table.columns, strict=True):
        if name in columns:
            raise ValueError(f"{kind}: has a column {name!r} of its own; give the event's detail another name")
        is_detail = kind == "events" and name not in OWN_COLUMNS_OF_EVENTS
        if is_detail and column.null_count == size:
            # In a run without a value it has the type of numbers, whatever it holds in other runs.
            continue
        type_ = column.type
        if pa.types.is_string(type_) or pa.types.is_large_string(type_) or pa.types.is_null(type_):
            type_ = pa.string()
        elif is_detail:
            type_ = pa.float64()
        columns[name] = column.cast(type_)
    return pa.table(columns)


def _details(events: pa.Table) -> Kinds:
    """Return what the details of a run's events hold, as far as it has any."""
    import pyarrow as pa

    return {
        DETAIL + field.name: "text" if pa.types.is_string(field.type) else "number"
        for field, column in zip(events.schema, events.columns, strict=True)
        if field.name not in OWN_COLUMNS_OF_EVENTS and column.null_count < len(column)
    }


def _parquet(table: pa.Table, metadata: Mapping[str, str] | None = None) -> bytes:
    import pyarrow.parquet as pq

    table = table.replace_schema_metadata({"software": "teamsight", **(metadata or {})})
    target = io.BytesIO()
    # Without dictionaries: most values occur once, and what repeats itself is compressed all the same.
    pq.write_table(table, target, compression="zstd", use_dictionary=False)
    return target.getvalue()


# Seconds between two reports of how many runs of a shard are made.
_PERIOD = 0.2


def make_shard(shard: Shard) -> ShardResult:
    """Make the runs of a shard. All engines run this function; it reports how many are made, under the shard's name.

    A run that raises is a row of "failed", and so is one whose measures are of other types than those of other runs.

    Raises
    ------
    SourceError
        If this process has another version of the code, or of a module that the study names.
    """
    began = reported = time.perf_counter()
    tables, made = PartTables(shard.common), list[Any]()
    with recording(shard.common) as recorder:
        prepared = [(run, _attempt(recorder.parameters, run.parameters)) for run in shard.runs]
        recorder.worlds.expect((found, run.seed) for run, found in prepared if not isinstance(found, Failure))
        for count, (run, parameters) in enumerate(prepared, 1):
            is_failure = isinstance(parameters, Failure)
            made.append(parameters if is_failure else _attempt(recorder.make, run, parameters))
            if (now := time.perf_counter()) - reported >= _PERIOD:
                reported = now
                advance(shard.name, count)
    for run, one in zip(shard.runs, made, strict=True):
        if isinstance(one, Failure):
            tables.add(run, one, {})
        else:
            tables.add(run, _attempt(recorder.measured, one[0]), one[1])
    return tables.result(time.perf_counter() - began)


class _Kept(threading.local):
    """The recorder of the last shard: the next one is mostly of the same study, and building a world takes long."""

    recorder: Recorder | None = None


_kept = _Kept()


@contextlib.contextmanager
def recording(common: Common) -> Iterator[Recorder]:
    """Make runs within the block; the world stays for the next block of the same study in this thread.

    Raises
    ------
    SourceError
        If this process has another version of the code, or of a module that the study names.
    """
    from teamsight.analysis.runs.simulate import announcing

    recorder = _kept.recorder
    if recorder is None or recorder.common != common._replace(kinds={}):
        end_recording()
        check_same_code(common)
        recorder = Recorder(common)
    # A model or a measure may make the runs of another study meanwhile.
    _kept.recorder = None
    try:
        with announcing():
            yield recorder
    finally:
        recorder.worlds.rest()
        _kept.recorder = recorder


def end_recording() -> None:
    """Close the world that this thread has kept."""
    if _kept.recorder is not None:
        _kept.recorder.worlds.close()
        _kept.recorder = None


def died(shard: Shard, error: str) -> ShardResult:
    """Return the result of a shard that no worker survived: all its runs failed."""
    tables = PartTables(shard.common)
    for run in shard.runs:
        tables.add(run, Failure(error, ""), {})
    return tables.result()


T = typing.TypeVar("T")


def _attempt(function: Callable[..., T], *arguments: object) -> T | Failure:
    """Return what a function returns, or its failure."""
    try:
        return function(*arguments)
    except BaseException as error:
        return failure_of(error)
