"""The runner: make jobs on a pool of workers, each once, and return their results in order.

Pipelines that simulate many worlds, but for studies, describe them as `Run`s and hand them to `run_all`. A larger unit
of work, such as one point of a learning curve, is a `Job` too: it makes its own runs where it is executed.
"""

from __future__ import annotations

import contextlib
import traceback
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import pandas as pd

from teamsight.analysis.runs.checkpoint import Checkpoint, Key, is_in_shard
from teamsight.analysis.runs.executor import (
    Attempted,
    Executor,
    JobError,
    Outcome,
    emit,
    error_of,
    error_text,
    shortened,
)
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.progress_line import reported
from teamsight.analysis.runs.run import Run, columns_of
from teamsight.core.interrupts import is_interrupt

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds

# Cost of a chunk: about a quarter of a second, so that progress moves and messages cost nothing.
_CHUNK = 200_000.0
# Chunks for each worker of a small batch, so that all of them take part and end together.
_CHUNKS_PER_WORKER = 4
# Jobs that are made first, to see whether all fail; characters of a failure in the error about many.
_FIRST, _LONGEST = 10, 200

#: A job and its key.
Entry = tuple[Key, "Job"]
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
    progress: Progress | bool = True,
    checkpoint: Checkpoint | None = None,
) -> list[Any]:
    """Make each distinct job once and return the result of every job, in the order of the jobs.

    With a checkpoint, a job that fails stops no other: the results of all others are kept, then one error says how many
    jobs failed, and the same call makes only these again. A failure that all jobs are likely to share does stop them:
    ten jobs from all over the list are made first, each alone, and if all ten fail and no result is kept, no others are
    made. Without a checkpoint, where nothing would be kept, the first failure stops all.

    Parameters
    ----------
    jobs : iterable of Job
        Runs, or other jobs. Jobs of equal keys are made once.
    pool : Executor, optional
        What makes the jobs, such as a `WorkerPool`; by default this process. Results do not depend on it.
    progress : callable or bool
        Called with the work done and the work in all, whenever some is done. With True, a terminal or a notebook shows
        after two seconds how far it is; with False it does not.
    checkpoint : Checkpoint, optional
        File of results; jobs whose results it holds are not made again.

    Raises
    ------
    JobError
        If jobs fail; the message contains the settings of the first one.
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
    with reported(progress) as report:
        results |= _made(dict(wanted), results, pool, report, checkpoint)
    if shard is not None and checkpoint is not None and len(results) < len(distinct):
        raise ShardsMissingError(
            f"shard {shard[0]}/{shard[1]} is made; {len(results)} of {len(distinct)} parts are kept in "
            f"{checkpoint.path}; when all shards have ended, the same command without --shard makes what is left and "
            "writes the results"
        )
    return [results[key] for key, _ in asked]


def _made(
    jobs: Mapping[Key, Job], kept: Mapping[Key, Any], pool: Executor | None, progress: Progress,
    checkpoint: Checkpoint | None,
) -> dict[Key, Any]:  # fmt: skip
    """Make the jobs without a result in `kept` and return theirs; raise an error if any fail. See `run_all`."""
    # The sort is stable: jobs that are alike keep their order.
    missing = sorted((entry for entry in jobs.items() if entry[0] not in kept), key=_likeness())
    costs = {key: job.cost for key, job in jobs.items()}
    total = sum(costs.values())
    done = total - sum(costs[key] for key, _ in missing)
    progress(done, total)
    count = 0 if checkpoint is None else min(_FIRST, len(missing))
    first = [missing[len(missing) * number // count] for number in range(count)]
    results: dict[Key, Any] = {}
    failed: set[Key] = set()
    left = len(missing)
    # A pool of one worker has no processes that would have to be ended.
    workers = pool if pool is not None else WorkerPool(1)
    with contextlib.closing(_outcomes(missing, first, costs, workers)) as outcomes:
        for new, errors in outcomes:
            if checkpoint is not None:
                for key, why in checkpoint.add(new).items():
                    del new[key]
                    errors[key] = JobError(_failure(why, jobs[key]))
            if errors and not failed:
                error = next(iter(errors.values()))
                if checkpoint is None:
                    raise error
                # At once, since all others may take hours.
                emit(f"a job failed: {error}")
            results.update(new)
            failed.update(errors)
            if not results and not kept and failed.issuperset(key for key, _ in first):
                break
            done += sum(costs[key] for key in (*new, *errors))
            left -= len(new) + len(errors)
            progress(done if left else total, total)  # without what rounding adds
    if failed:
        raise JobError(_summary(error, len(failed), len(jobs), bool(results or kept))) from error
    return results


def _outcomes(
    missing: Sequence[Entry], first: Sequence[Entry], costs: Mapping[Key, float], workers: Executor
) -> Generator[tuple[dict[Key, Any], dict[Key, JobError]], None, None]:
    """Make jobs, the first ones alone and others in chunks; yield the results and the errors of each chunk.

    Those of a chunk that no worker returns are made again, each alone. Without first jobs, the first failure is the
    last outcome of its chunk.
    """
    if workers.size > 1:
        # In one worker, so that no two workers compile the same kernels; the others start meanwhile.
        kinds = [_one_of_each_kind(job for _, job in missing)] + [[]] * (workers.size - 1)
        with contextlib.closing(workers.outcomes(_compile, kinds)) as compiled:
            list(compiled)
    make, alone = partial(_make, goes_on=bool(first)), dict(first)
    chunks = [[entry] for entry in first]
    chunks += _chunks([entry for entry in missing if entry[0] not in alone], costs, workers.size)
    while chunks:
        again: list[list[Entry]] = []
        with contextlib.closing(workers.outcomes(make, [[job for _, job in chunk] for chunk in chunks])) as outcomes:
            for outcome in outcomes:
                chunk = chunks[outcome.index]
                if outcome.status != "done" and first and len(chunk) > 1:
                    again += [[entry] for entry in chunk]
                else:
                    yield _divided(chunk, outcome)
        chunks = again


def _divided(chunk: Sequence[Entry], outcome: Outcome) -> tuple[dict[Key, Any], dict[Key, JobError]]:
    """Return the results and the errors of the jobs of a chunk; that of all of them is an error of the first."""
    if outcome.status != "done":
        return {}, {chunk[0][0]: error_of(outcome, _describe([job for _, job in chunk]))}
    results, errors = dict[Key, Any](), dict[Key, JobError]()
    for (key, _), (status, value) in zip(chunk, outcome.value, strict=False):
        if status == "done":
            results[key] = value
        else:
            errors[key] = error_of(Outcome(outcome.index, status, value), "")
    return results, errors


def _failure(error: BaseException, job: Job) -> str:
    """Return why a job failed, with its settings."""
    return f"{error_text(error)} (in {job.describe()})"


def _summary(first: JobError, failed: int, jobs: int, has_others: bool) -> str:
    """Return how many jobs failed, why the first did, and what to do."""
    reason = shortened(str(first), _LONGEST)
    if has_others:
        rest = "the other results are kept, and the same command makes only these again"
        return f"{failed:,} of {jobs:,} jobs failed, the first: {reason}; {rest}"
    if failed < jobs:
        return f"the first {failed:,} of {jobs:,} jobs all failed, so no others were made: {reason}"
    return f"all {jobs:,} jobs failed, the first: {reason}" if jobs > 1 else str(first)


def _likeness() -> Callable[[Entry], tuple[object, ...]]:
    """Return the sorting key that joins runs which can share one built world; other jobs keep their order."""
    known: dict[tuple[int, ...], tuple[object, ...]] = {}

    def likeness(entry: Entry) -> tuple[object, ...]:
        job = entry[1]
        if not isinstance(job, Run):
            return ()
        setting = _setting(job)
        if setting not in known:
            known[setting] = job.likeness
        return known[setting]

    return likeness


def _setting(run: Run) -> tuple[int, ...]:
    """Return what runs have in common that differ in their seeds only; it is found faster than any text."""
    return id(run.parameters), id(run.model), id(run.measure)


def _chunks(jobs: Sequence[Entry], costs: Mapping[Key, float], workers: int) -> list[list[Entry]]:
    """Divide jobs into chunks of about equal cost; for several workers the last are small, so that all end together."""
    left = sum(costs[key] for key, _ in jobs)
    shares = _CHUNKS_PER_WORKER * workers
    least = min(_CHUNK, left / shares) / _CHUNKS_PER_WORKER
    chunks: list[list[Entry]] = []
    room = 0.0
    for entry in jobs:
        if room <= 0:
            chunks.append([])
            room = max(min(_CHUNK, left / shares), least) if workers > 1 else _CHUNK
        chunks[-1].append(entry)
        room -= costs[entry[0]]
        left -= costs[entry[0]]
    return chunks


def _one_of_each_kind(jobs: Iterable[Job]) -> list[Job]:
    """Return a short run for each combination of components; numbers do not change what is compiled."""
    settings = {_setting(job): job for job in jobs if isinstance(job, Run)}
    kinds = {run.kind: run for run in settings.values()}
    return [replace(run, steps=1) for run in kinds.values()]


def _compile(jobs: Sequence[Job]) -> None:
    with warnings.catch_warnings():
        # In a run of one step robots that sense rarely do not decide.
        warnings.filterwarnings("ignore", "none of .* decides before", UserWarning)
        _make(jobs)  # failures are left to the jobs themselves


def _make(jobs: Sequence[Job], *, goes_on: bool = True) -> list[Attempted]:
    """Make jobs, all of them or up to the first that fails, and return what became of each."""
    # Slow to import: only where worlds are made.
    from teamsight.agents.reused_worlds import ReusedWorlds

    worlds = ReusedWorlds()
    worlds.expect((job.parameters, job.seed) for job in jobs if isinstance(job, Run))
    made: list[Attempted] = []
    with contextlib.closing(worlds), announcing():
        for job in jobs:
            made.append(_make_one(job, worlds))
            if made[-1][0] == "failed" and not goes_on:
                break
    return made


def _make_one(job: Job, worlds: ReusedWorlds) -> Attempted:
    try:
        return "done", job.make(worlds)
    except BaseException as error:  # whatever the code of a user raises, such as SystemExit
        if is_interrupt(error):
            raise KeyboardInterrupt from error
        return "failed", (_failure(error, job), f"\n{traceback.format_exc()}")


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
