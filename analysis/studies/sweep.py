"""`sweep`: make the runs of a study that are missing in its folder."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.studies.results import StudyResults
    from teamsight.analysis.studies.study import Study

#: Called with the number of runs that are done or have failed, their number in all, and the seconds left or None.
Progress = Callable[[int, int, float | None], None]


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
    """

    folder: Path
    made: int
    planned: int
    done: int
    failed: int
    missing: int
    errors: tuple[tuple[str, str], ...]
    seconds: float


def sweep(
    study: Study,
    out: str | os.PathLike[str],
    *,
    executor: Executor | None = None,
    workers: int = 1,
    on_error: Literal["continue", "stop"] = "continue",
    shard: tuple[int, int] | None = None,
    wait: bool = False,
    mixed_code: bool = False,
    retry_failed: bool = False,
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
    executor : Executor, optional
        What makes the runs; by default a pool of `workers` processes.
    workers : int
        Number of processes; with 1 runs are made in this one.
    on_error : {"continue", "stop"}
        Whether to go on after a run that fails. A failed run is not made again unless `retry_failed` is set.
    shard : (int, int), optional
        Make shard i of n only, from 1: for a job array.
    wait : bool
        Wait until another sweep of the folder has ended, in place of refusing.
    mixed_code : bool
        Go on although runs in the folder were made by other code.
    retry_failed : bool
        Make failed runs again.
    progress, emit : callable
        Called with how far it is, and with messages.

    Raises
    ------
    ValueError
        If an argument is wrong, or the folder cannot be used; see `StudyFolder`.
    JobError
        If no runs can be made, for example because a worker has other code.
    """
    raise NotImplementedError


def run_study(
    study: Study,
    out: str | os.PathLike[str],
    *,
    workers: int = 1,
    executor: Executor | None = None,
    on_error: Literal["continue", "stop"] = "continue",
    progress: Progress = lambda done, total, seconds_left: None,
) -> StudyResults:
    """Make the runs of a study that are missing in its folder, and return its results; `Study.run` calls it."""
    from teamsight.analysis.studies.results import open_study

    sweep(study, out, workers=workers, executor=executor, on_error=on_error, progress=progress)
    return open_study(out)
