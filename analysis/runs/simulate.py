"""The runner: make jobs on a pool of workers, each once, and return their results in order.

Pipelines that simulate many worlds, but for studies, describe them as `Run`s and hand them to `run_all`. A larger unit
of work, such as one point of a learning curve, is a `Job` too: it makes its own runs where it is executed.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import pandas as pd

from teamsight.analysis.runs.checkpoint import Checkpoint, Key, is_in_shard
from teamsight.analysis.runs.executor import Executor, JobError, emit, error_text, results_of
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run, columns_of

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds

# Cost of a chunk: about a quarter of a second, so that progress moves and messages cost nothing.
_CHUNK = 200_000.0
# Chunks for each worker of a small batch, so that all of them take part and end together.
_CHUNKS_PER_WORKER = 4

#: Called with the work done and the work in all, in arbitrary units.
Progress = Callable[[float, float], None]
#: Called with the name of a phase, the work done in it and its work in all.
Watch = Callable[[str, float, float], None]


class Job(Protocol):
    """A unit of work; see `Run`."""

    @property
    def key(self) -> Key:
        """Texts that identify the job and all its settings."""

    @property
    def cost(self) -> float:
        """Expected work, in steps of a world with 15 robots and 15 targets."""

    def make(self, worlds: ReusedWorlds) -> Any:
        """Do the work in this process and return the result."""

    def describe(self) -> str:
        """Return the job in words, for errors."""


class ShardsMissingError(Exception):
    """Raised when the jobs of one shard are made, and those of others are not."""


def run_all(
    jobs: Iterable[Job],
    pool: Executor | None = None,
    *,
    progress: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
) -> list[Any]:
    """Make each distinct job once and return the result of every job, in the order of the jobs.

    Parameters
    ----------
    jobs : iterable of Job
        Runs, or other jobs. Jobs of equal keys are made once.
    pool : Executor, optional
        What makes the jobs, such as a `WorkerPool`; by default this process. Results do not depend on it.
    progress : callable
        Called with the work done and the work in all, whenever some is done.
    checkpoint : Checkpoint, optional
        File of results; jobs whose results it holds are not made again.

    Raises
    ------
    JobError
        If a job fails; the message contains its settings.
    ShardsMissingError
        If `pool` makes one shard only, and results of others are missing.
    """
    asked = [(job.key, job) for job in jobs]
    for _, job in asked:
        if isinstance(job, Run):
            job.check()
    distinct = dict(asked)
    results = {} if checkpoint is None else checkpoint.results(distinct)
    shard = pool.shard if pool is not None and checkpoint is not None else None
    wanted = list(distinct.items())
    if shard is not None and checkpoint is not None:
        wanted = [entry for entry in wanted if is_in_shard(entry[0], shard)]
        checkpoint = Checkpoint(checkpoint.path, checkpoint.codec, shard)
    # The sort is stable: jobs that are alike keep their order.
    missing = sorted((entry for entry in wanted if entry[0] not in results), key=_likeness)
    total = sum(job.cost for _, job in wanted)
    done = total - sum(job.cost for _, job in missing)
    progress(done, total)

    # A pool of one worker has no processes that would have to be ended.
    workers = pool if pool is not None else WorkerPool(1)
    if workers.size > 1:
        # In one worker, so that no two workers compile the same kernels; the others start meanwhile.
        kinds = [_one_of_each_kind(job for _, job in missing)] + [[]] * (workers.size - 1)
        results_of(workers, _compile, kinds, describe=lambda _: "compilation")
    chunks = _chunks(missing, workers.size)

    def keep(index: int, made: list[Any]) -> None:
        new = {key: result for (key, _), result in zip(chunks[index], made, strict=True)}
        if checkpoint is not None:
            checkpoint.add(new)
        results.update(new)

    def count(index: int) -> None:
        nonlocal done
        done += sum(job.cost for _, job in chunks[index])
        progress(done, total)

    results_of(workers, _make, [[job for _, job in chunk] for chunk in chunks], count, _describe, keep)
    if shard is not None and checkpoint is not None and len(results) < len(distinct):
        raise ShardsMissingError(
            f"shard {shard[0]}/{shard[1]} is made; {len(results)} of {len(distinct)} parts are kept in "
            f"{checkpoint.path}; when all shards have ended, the same command without --shard makes what is left and "
            "writes the results"
        )
    return [results[key] for key, _ in asked]


def _likeness(entry: tuple[Key, Job]) -> tuple[object, ...]:
    """Sorting key that puts runs together which can share one built world; other jobs stay in their order."""
    return entry[1].likeness if isinstance(entry[1], Run) else ()


def _chunks(jobs: Sequence[tuple[Key, Job]], workers: int) -> list[list[tuple[Key, Job]]]:
    """Divide jobs into chunks of about equal cost."""
    size = min(_CHUNK, sum(job.cost for _, job in jobs) / (_CHUNKS_PER_WORKER * workers)) if workers > 1 else _CHUNK
    chunks: list[list[tuple[Key, Job]]] = []
    room = 0.0
    for entry in jobs:
        if room <= 0:
            chunks.append([])
            room = size
        chunks[-1].append(entry)
        room -= entry[1].cost
    return chunks


def _one_of_each_kind(jobs: Iterable[Job]) -> list[Job]:
    """Return a short run for each combination of components; numbers do not change what is compiled."""
    kinds = {job.kind: job for job in jobs if isinstance(job, Run)}
    return [replace(run, steps=1) for run in kinds.values()]


def _compile(jobs: Sequence[Job]) -> None:
    with warnings.catch_warnings():
        # In a run of one step robots that sense rarely do not decide.
        warnings.filterwarnings("ignore", "none of .* decides before", UserWarning)
        _make(jobs)


def _make(jobs: Sequence[Job]) -> list[Any]:
    # Slow to import: only where worlds are made.
    from teamsight.agents.reused_worlds import ReusedWorlds

    worlds = ReusedWorlds()
    worlds.expect((job.parameters, job.seed) for job in jobs if isinstance(job, Run))
    with contextlib.closing(worlds), announcing():
        return [_make_one(job, worlds) for job in jobs]


def _make_one(job: Job, worlds: ReusedWorlds) -> Any:
    try:
        return job.make(worlds)
    except Exception as error:
        raise JobError(f"{error_text(error)} (in {job.describe()})") from error


def _describe(jobs: Sequence[Job]) -> str:
    return f"{len(jobs)} jobs, the first of which is {jobs[0].describe()}" if len(jobs) > 1 else jobs[0].describe()


_announced = False


@contextlib.contextmanager
def announcing() -> Iterator[None]:
    """Emit one message when kernels are compiled, the first time in this process."""
    from teamsight.core.kernel import entry as kernel_entry

    def announce(name: str) -> None:
        global _announced
        if not _announced:
            _announced = True
            emit("compiling the simulation: this happens once per machine and takes under a minute")

    before, kernel_entry.announce = kernel_entry.announce, announce
    try:
        yield
    finally:
        kernel_entry.announce = before


#: The columns that identify a run, and the run.
Planned = tuple[Mapping[str, Any], Run]


def run_rows(
    planned: Iterable[Planned],
    pool: Executor | None = None,
    *,
    progress: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
) -> pd.DataFrame:
    """Make planned runs and return a table with one row for each, in their order.

    Parameters
    ----------
    planned : iterable of (mapping, Run)
        The columns that identify each run, and the run, whose measure returns a mapping or a NamedTuple.
    pool, progress, checkpoint
        See `run_all`.

    Returns
    -------
    DataFrame
        The columns that identify the runs, then those that were measured.

    Raises
    ------
    ValueError
        If a run measures a column that identifies it.
    JobError
        If a run fails; the message contains its settings.
    """
    listed = list(planned)
    measured = run_all([run for _, run in listed], pool, progress=progress, checkpoint=checkpoint)
    rows = [(columns, columns_of(found, columns)) for (columns, _), found in zip(listed, measured, strict=True)]
    table = pd.DataFrame([{**columns, **found} for columns, found in rows])
    # What `teamsight.open_study` reads of the file.
    table.attrs["measures"] = list(dict.fromkeys(name for _, found in rows for name in found))
    return table
