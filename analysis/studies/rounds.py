"""The rounds of a sweep: make what is missing, and in adaptive studies see whether more is needed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.runs.attempt import advancing
from teamsight.analysis.studies.definition.model import check_measured
from teamsight.analysis.studies.folder.run_set import joined
from teamsight.analysis.studies.missing import Selection
from teamsight.analysis.studies.part_tables import DETAIL, is_at_odds
from teamsight.analysis.studies.shard import Common, Shard, ShardResult, died, make_shard
from teamsight.analysis.studies.sharding import Sharding, Sized
from teamsight.analysis.studies.standing import Standing, present_in, standing
from teamsight.analysis.studies.warm_up import one_of_each_kind, warm_up

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor, Outcome
    from teamsight.analysis.studies.folder.progress import Heartbeat
    from teamsight.analysis.studies.folder.run_set import RunSet
    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

# Failed runs whose errors are kept for the summary.
_MOST_ERRORS = 5


@dataclass
class Counts:
    """Numbers of runs: planned so far, done, failed, and made by this sweep."""

    planned: int = 0
    done: int = 0
    failed: int = 0
    made: int = 0


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
    counts : Counts
        How far it is.
    errors : list of (str, str)
        The id and the error of the first runs that failed.
    wide : int
        Settings that have reached the limit of an adaptive study with a wider interval than wanted.
    """

    def __init__(
        self, study: Study, plan: Plan, common: Common, folder: StudyFolder, engine: Executor, *, heartbeat: Heartbeat,
        progress: Callable[[int, int, float | None], object], emit: Callable[[str], object],
        shard: tuple[int, int] | None, retry_failed: bool, stops: bool, only: RunSet | None = None,
    ) -> None:  # fmt: skip
        self.counts, self.errors, self.wide = Counts(), list[tuple[str, str]](), 0
        self._study, self._plan, self._common, self._folder, self._engine = study, plan, common, folder, engine
        self._heartbeat, self._progress, self._emit, self._shard = heartbeat, progress, emit, shard
        self._retry_failed, self._stops, self._only = retry_failed, stops, only
        self._rate: float | None = None
        self._in_flight: dict[int, Sized] = {}
        # Runs that are made but not yet here, by the names of their shards.
        self._made_of: dict[Hashable, int] = {}
        self._unsaid: Exception | None = None

    def run(self) -> None:
        """Make rounds until nothing is missing, or a run fails that shall stop the sweep."""
        found = self._standing()
        while True:
            # Other shards see to the settings that are theirs.
            missing, own = self._missing(found.needed)
            self.wide = int((found.is_wide & own).sum())
            self._report()
            if not missing.size:
                return
            self._make(missing)
            if self._study.until is None or self._only is not None or (self._stops and self.errors):
                return
            found = self._standing()

    def _missing(self, needed: NDArray[np.int64]) -> tuple[Selection, NDArray[np.bool_]]:
        """Return the runs that are neither done nor failed, and which settings are in the shard; count the others."""
        if self._only is not None:
            # Runs that were lost may be later than the first gap, up to which an adaptive study knows what it needs.
            needed, index = needed.copy(), self._plan.index_of(self._only.ids)
            np.maximum.at(needed, index[index >= 0], self._only.replicates[index >= 0] + 1)
        selected = Selection(self._plan, needed, self._shard, by_setting=self._study.until is not None)
        done, failed, own = self._folder.done(), self._folder.failed(), selected.settings
        if self._retry_failed and not self.counts.made:
            # In later rounds, failed runs have been made again.
            failed = joined([])
        beyond = selected.beyond(done), selected.beyond(failed)
        self.counts.planned = selected.size + sum(beyond)
        self.counts.done = beyond[0] + selected.remove(done)
        self.counts.failed = beyond[1] + selected.remove(failed)
        if self._only is not None:
            selected.keep(self._only)
        return selected, own

    def _make(self, missing: Selection) -> None:
        if self._engine.size > 1 and self._rate is None:
            self._warm_up()
        sharding = Sharding(self._plan, self._common, missing, self._engine.size, self._rate)
        while not sharding.is_empty:
            self._in_flight.clear()
            self._made_of.clear()
            with (
                advancing(self._advance),
                contextlib.closing(self._engine.outcomes(make_shard, self._jobs(sharding))) as outcomes,
            ):
                for outcome in outcomes:
                    self._take(outcome, sharding)
                    if self._stops and self.errors:
                        return
        self._rate = sharding.rate

    def _warm_up(self) -> None:
        """Compile in one worker, before others would compile the same."""
        with contextlib.closing(self._engine.outcomes(warm_up, [one_of_each_kind(self._plan, self._common)])) as found:
            for outcome in found:
                if outcome.status in ("failed", "unsent"):
                    raise _fatal(outcome, "the first runs")

    def _jobs(self, sharding: Sharding) -> Iterator[Shard]:
        for index, sized in enumerate(sharding):
            self._in_flight[index] = sized
            yield sized.shard

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
        sized = self._in_flight.pop(outcome.index)
        self._made_of.pop(sized.shard.name, None)
        if outcome.status == "died":
            if len(sized.shard.runs) > 1:
                sharding.divide(sized)
                return
            self._write(sized.shard, died(sized.shard, _death(outcome.value)))
        elif outcome.status == "done":
            result: ShardResult = outcome.value
            sharding.measured(sized, result.seconds, result.done)
            if not self._agrees(result, sharding):
                sharding.repeat(sized)
                return
            self._write(sized.shard, result)
        else:
            raise _fatal(outcome, sized.shard.describe())
        if self._unsaid is not None:
            raise self._unsaid
        self._report()

    def _agrees(self, result: ShardResult, sharding: Sharding) -> bool:
        """Whether measures are of the types of the parts that are there; the first part decides about new ones."""
        known = self._common.kinds
        if any(kind is not None and known.get(name) is None for name, kind in result.kinds.items()):
            # Another shard of a job array may have been first.
            known = self._folder.settle(result.kinds)
            self._common = self._common._replace(kinds=dict(known))
            sharding.know(self._common)
        return not is_at_odds(known, result.kinds)

    def _write(self, shard: Shard, result: ShardResult) -> None:
        self._folder.write(result.parts, [run.id for run in shard.runs])
        if result.done and self._study.until is not None:
            kinds = {**result.kinds, **self._common.kinds}
            check_measured(self._study.until, {name: kinds[name] for name in kinds if not name.startswith(DETAIL)})
        self.counts.done += result.done
        self.counts.failed += len(result.failed)
        self.counts.made += len(shard.runs)
        if result.failed and not self.errors:
            # At once, since it may be the first of many.
            run, error = result.failed[0]
            self._emit(f"run {run} failed: {error}")
        self.errors.extend(result.failed[: _MOST_ERRORS - len(self.errors)])

    def _report(self) -> None:
        counts = self.counts
        held = sum(len(sized.shard.runs) for sized in self._in_flight.values())
        made = sum(self._made_of.values())
        self._heartbeat.update(
            counts.done, counts.planned, failed=counts.failed, running=held, made=counts.made, unwritten=made
        )
        self._progress(counts.done + counts.failed + made, counts.planned, self._heartbeat.seconds_left)

    def _standing(self) -> Standing:
        """Return how far the study is by what was measured so far."""
        return standing(self._study, self._plan, present_in(self._folder, self._study, self._plan))


def _death(value: object) -> str:
    """Return the error of a run that no worker survived."""
    if not isinstance(value, int):
        return str(value)
    cure = "; if memory ran out, use fewer workers" if value < 0 else ""
    return f"the worker ended with exit code {value}, three times{cure}"


def _fatal(outcome: Outcome, what: str) -> Exception:
    """Return the error for a shard that cannot be made."""
    from teamsight.analysis.runs.workers import JobError

    text = outcome.value[0] if outcome.status == "failed" else f"{outcome.value} (in {what})"
    return JobError(" ".join(str(text).split()))
