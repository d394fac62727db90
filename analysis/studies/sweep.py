"""`sweep`: make the runs of a study that are missing in its folder."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from teamsight.analysis.runs.workers import check_workers
from teamsight.analysis.studies.adaptive import fewest
from teamsight.analysis.studies.definition.model import in_full
from teamsight.analysis.studies.lazy_pool import LazyPool, workers_for
from teamsight.analysis.studies.resolved import modules_of
from teamsight.analysis.studies.rounds import Rounds
from teamsight.analysis.studies.same_code import DECIDING, source_digests
from teamsight.analysis.studies.shard import Common
from teamsight.analysis.studies.sharding import expected_seconds
from teamsight.analysis.studies.standing import not_finite_note, wide_note
from teamsight.analysis.studies.warm_up import one_of_each_kind, warm_up
from teamsight.core import checks, references

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.studies.folder.run_set import RunSet
    from teamsight.analysis.studies.results import StudyResults
    from teamsight.analysis.studies.study import Study

#: Called with the number of runs that are done or have failed, their number in all, and the seconds left or None.
Progress = Callable[[int, int, float | None], object]
OnError = Literal["continue", "stop"]


class SweepSummary(NamedTuple):
    """What a sweep has made, and what the folder holds now.

    Attributes
    ----------
    folder : Path
        The folder of the study.
    made : int
        Runs that this sweep has made, failed ones included.
    planned, done, failed, missing : int
        Runs of the study, of those which are done and which have failed, and of those which are neither. With
        ``shard``, of this shard.
    errors : tuple of (str, str)
        The id and the error of the first runs that failed in this sweep.
    seconds : float
        Duration.
    wide : str
        Settings of an adaptive study that have reached its limit with a wider interval than wanted, in words; empty if
        none has.
    not_finite : str
        In how many runs of the folder measures are NaN or infinite, in words; empty if none is.
    """

    folder: Path
    made: int
    planned: int
    done: int
    failed: int
    missing: int
    errors: tuple[tuple[str, str], ...]
    seconds: float
    wide: str = ""
    not_finite: str = ""


def sweep(
    study: Study,
    out: str | os.PathLike[str],
    *,
    executor: Executor | None = None,
    workers: int | None = 1,
    on_error: OnError = "continue",
    shard: tuple[int, int] | None = None,
    wait: bool = False,
    mixed_code: bool = False,
    retry_failed: bool = False,
    only: RunSet | None = None,
    progress: Progress = lambda done, total, seconds_left: None,
    emit: Callable[[str], object] = lambda line: None,
) -> SweepSummary:
    """Make the runs of a study that are missing in its folder, and only those.

    The rows do not depend on workers, executor, shards or interruptions.

    Parameters
    ----------
    study : Study
        The study.
    out : path
        Its folder; created if it does not exist.
    workers : int, optional
        As in `Study.run`; with None, all cores are used if the study takes long.
    executor, on_error, shard, wait, mixed_code, retry_failed
        As in `Study.run`.
    only : RunSet, optional
        Make only those of the missing runs that are among these.
    progress, emit : callable
        Called with how far it is, and with messages.

    Raises
    ------
    ValueError
        If an argument is wrong, or the folder cannot be used; see `StudyFolder`.
    JobError
        If no runs can be made, for example because a worker has other code.
    """
    from teamsight.analysis.studies.folder.lock import check_shard
    from teamsight.analysis.studies.folder.study_folder import StudyFolder

    began = time.perf_counter()
    checks.choice("on_error", on_error, ("continue", "stop"))
    check_shard(shard)
    if workers is not None:
        check_workers(workers)
    study.check()
    study = replace(study, model=in_full(study.model))
    plan = study.plan()
    common = common_of(study, plan.types)
    if workers is None:
        most = study.replicates if study.until is None else study.until.limit
        workers = workers_for(expected_seconds(plan, most))
    folder = StudyFolder(out)
    with contextlib.ExitStack() as stack:
        stack.enter_context(folder.lock(shard, wait, emit))
        manifest = folder.prepare(study, plan, code=common.code, sources=common.sources, mixed_code=mixed_code)
        common = common._replace(kinds=dict(manifest.holds))
        for damaged in folder.tidy() if shard is None else ():
            emit(f"damaged part set aside: {damaged.kind}/{damaged.name} ({damaged.reason}); its runs are made again")
        engine = executor or stack.enter_context(LazyPool(workers, emit))
        heartbeat = stack.enter_context(
            folder.recorded(engine=_name(engine), workers=engine.size, code=common.code, shard=shard)
        )
        rounds = Rounds(
            study, plan, common, folder, engine, heartbeat=heartbeat, progress=progress, emit=emit,
            shard=shard, retry_failed=retry_failed, stops=on_error == "stop", only=only,
        )  # fmt: skip
        if study.until is not None and study.replicates < (least := fewest(study.until)):
            emit(f"until: replicates={study.replicates} are only the first; each setting gets at least {least}")
        rounds.run()
    counts = rounds.counts
    return SweepSummary(
        folder.path, counts.made, counts.planned, counts.done, counts.failed,
        counts.planned - counts.done - counts.failed, tuple(rounds.errors), time.perf_counter() - began,
        wide_note(rounds.wide, plan.settings, study.until), not_finite_note(folder.not_finite()),
    )  # fmt: skip


def warm_up_study(study: Study) -> int:
    """Compile what the runs of a study need, for later processes too; return the number of kinds of runs.

    Raises
    ------
    TypeError, ValueError
        If the study is wrong; what fails in a run is left to the run.
    """
    study.check()
    study = replace(study, model=in_full(study.model))
    plan = study.plan()
    shard = one_of_each_kind(plan, common_of(study, plan.types))
    warm_up(shard)
    return len(shard.runs)


def run_study(
    study: Study,
    out: str | os.PathLike[str],
    *,
    workers: int = 1,
    executor: Executor | None = None,
    on_error: OnError = "continue",
    shard: tuple[int, int] | None = None,
    wait: bool = False,
    mixed_code: bool = False,
    retry_failed: bool = False,
    progress: Progress = lambda done, total, seconds_left: None,
) -> StudyResults:
    """Make the runs of a study that are missing in its folder, and return its results; `Study.run` calls it."""
    from teamsight.analysis.studies.results import open_study

    made = sweep(
        study, out, workers=workers, executor=executor, on_error=on_error, shard=shard, wait=wait,
        mixed_code=mixed_code, retry_failed=retry_failed, progress=progress,
    )  # fmt: skip
    # A measure may have changed the current folder.
    return open_study(made.folder)


def common_of(study: Study, types: Mapping[str, str]) -> Common:
    """Return what all runs of a study share. The modules that it names are imported already; see `Study.check`.

    Parameters
    ----------
    study : Study
        The study.
    types : dict of str to str
        The type of each parameter's column.
    """
    from teamsight.analysis.runs.checkpoint import code_digest

    path = () if study.path is None else (os.path.abspath(study.path),)
    references.search_in(path)
    sources = source_digests(modules_of(study.as_dict()), path)
    return Common(study.model, study.steps, study.record, dict(types), path, code_digest(*DECIDING), sources, {})


def _name(engine: Executor) -> str:
    """Return what the record of sweeps calls an engine."""
    kind = type(engine).__name__
    if kind in ("LazyPool", "WorkerPool"):
        return "local" if engine.size > 1 else "in-process"
    return kind.removesuffix("Executor").lower()
