"""`status`: how far a study is, read from its folder without writing."""

from __future__ import annotations

import os
from typing import NamedTuple

from teamsight.analysis.studies.folder.lock import Holder, holders
from teamsight.analysis.studies.folder.parts import Damaged
from teamsight.analysis.studies.folder.progress import Progress, seconds_left
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.standing import present_in, standing


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
        Runs that are there and those that are missing; of an adaptive study, as far as its runs show.
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
    wide : int
        Settings of an adaptive study that have reached its limit with a wider interval than wanted.
    not_finite : dict of str to int
        In how many of the runs that are done a measure is NaN or infinite, by its name.
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
    wide: int
    not_finite: dict[str, int]


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
    found = standing(study, plan, present_in(place, study, plan, skip_damaged=True))
    rates = [each.rate for each in heartbeats if each.rate]
    rate = sum(rates) if rates else None
    running = min(found.missing, sum(each.running for each in heartbeats))
    return Status(
        found.planned, found.done, found.failed, found.missing, running, seconds_left(found.missing, rate), rate,
        sweeps, tuple(place.damaged()), int(found.is_wide.sum()), place.not_finite(),
    )  # fmt: skip


def _running(place: StudyFolder) -> tuple[Running, ...]:
    """Return the sweeps that run now, with the heartbeat that each has written."""
    found = {(each.pid, each.host, each.shard): each for each in place.progress}
    return tuple(Running(one, found.get((one.pid, one.host, one.shard))) for one in holders(place.path))
