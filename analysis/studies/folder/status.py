"""`status`: how far a study is, read from its folder without writing."""

from __future__ import annotations

import os
from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from teamsight.analysis.studies.folder.lock import Holder, holders
from teamsight.analysis.studies.folder.parts import Damaged
from teamsight.analysis.studies.folder.progress import Progress, seconds_left
from teamsight.analysis.studies.folder.run_set import IDENTITY, RunSet
from teamsight.analysis.studies.folder.study_folder import StudyFolder

if TYPE_CHECKING:
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study


class Running(NamedTuple):
    """A sweep that runs now.

    Attributes
    ----------
    holder : Holder
        Its process, and since when.
    progress : Progress or None
        Its last heartbeat; None before the first.
    """

    holder: Holder
    progress: Progress | None


class Status(NamedTuple):
    """How far a study is.

    Attributes
    ----------
    planned : int
        Runs of the study; those known so far if it is adaptive.
    done, failed, missing : int
        Runs that are done, that have failed, and that are neither.
    running : int
        Those of the missing runs that workers have now.
    seconds_left : float or None
        Time until none is missing at the present rate [s]; None if no sweep runs, or its rate is not known yet.
    rate : float or None
        Runs per second of the sweeps that run now; None if it is not known.
    sweeps : tuple of Running
        The sweeps that run now.
    damaged : tuple of Damaged
        Parts of runs that are damaged; their runs are missing.
    """

    planned: int
    done: int
    failed: int
    missing: int
    running: int
    seconds_left: float | None
    rate: float | None
    sweeps: tuple[Running, ...]
    damaged: tuple[Damaged, ...]


def status(folder: str | os.PathLike[str]) -> Status:
    """Return how far a study is, also while a sweep runs.

    Raises
    ------
    ValueError
        If this is not the folder of a study.
    """
    place = StudyFolder(folder)
    study = place.study
    # What is read later holds at least as many runs: none is reported as missing that has just been made.
    sweeps = _running(place)
    heartbeats = [each.progress for each in sweeps if each.progress]
    plan = study.plan()
    done, failed = (count_planned(runs, plan, study) for runs in (place.done(), place.failed()))
    planned = max(done + failed, planned_runs(study, plan, place.progress))
    if study.until is not None:
        planned = max(planned, done + failed + _still_needed(place, study, plan))
    missing = planned - done - failed
    rates = [each.rate for each in heartbeats if each.rate]
    rate = sum(rates) if rates else None
    running = min(missing, sum(each.running for each in heartbeats))
    left = seconds_left(missing, rate)
    return Status(planned, done, failed, missing, running, left, rate, sweeps, tuple(place.damaged()))


def count_planned(runs: RunSet, plan: Plan, study: Study) -> int:
    """Return how many of these runs the study plans; in an adaptive study, all runs of its settings are planned."""
    index = plan.index_of(runs.ids) if runs.size else np.empty(0, np.int64)
    is_planned = index >= 0
    if study.until is None:
        is_planned &= runs.replicates < study.replicates
    return int(np.count_nonzero(is_planned))


def planned_runs(study: Study, plan: Plan, heartbeats: tuple[Progress, ...]) -> int:
    """Return the number of planned runs; of an adaptive study, as far as its sweeps have found out."""
    if study.until is None:
        return plan.runs
    # Each shard of a job array knows of its own runs.
    totals: defaultdict[str, int] = defaultdict(int)
    for each in heartbeats:
        totals[each.shard.partition("/")[2]] += each.total
    return max(plan.runs, *totals.values(), 0)


def _still_needed(place: StudyFolder, study: Study, plan: Plan) -> int:
    """Return how many more runs an adaptive study needs, as far as its runs say."""
    from teamsight.analysis.studies import rows

    assert study.until is not None
    runs = place.read("runs", [*IDENTITY, study.until.measure], skip_damaged=True)
    failed = place.read("failed", IDENTITY, skip_damaged=True)
    return rows.planned_and_missing(study, plan, rows.together(runs, failed, plan))[1]


def _running(place: StudyFolder) -> tuple[Running, ...]:
    """Return the sweeps that run now, with the heartbeat that each has written."""
    found = {(each.pid, each.host, each.shard): each for each in place.progress}
    return tuple(Running(one, found.get((one.pid, one.host, one.shard))) for one in holders(place.path))
