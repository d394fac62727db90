"""How far a study is, and which runs an adaptive one still needs."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.model import Until
from teamsight.analysis.studies.folder.lock import Holder, holders
from teamsight.analysis.studies.folder.parts import IDENTITY, Damaged, RunSet, joined, runs_in
from teamsight.analysis.studies.folder.progress import Progress
from teamsight.analysis.studies.folder.study_folder import StudyFolder

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pyarrow as pa

    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study


class Present(NamedTuple):
    """Distinct runs of the settings of a plan that are done or have failed.

    Attributes
    ----------
    setting, replicate : array of int
        The number of the setting in the plan, and that of the replicate.
    has_failed : array of bool
        Whether the run has failed.
    value : array of float
        What `Until.measure` names; NaN for failed runs, and in studies that are not adaptive.
    is_flag : bool
        Whether that is True or False.
    """

    setting: NDArray[np.int64]
    replicate: NDArray[np.int64]
    has_failed: NDArray[np.bool_]
    value: NDArray[np.float64]
    is_flag: bool

    def without(self, lost: RunSet, plan: Plan) -> Present:
        """Return what is left without the runs of which a part is lost: a sweep makes them again."""
        is_lost = RunSet(plan.ids[self.setting], self.replicate).are_in(lost)
        kept = ~is_lost | self.has_failed
        return Present(
            self.setting[kept], self.replicate[kept], self.has_failed[kept], self.value[kept], self.is_flag
        )


class Standing(NamedTuple):
    """How far a study is.

    Attributes
    ----------
    needed : array of int
        Replicates that each setting needs, as far as its runs show.
    is_wide : array of bool
        Whether a setting has reached the limit of `Until` with a wider interval than wanted.
    planned, done, failed, missing : int
        Numbers of runs.
    """

    needed: NDArray[np.int64]
    is_wide: NDArray[np.bool_]
    planned: int
    done: int
    failed: int
    missing: int


def standing(study: Study, plan: Plan, present: Present) -> Standing:
    """Return how far a study is by the runs that are there."""
    needed, is_wide = np.full(plan.settings, study.replicates, np.int64), np.zeros(plan.settings, bool)
    if study.until is not None:
        needed, is_wide = all_needed(study.until, study.replicates, present, plan.settings)
    total = len(present.setting)
    missing = int(needed.sum()) - int((present.replicate < needed[present.setting]).sum())
    failed = int(present.has_failed.sum())
    return Standing(needed, is_wide, total + missing, total - failed, failed, missing)


def present_in(folder: StudyFolder, study: Study, plan: Plan, *, skip_damaged: bool = False) -> Present:
    """Return the runs of a folder; parts are read only if the study is adaptive.

    Raises
    ------
    DamagedError
        If a part is damaged and is not to be skipped.
    """
    failed = folder.failed()
    if study.until is None:
        done, values, is_flag = folder.done(), None, False
    else:
        table = folder.read("runs", [*IDENTITY, study.until.measure], skip_damaged=skip_damaged)
        done, (values, is_flag) = runs_in(table), values_of(table, study.until.measure)
    # One that was made in the meantime is done.
    runs = joined([done, failed.without(done)])
    value = np.full(runs.size, np.nan)
    if values is not None:
        value[: done.size] = values
    setting = plan.index_of(runs.ids) if runs.size else np.empty(0, np.int64)
    has_failed, is_planned = np.arange(runs.size) >= done.size, setting >= 0
    present = Present(
        setting[is_planned], runs.replicates[is_planned], has_failed[is_planned], value[is_planned], is_flag
    )
    # In studies that are not adaptive, they are left out of `done` already.
    return present if values is None else present.without(folder.lost(), plan)


def values_of(table: pa.Table, measure: str) -> tuple[NDArray[np.float64], bool]:
    """Return a measure as numbers, and whether it is True or False; NaN where it has no value or is a text."""
    import pyarrow as pa

    if measure in table.column_names and not pa.types.is_string(table[measure].type):
        column = table[measure]
        return column.cast(pa.float64()).to_numpy(), bool(pa.types.is_boolean(column.type))
    return np.full(table.num_rows, np.nan), False


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
    """Return how far a study is, read from its folder without writing, also while a sweep runs.

    Raises
    ------
    ValueError
        If this is not the folder of a study.
    """
    place = StudyFolder(folder)
    study = place.study
    # What is read later holds at least as many runs: none is reported as missing that has just been made.
    beats = {(each.pid, each.host, each.shard): each for each in place.progress}
    sweeps = tuple(Running(one, beats.get((one.pid, one.host, one.shard))) for one in holders(place.path))
    heartbeats = [each.progress for each in sweeps if each.progress]
    plan = study.plan()
    found = standing(study, plan, present_in(place, study, plan, skip_damaged=True))
    rate = sum(each.rate or 0.0 for each in heartbeats) or None
    running = min(found.missing, sum(each.running for each in heartbeats))
    return Status(
        found.planned, found.done, found.failed, found.missing, running, found.missing / rate if rate else None, rate,
        sweeps, tuple(place.damaged()), int(found.is_wide.sum()), place.not_finite(),
    )  # fmt: skip


def not_finite_note(counts: Mapping[str, int]) -> str:
    """Return in words in how many runs measures are NaN or infinite; empty for none."""
    if not counts:
        return ""
    each = (f"{name} in {count:,} {'run' if count == 1 else 'runs'}" for name, count in counts.items())
    return f"NaN or infinite: {', '.join(each)}; these runs count as done"


def wide_note(count: int, settings: int, until: Until | None) -> str:
    """Return in words how many settings reached the limit with a wider interval than wanted; empty for none."""
    if until is None or not count:
        return ""
    return (
        f"{count:,} of {settings:,} settings reached until.limit={until.limit} with an interval wider than "
        f"{until.interval:g}; raise until.limit"
    )


#: Replicates at the first look: a spread that few runs show may be far too small.
FIRST_LOOK = 30
#: Growth from one look to the next.
GROWTH = 1.25
#: Successive looks at which the interval must be narrow enough.
NARROW_LOOKS = 2
#: Replicates that a setting has at least if all of its values are equal: a rare event shows in none of a few runs.
FEWEST_EQUAL = 100


def looks(until: Until, start: int, first_look: int = FIRST_LOOK) -> Iterator[int]:
    """Yield the numbers of replicates at which the interval is looked at: 30, 38, 48, 60, …; the last is the limit.

    Parameters
    ----------
    until : Until
        The limit.
    start : int
        The replicates of the study: the first ones. Looks at fewer are left out, and none is moved. So a study whose
        replicates were raised looks as one that began with as many.
    """
    count = first_look
    while count < until.limit:
        if count >= start:
            yield count
        count = math.ceil(count * GROWTH)
    yield until.limit


def fewest(until: Until) -> int:
    """Return the replicates that each setting gets at least: those of the look at which the first may be enough."""
    return list(islice(looks(until, 1), NARROW_LOOKS))[-1]


def all_needed(
    until: Until, start: int, present: Present, settings: int, first_look: int = FIRST_LOOK
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return how many replicates each setting needs, as far as its present ones show.

    The interval is looked at when the setting has certain numbers of replicates, and must be narrow enough at two
    looks in succession. So the answer depends on the setting's own replicates 0, 1, … alone, and not on the order or
    the pieces in which they were made. Of numbers that are all equal, fewer than 100 are not enough.

    Parameters
    ----------
    until : Until
        The interval and the limit.
    start : int
        The replicates of the study: the first ones.
    present : Present
        The runs that were made, in any order. The interval of True and False is Wilson's, otherwise Student's.
    settings : int
        The number of settings.
    first_look : int
        The first look; the table below is for that of the studies.

    Returns
    -------
    (array of int, array of bool)
        The number of replicates of each setting, of which no more are needed if it has them all; and whether it has
        reached the limit, and its interval is still wider than wanted.

    Notes
    -----
    To stop as soon as one interval is narrow favours samples whose spread is too small by chance. Simulated coverage of
    the last interval, which a fixed number of replicates has at 95 %
    (``benchmarks/adaptive_coverage.py``: wanted intervals that 12 to 80 replicates would have, standard error 0.2 %):

    ==========================================  ================  ===============
    measure                                     first narrow one  this rule
    ==========================================  ================  ===============
    normal, uniform, beta(2, 5), Poisson(3)     92.3 to 95.0 %    94.1 to 95.2 %
    lognormal(0, 1)                             77.5 to 83.9 %    87.4 to 89.1 %
    True in 50, 10, 2 or 1 % of runs            not compared      94.8 to 97.9 %
    the numbers 0 and 1: 1 in 50 % of runs      89.7 to 94.5 %    93.2 to 96.7 %
    the same, 1 in 10 % of runs                 61.0 to 65.5 %    89.8 to 91.2 %
    the same, 1 in 2 % of runs                  17.8 to 18.5 %    90.4 to 90.8 %
    the same, 1 in 1 % of runs                  9.3 to 10.0 %     69.2 to 69.9 %
    ==========================================  ================  ===============

    So annotate what happens or not as bool. For numbers that are nearly always the same, or that few runs dominate,
    give `replicates` instead.
    """
    # Slow to import.
    from teamsight.analysis.studies.summary import intervals

    order = np.lexsort((present.replicate, present.setting))
    setting, replicate, value = present.setting[order], present.replicate[order], present.value[order]
    needed, narrow = np.full(settings, -1, np.int64), np.zeros(settings, np.int64)
    is_wide = np.zeros(settings, bool)
    for count in looks(until, start, first_look):
        within = replicate < count
        made = np.bincount(setting[within], minlength=settings)
        needed[(needed < 0) & (made < count)] = count
        chosen = within & np.isfinite(value)
        cell, finite = setting[chosen], value[chosen]
        values, *_, width = intervals(finite, cell, settings, are_flags=present.is_flag)
        # Rounding moves the mean of equal values away from them: they are compared themselves.
        first = np.cumsum(values) - values
        has_spread = np.bincount(cell, finite != finite[first[cell]], settings) > 0
        if not present.is_flag:
            width[~has_spread & (values > 1)] = 0.0
        narrow = np.where(width <= until.interval, narrow + 1, 0)
        is_enough = (narrow >= NARROW_LOOKS) & (present.is_flag | has_spread | (values >= FEWEST_EQUAL))
        # Where no run of a setting succeeds, more would be of no use.
        is_last = (values == 0) | (count == until.limit)
        is_wide |= (needed < 0) & is_last & (values > 0) & (narrow == 0)
        needed[(needed < 0) & (is_enough | is_last)] = count
        open_ = needed < 0
        if not open_.any():
            break
        kept = open_[setting]
        setting, replicate, value = setting[kept], replicate[kept], value[kept]
    return needed, is_wide
