"""A shard: some runs of a study, which one worker makes in one go and returns as files."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from teamsight.analysis.runs.attempt import advance
from teamsight.analysis.studies.failure import Failure, failure_of
from teamsight.analysis.studies.measured import Kind
from teamsight.analysis.studies.part_tables import OWN_COLUMNS, Kinds, PartTables, Types
from teamsight.analysis.studies.recording import MadeRun, Recorder
from teamsight.analysis.studies.resolved import Resolved
from teamsight.analysis.studies.same_code import check_same_code
from teamsight.analysis.studies.shard_run import ShardRun

if TYPE_CHECKING:
    from teamsight.analysis.studies.study import Record

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
