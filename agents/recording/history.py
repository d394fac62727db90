"""The history: the completed steps, their totals, and the recorded positions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.records import CONDITIONAL_COLUMNS, HISTORY_COLUMNS
from teamsight.agents.engine.relation import Relation, counted_groups
from teamsight.agents.group import Group
from teamsight.core.table import Field, Table

Integers = npt.NDArray[np.int64]


class Totals(NamedTuple):
    """What was counted in some rows of the history; rows without anybody are left out.

    Attributes
    ----------
    counted : dict of int to int
        For each number of targets (or of robots), in order of appearance, the sum of observed targets (or of edges)
        over its rows.
    rows : int
        The number of rows.
    """

    counted: dict[int, int]
    rows: int

    def plus(self, other: Totals) -> Totals:
        """Return the totals of these rows and later ones."""
        if self is NOTHING:
            return other
        counted = dict(self.counted)
        for size, number in other.counted.items():
            counted[size] = counted.get(size, 0) + number
        return Totals(counted, self.rows + other.rows)

    @property
    def mean_share(self) -> float:
        """The mean over the rows of the share; NaN without rows."""
        return float(shares(self.counted) / self.rows) if self.rows else float("nan")


NOTHING = Totals({}, 0)


class Sums(NamedTuple):
    """What was summed in some rows: observed targets, edges between neighbours, and the largest degree."""

    observed: Totals = NOTHING
    edges: Totals = NOTHING
    largest: int = 0

    def plus(self, other: Sums) -> Sums:
        """Return the sums of these rows and of later ones."""
        largest = max(self.largest, other.largest)
        return Sums(self.observed.plus(other.observed), self.edges.plus(other.edges), largest)


def totals_of(sizes: int | Integers, numbers: Integers) -> Totals:
    """Return the totals of rows with these numbers of targets, or the same in all, and of observed targets."""
    if isinstance(sizes, int):
        return Totals({sizes: int(np.add.reduce(numbers))}, len(numbers)) if sizes and len(numbers) else NOTHING
    found, first, which = np.unique(sizes, return_index=True, return_inverse=True)
    sums = np.zeros(len(found), np.int64)
    np.add.at(sums, which, numbers)
    counted = {int(found[k]): int(sums[k]) for k in np.argsort(first) if found[k]}
    return Totals(counted, int((sizes > 0).sum()))


def running_means(before: Totals, sizes: int | Integers, numbers: Integers) -> npt.NDArray[np.float64]:
    """Return `Totals.mean_share` after each of some rows, to the last bit; parameters as for `totals_of`."""
    every = np.broadcast_to(sizes, len(numbers))
    counted: dict[int, Any] = dict(before.counted)
    # In order of appearance, because the sum of shares depends on their order; 0 before a size first appears.
    for size in dict.fromkeys(every.tolist() if len(np.unique(every)) > 1 else every[:1].tolist()):
        if size:
            counted[size] = counted.get(size, 0) + np.cumsum(np.where(every == size, numbers, 0))
    rows = before.rows + np.cumsum(every > 0)
    with np.errstate(invalid="ignore"):
        return np.asarray(shares(counted) / np.where(rows > 0, rows, np.nan))


def shares(counted: Mapping[int, Any]) -> Any:
    """Return the sum of shares, from the sum of what was counted for each number of those that could be."""
    # Dividing sums of integers gives the same bits however steps are divided into stretches. Not `sum`, which
    # compensates for rounding since Python 3.12.
    total: Any = 0.0
    for size, number in counted.items():
        total = total + number / size
    return total


_EDGES, _LARGEST, _OBSERVED, _ACTIVE, _ACTIVE_OBSERVED = range(CONDITIONAL_COLUMNS)
# Of a trail.
_FIRST_ROWS = 64

#: The columns of every world, before the scores of its interactions.
COLUMNS = ("observed", "mean_neighbours", "max_neighbours")


class Stretch:
    """The steps during which the same groups observed one another; one column for each of their relations.

    Attributes
    ----------
    targets, robots : int
        The numbers of agents that can be observed, and that have teammates, inactive ones included, at its begin.
    steps : Table
        A row for each step: what relations have `found`, and the `scores` of interactions.
    score_names : tuple of str
        The names of these scores.
    """

    def __init__(self, relations: list[Relation], scores: tuple[str, ...] = (), *, is_open: bool = False) -> None:
        self.score_names = scores
        self._teammates = [r for r, relation in enumerate(relations) if relation.name == TEAMMATES]
        self._groups = [(relations[r].observers.name, str(relations[r].observers.team)) for r in self._teammates]
        self._targets = [r for r, relation in enumerate(relations) if relation.counts]
        self.robots = sum(len(relations[r].observers) for r in self._teammates)
        self.targets = sum(len(group) for groups in counted_groups(relations) for group in groups)
        # How many are active is recorded only where it can change.
        self._is_conditional = is_open or any(relation.is_conditional for relation in relations)
        shape = (len(relations), CONDITIONAL_COLUMNS if self._is_conditional else HISTORY_COLUMNS)
        # There is room for the steps of a run when it begins.
        self.steps = Table([Field("found", np.int64, shape), Field("scores", shape=(len(scores),))])
        # The same numbers for the positions before the first step.
        self.present = np.zeros(shape, np.int64)
        self._sums, self._summed = Sums(), 0

    def emptied(self) -> Stretch:
        """Return a new stretch of the same relations, without rows."""
        other = object.__new__(Stretch)
        other.__dict__.update(self.__dict__)
        # A table without rows has nothing that somebody could still read.
        if self.rows:
            other.steps = Table(self.steps.fields.values())
        other._sums, other._summed = Sums(), 0
        return other

    @property
    def rows(self) -> int:
        """The number of recorded steps."""
        return len(self.steps)

    def sums(self, last: int | None = None) -> Sums:
        """Return the sums of the rows before `last`; by default of all.

        They are computed when they are asked for, since the loop may stop at every step.
        """
        last = self.rows if last is None else last
        if last < self._summed:
            return self._sums_of(self.steps.found[:last])
        if last > self._summed:
            new = self._sums_of(self.steps.found[self._summed : last])
            self._sums, self._summed = self._sums.plus(new), last
        return self._sums

    def _sums_of(self, rows: Integers) -> Sums:
        observed, edges = self._counts(rows)
        return Sums(totals_of(*observed), totals_of(*edges), int(self._largest(rows).max(initial=0)))

    def _largest(self, rows: Integers) -> Integers:
        """Return the largest degrees in each row."""
        # A view of the only column, if there is one, takes no copy.
        return rows[:, self._teammates[0] if len(self._teammates) == 1 else self._teammates, _LARGEST]

    def _counts(self, rows: Integers) -> tuple[tuple[int | Integers, Integers], tuple[int | Integers, Integers]]:
        """Return, for each row, how many targets are active and observed, and how many robots and edges there are."""
        sizes: tuple[int | Integers, int | Integers] = (self.targets, self.robots)
        if self._is_conditional:
            sizes = _sum_of(rows, self._targets, _ACTIVE_OBSERVED), _sum_of(rows, self._teammates, _ACTIVE)
        observed, edges = _sum_of(rows, self._targets, _OBSERVED), _sum_of(rows, self._teammates, _EDGES)
        return (sizes[0], observed), (sizes[1], edges)

    def largest_by_group(self, first: int) -> dict[tuple[str, str], int]:
        """Return the largest degree in each group that is on a team, by (group, team), in the rows from `first` on."""
        largest = self.steps.found[first:, self._teammates, _LARGEST].max(axis=0, initial=0)
        return dict(zip(self._groups, largest.tolist(), strict=True))

    def reading(self, name: str, is_recorded: bool) -> float:
        """Return `observed` or `mean_degree` of the last row, or of the present before it is recorded."""
        row = self.steps.found[-1] if is_recorded else self.present
        # Number by number: for one row that takes a fifth of the time of `columns`, and every run begins with it.
        if name == "observed":
            relations, counted, active, size = self._targets, _OBSERVED, _ACTIVE_OBSERVED, self.targets
        else:
            relations, counted, active, size = self._teammates, _EDGES, _ACTIVE, self.robots
        if self._is_conditional:
            size = sum(int(row[r, active]) for r in relations)
        return float(sum(int(row[r, counted]) for r in relations) / (size or math.nan))

    def columns(self, first: int = 0, last: int | None = None) -> dict[str, npt.NDArray[Any]]:
        """Return the columns of `World.history` for the rows of the stretch from `first` to before `last`."""
        part = slice(first, self.rows if last is None else last)
        rows = self.steps.found[part]
        (targets, observed), (robots, edges) = self._counts(rows)
        largest = rows[:, self._teammates, _LARGEST].max(axis=1, initial=0)
        values = divided(observed, targets), divided(edges, robots), largest
        scores = dict(zip(self.score_names, self.steps.scores[part].T, strict=True))
        return dict(zip(COLUMNS, values, strict=True)) | scores

    def running(self, before: Sums, first: int, last: int) -> dict[str, npt.NDArray[Any]]:
        """Return the measures of a run after each row from `first` to before `last`, and all `before`."""
        rows = self.steps.found[first:last]
        observed, edges = self._counts(rows)
        degrees = rows[:, self._teammates, _LARGEST].max(axis=1, initial=before.largest)
        return {
            "observed_fraction": running_means(before.observed, *observed),
            "mean_neighbours": running_means(before.edges, *edges),
            "max_neighbours": np.maximum.accumulate(degrees),
        }


class History:
    """All stretches of a world, one after the other."""

    def __init__(self) -> None:
        self._stretches: list[Stretch] = []
        # Of the first stretches, which are finished; there may be thousands, if agents come and go.
        self._counted = 0
        self._earlier = Sums()

    def begin(self, relations: list[Relation], scores: tuple[str, ...] = (), *, is_open: bool = False) -> Stretch:
        """Begin a new stretch, with scores of these names, and return it; agents come and leave in an open one."""
        if self._stretches:
            last = self._stretches[-1]
            if last.rows == 0:
                self._stretches.pop()
            else:
                # Without the room for more.
                last.steps = last.steps.copy()
        self._stretches.append(Stretch(relations, scores, is_open=is_open))
        return self._stretches[-1]

    def begin_like(self, stretch: Stretch) -> Stretch:
        """Begin a new stretch of the same relations and return it."""
        self._stretches.append(stretch.emptied())
        return self._stretches[-1]

    @property
    def earlier(self) -> Sums:
        """The sums of all stretches but the last."""
        for stretch in self._stretches[self._counted : -1]:
            self._earlier = self._earlier.plus(stretch.sums())
            self._counted += 1
        return self._earlier

    @property
    def sums(self) -> Sums:
        """The sums of all stretches."""
        if not self._stretches:
            return self._earlier
        last = self._stretches[-1].sums()
        return self.earlier.plus(last) if len(self._stretches) > 1 else last

    def largest_by_group(self, first: int = 0) -> dict[tuple[str, str], int]:
        """Return the largest degree in each group that has been on a team, in the rows from `first` on."""
        largest: dict[tuple[str, str], int] = {}
        for stretch in self._stretches:
            for group, degree in stretch.largest_by_group(min(first, stretch.rows)).items():
                largest[group] = max(largest.get(group, 0), degree)
            first = max(first - stretch.rows, 0)
        return largest

    def frame(self, scores: tuple[str, ...] = ()) -> pd.DataFrame:
        """Return the rows as a table, indexed by step from 1; `scores` are there even if no step has any yet."""
        parts = [stretch.columns() for stretch in self._stretches] or [Stretch([]).columns()]
        names = dict.fromkeys([*(name for part in parts for name in part), *scores])
        table = pd.DataFrame({
            # NaN for a score that was not yet kept.
            name: np.concatenate([part.get(name, np.full(len(part["observed"]), np.nan)) for part in parts])
            for name in names
        })
        table.index = pd.RangeIndex(1, len(table) + 1, name="step")
        return table


def _sum_of(rows: Integers, relations: list[int], column: int) -> Integers:
    """Return the sum of a column over some relations in each row."""
    if len(relations) == 1:
        # No copy: most worlds have one such relation, and thousands of short runs begin with it.
        return rows[:, relations[0], column]
    return np.asarray(rows[:, relations, column].sum(axis=1))


def divided(numbers: Integers, sizes: int | Integers) -> npt.NDArray[np.float64]:
    """Return shares; NaN where nobody is there."""
    return np.asarray(numbers / np.where(np.asarray(sizes) > 0, sizes, np.nan))


class Trail:
    """The positions of all agents, recorded at regular intervals as long as the groups do not change.

    Attributes
    ----------
    every : int
        Ticks from one recording to the next.
    kept : Table
        A row for each recording: the `position` of all agents.
    """

    def __init__(self, groups: list[Group], every: int, tick: int) -> None:
        self._names = np.repeat([group.name for group in groups], [len(group) for group in groups])
        self._identity = np.concatenate([group.bodies.identity for group in groups]) if groups else np.zeros(0, int)
        self._first = tick // every + 1
        self.every = every
        self.kept = Table([Field("position", shape=(len(self._identity), 2), unit="length")], room=_FIRST_ROWS)

    def frame(self) -> pd.DataFrame:
        """Return time, group, identity, x, y."""
        size, rows = len(self._identity), len(self.kept)
        times = self.every * (self._first + np.arange(rows))
        kept = self.kept.position.reshape(-1, 2)
        return pd.DataFrame(
            {
                "time": np.repeat(times, size),
                "group": np.tile(self._names, rows),
                "identity": np.tile(self._identity, rows),
                "x": kept[:, 0],
                "y": kept[:, 1],
            }
        )


def trajectory_frame(trails: list[Trail]) -> pd.DataFrame:
    """Return the rows of all trails."""
    parts = [trail.frame() for trail in trails if len(trail.kept)] or [Trail([], 1, 0).frame()]
    return pd.concat(parts, ignore_index=True)
