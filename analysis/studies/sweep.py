"""`sweep`: make the runs of a study that are missing in its folder."""

from __future__ import annotations

import contextlib
import os
import time
import warnings
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.runs.executor import advancing, death, error_of
from teamsight.analysis.runs.processes import WorkerPool, check_workers, workers_for
from teamsight.analysis.runs.progress_line import check_progress, reported
from teamsight.analysis.studies.definition.model import check_measured, in_full
from teamsight.analysis.studies.definition.values import hex_of
from teamsight.analysis.studies.folder.lock import check_shard
from teamsight.analysis.studies.folder.parts import joined
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.shard import (
    DETAIL,
    Common,
    Shard,
    ShardResult,
    ShardRun,
    common_of,
    died,
    end_recording,
    failure_of,
    make_shard,
    recording,
)
from teamsight.analysis.studies.standing import Standing, fewest, not_finite_note, present_in, standing, wide_note
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor, Outcome
    from teamsight.analysis.studies.folder.parts import RunSet
    from teamsight.analysis.studies.folder.progress import Heartbeat
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

# Settings whose runs are listed at a time.
_BLOCK = 1024
# Replicates that all settings get before any gets more, and how much more each time.
_FIRST, _GROWTH = 2, 4


class Selection:
    """Runs of a plan: one bit for each setting, in the order in which settings are run, and replicate.

    Parameters
    ----------
    plan : Plan
        The plan.
    needed : ndarray, shape (S,), int64
        Number of replicates of each setting.
    shard : (int, int), optional
        Only shard i of n, from 1. A study whose settings need different numbers of replicates is divided by settings.
    by_setting : bool
        Divide by settings.
    """

    def __init__(
        self, plan: Plan, needed: NDArray[np.int64], shard: tuple[int, int] | None = None, *, by_setting: bool = False
    ) -> None:
        self._plan, self._needed, self._by_setting = plan, needed, by_setting
        self._part, self._parts = shard or (1, 1)
        self._position = np.empty(plan.settings, np.int64)
        self._position[plan.order] = np.arange(plan.settings)
        replicates = np.arange(int(needed.max(initial=0)))
        self._is_selected: NDArray[np.bool_] = np.greater.outer(needed[plan.order], replicates)
        for first in range(min(self._parts, plan.settings) if shard else 0):
            self._is_selected[first :: self._parts] &= self._is_own(np.array(first), replicates)

    def _is_own(self, row: NDArray[np.int64], replicate: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether runs are in the shard: each has some replicates of each setting, so that all take about as long."""
        found: NDArray[np.bool_] = (row + replicate * (not self._by_setting)) % self._parts == self._part - 1
        return np.broadcast_to(found, replicate.shape)

    @property
    def size(self) -> int:
        """The number of runs."""
        return int(np.count_nonzero(self._is_selected))

    @property
    def settings(self) -> NDArray[np.bool_]:
        """Whether any run of each setting is selected, in the order of the plan."""
        has_any: NDArray[np.bool_] = np.logical_or.reduce(self._is_selected, axis=1)
        return has_any[self._position]

    def remove(self, runs: RunSet) -> int:
        """Remove runs; return how many were selected."""
        places = self._places(runs)
        count = int(np.count_nonzero(self._is_selected[places]))
        self._is_selected[places] = False
        return count

    def keep(self, runs: RunSet) -> None:
        """Keep only these runs."""
        places = self._places(runs)
        kept = np.zeros_like(self._is_selected)
        kept[places] = self._is_selected[places]
        self._is_selected = kept

    def _places(self, runs: RunSet) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where the bits of runs are; those that are not planned have none."""
        index = self._plan.index_of(runs.ids)
        within = (index >= 0) & (runs.replicates >= 0) & (runs.replicates < self._is_selected.shape[1])
        return self._position[index[within]], runs.replicates[within]

    def beyond(self, runs: RunSet) -> int:
        """Return how many of these runs have a higher number than their setting needs now; they are kept."""
        index = self._plan.index_of(runs.ids)
        index, replicates = index[index >= 0], runs.replicates[index >= 0]
        is_own = self._is_own(self._position[index], replicates)
        return int(np.count_nonzero(is_own & (replicates >= self._needed[index])))

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Yield setting and replicate of each run, so that alike ones follow each other.

        First come a few replicates of all settings, so that what is there after an interruption shows all of them.
        """
        begin, end = 0, _FIRST
        while begin < self._is_selected.shape[1]:
            for first in range(0, len(self._is_selected), _BLOCK):
                rows, replicates = np.nonzero(self._is_selected[first : first + _BLOCK, begin:end])
                yield from zip(self._plan.order[first + rows].tolist(), (begin + replicates).tolist(), strict=True)
            begin, end = end, end * _GROWTH


# Work of a shard [s], and of the first ones, as long as the rate is not known.
_SECONDS, _FIRST_SECONDS = 2.0, 0.25
# The least work of a shard at the end, where shards are smaller so that all workers end together [s].
_LEAST_SECONDS = 0.1
# Shards into which what is left is divided for each worker.
_SHARDS_PER_WORKER = 4
# Cost per second of CMOMMT, as `Run.cost` counts it, until it is measured. Other models begin with single runs.
_RATES = {"cmommt": 800_000.0}
# Runs of a shard: each is a row in memory.
_MOST_RUNS = 10_000
# Into how many pieces a shard is divided in which workers died.
_PIECES = 8
# Share of the last shard in a rate that rises.
_WEIGHT = 0.5
# The most runs per second where all have failed.
_MOST_FAILING = 100.0
# Settings whose cost is looked at, to estimate how long a study takes.
_MOST_EXAMINED = 100


def expected_seconds(plan: Plan, replicates: int) -> float | None:
    """Return about how long one worker takes for all runs of a study [s]; None for a model that is not known.

    Parameters
    ----------
    plan : Plan
        The plan of the study.
    replicates : int
        Replicates of each setting.
    """
    rate = _RATES.get(plan.study.model)
    if rate is None:
        return None
    count = min(plan.settings, _MOST_EXAMINED)
    examined = [plan.settings * number // count for number in range(count)]
    return sum(map(plan.cost, examined)) / count * plan.settings * replicates / rate


class Sharding:
    """An iterator over shards, whose size follows the measured rate.

    Parameters
    ----------
    plan : Plan
        The plan of the study.
    common : Common
        What all runs share.
    missing : Selection
        The runs, in the order in which they are made.
    workers : int
        Number of shards that are made at the same time.
    rate : float, optional
        Cost per second of one worker, as far as it is known.

    Attributes
    ----------
    rate : float or None
        Cost per second of one worker as it was measured last.
    common : Common
        What all runs of further shards share.
    """

    def __init__(self, plan: Plan, common: Common, missing: Selection, workers: int, rate: float | None = None) -> None:
        self.rate, self.common = rate, common
        self._plan, self._workers = plan, workers
        self._left = missing.size
        self._runs = iter(missing)
        self._again: deque[Shard] = deque()
        # Of one setting after the other, since neighbouring runs often share it.
        self._setting, self._id, self._parameters, self._cost = -1, "", dict[str, object](), 1.0

    def __iter__(self) -> Iterator[Shard]:
        while not self.is_empty:
            # With what all runs share now.
            yield self._again.popleft()._replace(common=self.common) if self._again else self._following()

    @property
    def is_empty(self) -> bool:
        """Whether each shard was taken."""
        return not self._again and not self._left

    def measured(self, shard: Shard, seconds: float, done: int) -> None:
        """Take note of how long a shard took [s], and of how many of its runs did not fail."""
        runs = len(shard.runs)
        rate = shard.cost / max(seconds, 1e-6)
        # Runs that fail at once do not show how long others take.
        rate = rate * done / runs if done else min(rate, shard.cost / runs * _MOST_FAILING)
        # Shards that take too long cost more than short ones: what they have made is lost in an interruption.
        if self.rate is None or rate < self.rate:
            self.rate = rate
        else:
            self.rate += _WEIGHT * (rate - self.rate)

    def repeat(self, shard: Shard, pieces: int = 1) -> None:
        """Make a shard again, in pieces."""
        runs = shard.runs
        size = -(-len(runs) // pieces)
        for first in range(0, len(runs), size):
            piece = runs[first : first + size]
            self._again.append(Shard(shard.common, piece, shard.cost * len(piece) / len(runs)))

    def _following(self) -> Shard:
        """Return the next shard of runs that were not taken yet."""
        runs: list[ShardRun] = []
        cost, room, most = 0.0, 0.0, _MOST_RUNS
        if self.rate is None and self._workers > 1:
            # Runs may take much longer than expected, with a slow measure: each worker shall have some.
            most = min(most, -(-self._left // (_SHARDS_PER_WORKER * self._workers)))
        while self._left and len(runs) < most and (not runs or cost < room):
            setting, replicate = next(self._runs)
            if setting != self._setting:
                self._setting, self._id = setting, hex_of(self._plan.ids[setting])
                self._parameters = self._plan.parameters(setting)
                # A component that cannot be made is an error of the run, not of the sweep.
                with contextlib.suppress(Exception):
                    self._cost = self._plan.cost(setting)
            if not runs:
                room = self._room()
            runs.append(ShardRun(self._id, replicate, self._plan.seed(setting, replicate), self._parameters))
            cost += self._cost
            self._left -= 1
        return Shard(self.common, tuple(runs), cost)

    def _room(self) -> float:
        """Return the cost of the next shard, which begins with a run of the present setting."""
        rate = self.rate or _RATES.get(self.common.model)
        if rate is None:
            return 0.0
        seconds = _SECONDS if self.rate else _FIRST_SECONDS
        if self._workers > 1:
            share = self._left * self._cost / rate / (_SHARDS_PER_WORKER * self._workers)
            seconds = min(seconds, max(share, _LEAST_SECONDS))
        return seconds * rate


# Settings that are examined, and kinds of runs that are made.
_MOST_WARMED, _MOST_KINDS = 256, 32


def one_of_each_kind(plan: Plan, common: Common) -> Shard:
    """Return a run for each combination of values that are no numbers, since numbers do not change what is compiled."""
    # Alike settings follow each other, so these meet all kinds that have many settings.
    places = np.linspace(0, plan.settings - 1, min(plan.settings, _MOST_WARMED)).astype(int)
    kinds: dict[str, ShardRun] = {}
    for setting in plan.order[places].tolist():
        parameters = plan.parameters(setting)
        kind = repr({name: parameters.get(name) for name, type_ in common.types.items() if type_ in ("text", "flag")})
        if len(kinds) < _MOST_KINDS and kind not in kinds:
            kinds[kind] = ShardRun(hex_of(plan.ids[setting]), 0, plan.seed(setting, 0), parameters)
    return Shard(common, tuple(kinds.values()))


def warm_up(shard: Shard) -> None:
    """Make one step of each run; errors are left to the runs themselves.

    Raises
    ------
    SourceError
        If this process has another version of the code.
    """
    with warnings.catch_warnings(), recording(shard.common) as recorder:
        warnings.simplefilter("ignore")
        for run in shard.runs:
            with _left_to_the_runs():
                recorder.begin(recorder.parameters(run.parameters), run.seed).run(1)


@contextlib.contextmanager
def _left_to_the_runs() -> Iterator[None]:
    """Pass over what the runs themselves keep as their failure, such as the `SystemExit` of a model."""
    try:
        yield
    except BaseException as error:
        failure_of(error)  # raises an interrupt of this process again


# Failed runs whose errors are kept for the summary.
_MOST_ERRORS = 5

#: Called with the number of runs that are done or have failed, their number in all, and the seconds left or None.
Progress = Callable[[int, int, float | None], object]
OnError = Literal["continue", "stop"]


@dataclass
class Rounds:
    """Makes the missing runs of a study.

    Parameters
    ----------
    study, plan, common : Study, Plan, Common
        What is to be run.
    folder : StudyFolder
        Where parts are written; locked.
    engine : Executor
        What makes shards.
    heartbeat : Heartbeat
        Takes note of how far the sweep is.
    progress, emit : callable
        Called with runs done, runs in all, and seconds left; and with messages.
    shard : (int, int), optional
        Make shard i of n only.
    retry_failed : bool
        Make failed runs again.
    stops : bool
        Stop after a run that fails.
    only : RunSet, optional
        Make only missing runs among these.

    Attributes
    ----------
    planned, done, failed, made : int
        Numbers of runs; `made` by this sweep.
    errors : list of (str, str)
        The id and the error of the first runs that failed.
    wide : int
        Settings that have reached the limit of an adaptive study with a wider interval than wanted.
    """

    study: Study
    plan: Plan
    common: Common
    folder: StudyFolder
    engine: Executor
    heartbeat: Heartbeat
    progress: Progress
    emit: Callable[[str], object]
    shard: tuple[int, int] | None
    retry_failed: bool
    stops: bool
    only: RunSet | None
    planned: int = 0
    done: int = 0
    failed: int = 0
    made: int = 0
    errors: list[tuple[str, str]] = field(default_factory=list)
    wide: int = 0
    _rate: float | None = None
    _in_flight: dict[int, Shard] = field(default_factory=dict)
    # Runs that are made but not yet here, by the names of their shards.
    _made_of: dict[Hashable, int] = field(default_factory=dict)
    _unsaid: Exception | None = None

    def run(self) -> None:
        """Make rounds until nothing is missing, or a run fails that shall stop the sweep."""
        while True:
            found = standing(self.study, self.plan, present_in(self.folder, self.study, self.plan))
            missing = self._missing(found)
            self._report()
            if not missing.size:
                return
            self._make(missing)
            if self.study.until is None or self.only is not None or (self.stops and self.errors):
                return

    def _missing(self, found: Standing) -> Selection:
        """Return the runs that are neither done nor failed, and count the others."""
        needed = found.needed
        if self.only is not None:
            # Runs that were lost may be later than the first gap, up to which an adaptive study knows what it needs.
            needed, index = needed.copy(), self.plan.index_of(self.only.ids)
            np.maximum.at(needed, index[index >= 0], self.only.replicates[index >= 0] + 1)
        selected = Selection(self.plan, needed, self.shard, by_setting=self.study.until is not None)
        # Other shards see to the settings that are theirs.
        self.wide = int((found.is_wide & selected.settings).sum())
        # In later rounds, failed runs have been made again.
        failed = joined([]) if self.retry_failed and not self.made else self.folder.failed()
        done = self.folder.done()
        beyond = selected.beyond(done), selected.beyond(failed)
        self.planned = selected.size + sum(beyond)
        self.done = beyond[0] + selected.remove(done)
        self.failed = beyond[1] + selected.remove(failed)
        if self.only is not None:
            selected.keep(self.only)
        return selected

    def _make(self, missing: Selection) -> None:
        if self.engine.size > 1 and self._rate is None:
            # One worker compiles before others would compile the same; meanwhile these start, and import the model.
            kinds = one_of_each_kind(self.plan, self.common)
            jobs = [kinds] + [kinds._replace(runs=())] * (self.engine.size - 1)
            with contextlib.closing(self.engine.outcomes(warm_up, jobs)) as found:
                for outcome in found:
                    if outcome.status in ("failed", "unsent"):
                        raise error_of(outcome, "the first runs")
        sharding = Sharding(self.plan, self.common, missing, self.engine.size, self._rate)
        while not sharding.is_empty:
            self._in_flight.clear()
            self._made_of.clear()
            with (
                advancing(self._advance),
                contextlib.closing(self.engine.outcomes(make_shard, self._jobs(sharding))) as outcomes,
            ):
                for outcome in outcomes:
                    self._take(outcome, sharding)
                    if self.stops and self.errors:
                        return
        self._rate = sharding.rate

    def _jobs(self, sharding: Sharding) -> Iterator[Shard]:
        for index, shard in enumerate(sharding):
            self._in_flight[index] = shard
            yield shard

    def _advance(self, shard: Hashable, made: int) -> None:
        self._made_of[shard] = made
        # Within a job of this process, an error of the caller's function would be one of the job.
        if self._unsaid is None:
            try:
                self._report()
            except Exception as error:
                self._unsaid = error

    def _take(self, outcome: Outcome, sharding: Sharding) -> None:
        """Write what a worker has made."""
        shard = self._in_flight.pop(outcome.index)
        self._made_of.pop(shard.name, None)
        if outcome.status == "died":
            if len(shard.runs) > 1:
                sharding.repeat(shard, _PIECES)
                return
            self._write(shard, died(shard, death(outcome.value)))
        elif outcome.status == "done":
            result: ShardResult = outcome.value
            sharding.measured(shard, result.seconds, result.done)
            if not self._agrees(result, sharding):
                sharding.repeat(shard)
                return
            self._write(shard, result)
        else:
            raise error_of(outcome, shard.describe())
        if self._unsaid is not None:
            raise self._unsaid
        self._report()

    def _agrees(self, result: ShardResult, sharding: Sharding) -> bool:
        """Whether measures are of the types of the parts that are there; the first part decides about new ones."""
        kinds, known = {name: kind for name, kind in result.kinds.items() if kind is not None}, self.common.kinds
        if any(known.get(name) is None for name in kinds):
            # Another shard of a job array may have been first.
            known = self.folder.settle(kinds)
            self.common = sharding.common = self.common._replace(kinds=dict(known))
        return all(known.get(name) in (None, kind) for name, kind in kinds.items())

    def _write(self, shard: Shard, result: ShardResult) -> None:
        self.folder.write(result.parts, [run.id for run in shard.runs])
        if result.done and self.study.until is not None:
            kinds = {**result.kinds, **self.common.kinds}
            check_measured(self.study.until, {name: kinds[name] for name in kinds if not name.startswith(DETAIL)})
        self.done += result.done
        self.failed += len(result.failed)
        self.made += len(shard.runs)
        if result.failed and not self.errors:
            # At once, since it may be the first of many.
            run, error = result.failed[0]
            self.emit(f"run {run} failed: {error}")
        self.errors.extend(result.failed[: _MOST_ERRORS - len(self.errors)])

    def _report(self) -> None:
        held = sum(len(shard.runs) for shard in self._in_flight.values())
        made = sum(self._made_of.values())
        self.heartbeat.update(
            self.done, self.planned, failed=self.failed, running=held, made=self.made, unwritten=made
        )
        self.progress(self.done + self.failed + made, self.planned, self.heartbeat.seconds_left)


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
    progress: Progress | bool = True,
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
    progress : callable or bool
        As in `Study.run`.
    emit : callable
        Called with messages.

    Raises
    ------
    ValueError
        If an argument is wrong, or the folder cannot be used; see `StudyFolder`.
    JobError
        If no runs can be made, for example because a worker has other code.
    """
    began = time.perf_counter()
    checks.choice("on_error", on_error, ("continue", "stop"))
    check_progress(progress)
    check_shard(shard)
    if workers is not None:
        check_workers(workers)
    study, plan, common = _checked(study)
    if workers is None:
        most = study.replicates if study.until is None else study.until.limit
        workers = workers_for(expected_seconds(plan, most))
    folder = StudyFolder(out)
    with contextlib.ExitStack() as stack:
        stack.callback(end_recording)
        stack.enter_context(folder.lock(shard, wait, emit))
        manifest = folder.prepare(study, plan, code=common.code, sources=common.sources, mixed_code=mixed_code)
        common = common._replace(kinds=dict(manifest.holds))
        for damaged in folder.tidy() if shard is None else ():
            emit(f"damaged part set aside: {damaged.kind}/{damaged.name} ({damaged.reason}); its runs are made again")
        engine = executor or stack.enter_context(WorkerPool(workers, emit))
        name = type(engine).__name__.removesuffix("Executor").lower()
        if name == "workerpool":
            name = "local" if engine.size > 1 else "in-process"
        heartbeat = stack.enter_context(
            folder.recorded(engine=name, workers=engine.size, code=common.code, shard=shard)
        )
        if study.until is not None and study.replicates < (least := fewest(study.until)):
            emit(f"until: replicates={study.replicates} are only the first; each setting gets at least {least}")
        stops = on_error == "stop"
        report = stack.enter_context(reported(progress))
        rounds = Rounds(
            study, plan, common, folder, engine, heartbeat, report, emit, shard, retry_failed, stops, only
        )
        rounds.run()
    return SweepSummary(
        folder.path, rounds.made, rounds.planned, rounds.done, rounds.failed,
        rounds.planned - rounds.done - rounds.failed, tuple(rounds.errors), time.perf_counter() - began,
        wide_note(rounds.wide, plan.settings, study.until), not_finite_note(folder.not_finite()),
    )  # fmt: skip


def _checked(study: Study) -> tuple[Study, Plan, Common]:
    """Check a study; return it with the full name of its model, its plan, and what its runs share."""
    study.check()
    study = replace(study, model=in_full(study.model))
    plan = study.plan()
    return study, plan, common_of(study, plan.types)


def warm_up_study(study: Study) -> int:
    """Compile what the runs of a study need, for later processes too; return the number of kinds of runs.

    Raises
    ------
    TypeError, ValueError
        If the study is wrong; what fails in a run is left to the run.
    """
    _, plan, common = _checked(study)
    shard = one_of_each_kind(plan, common)
    warm_up(shard)
    end_recording()
    return len(shard.runs)
