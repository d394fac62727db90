"""History: one row for each completed step, and running sums."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.records import CONDITIONAL_COLUMNS, HISTORY_COLUMNS
from teamsight.agents.engine.relation import Relation
from teamsight.agents.recording.totals import Sums, running_means, totals_of
from teamsight.core.buffer import Buffer

_EDGES, _LARGEST, _OBSERVED, _ACTIVE, _ACTIVE_OBSERVED = range(CONDITIONAL_COLUMNS)
_FIRST_ROWS, _MOST_FIRST_ROWS = 64, 1024

#: The columns of every world, before the scores of its interactions.
COLUMNS = ("observed", "mean_neighbours", "max_neighbours")

Integers = npt.NDArray[np.int64]


class Stretch:
    """The steps during which the same groups observed one another; one column for each of their relations.

    Attributes
    ----------
    targets, robots : int
        The numbers of agents that can be observed, and that have teammates, inactive ones included.
    buffer, scores : Buffer
        The rows: what relations have found, and the scores of interactions.
    score_names : tuple of str
        The names of these scores.
    """

    def __init__(self, relations: list[Relation], scores: tuple[str, ...] = ()) -> None:
        self.score_names = scores
        self.scores = Buffer((len(scores),), np.float64, _FIRST_ROWS)
        self._teammates = [r for r, relation in enumerate(relations) if relation.name == TEAMMATES]
        self._teams = [relations[r].observers.team for r in self._teammates]
        self._groups = [(relations[r].observers.name, str(relations[r].observers.team)) for r in self._teammates]
        self._targets = [r for r, relation in enumerate(relations) if relation.counts]
        self.robots = sum(len(relations[r].observers) for r in self._teammates)
        met = {group.number: len(group) for r in self._targets for group in relations[r].observed}
        self.targets = sum(met.values())
        # Who is active is recorded only where it can change.
        self._is_conditional = any(relation.is_conditional for relation in relations)
        shape = (len(relations), CONDITIONAL_COLUMNS if self._is_conditional else HISTORY_COLUMNS)
        self.buffer = Buffer(shape, np.int64, _FIRST_ROWS)
        # The same numbers for the positions before the first step.
        self.present = np.zeros(shape, np.int64)
        self._sums, self._summed = Sums(), 0

    def emptied(self) -> Stretch:
        """Return a new stretch of the same relations, without rows."""
        other = object.__new__(Stretch)
        other.__dict__.update(self.__dict__)
        # As much room as here, because the next run is often as long.
        room = min(len(self.buffer.array), _MOST_FIRST_ROWS)
        other.buffer = Buffer(self.buffer.array.shape[1:], np.int64, room)
        other.scores = Buffer(self.scores.array.shape[1:], np.float64, room)
        other._sums, other._summed = Sums(), 0
        return other

    def make_room(self, steps: int) -> None:
        """Make room for this many more steps."""
        self.buffer.make_room(steps)
        self.scores.make_room(steps)

    @property
    def rows(self) -> int:
        """The number of recorded steps."""
        return self.buffer.rows

    def sums(self, last: int | None = None) -> Sums:
        """Return the sums of the rows before `last`; by default of all.

        They are computed when they are asked for, since the loop may stop at every step.
        """
        last = self.rows if last is None else last
        if last < self._summed:
            return self._sums_of(self.buffer.array[:last])
        if last > self._summed:
            new = self._sums_of(self.buffer.array[self._summed : last])
            self._sums, self._summed = self._sums.plus(new), last
        return self._sums

    def _sums_of(self, rows: Integers) -> Sums:
        return Sums(
            totals_of(self._targets_of(rows), self._observed_of(rows)),
            totals_of(self._robots_of(rows), self._edges_of(rows)),
            int(rows[:, self._teammates, _LARGEST].max(initial=0)),
        )

    def _targets_of(self, rows: Integers) -> int | Integers:
        """Return the number of active targets in each of some rows; one number if it is always the same."""
        if not self._is_conditional:
            return self.targets
        return _sum_of(rows, self._targets, _ACTIVE_OBSERVED)

    def _robots_of(self, rows: Integers) -> int | Integers:
        if not self._is_conditional:
            return self.robots
        return _sum_of(rows, self._teammates, _ACTIVE)

    def _observed_of(self, rows: Integers) -> Integers:
        return _sum_of(rows, self._targets, _OBSERVED)

    def _edges_of(self, rows: Integers) -> Integers:
        return _sum_of(rows, self._teammates, _EDGES)

    def largest_of(self, team: str | None, first: int) -> int:
        """Return the largest degree in one team, or in any, in the rows from `first` on."""
        own = [r for r, name in zip(self._teammates, self._teams, strict=True) if team in (None, name)]
        return int(self.buffer.written[first:, own, _LARGEST].max(initial=0))

    def largest_by_group(self, first: int) -> dict[tuple[str, str], int]:
        """Return the largest degree in each group that is on a team, by (group, team), in the rows from `first` on."""
        largest = self.buffer.written[first:, self._teammates, _LARGEST].max(axis=0, initial=0)
        return dict(zip(self._groups, largest.tolist(), strict=True))

    def reading(self, name: str, is_recorded: bool) -> float:
        """Return `observed` or `mean_degree` of the last row, or of the present before it is recorded."""
        row = self.buffer.array[self.rows - 1] if is_recorded else self.present
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
        rows = slice(first, self.rows if last is None else last)
        scores = dict(zip(self.score_names, self.scores.array[rows].T, strict=True))
        return self._columns(self.buffer.array[rows]) | scores

    def _columns(self, rows: Integers) -> dict[str, npt.NDArray[Any]]:
        values = (
            _divided(self._observed_of(rows), self._targets_of(rows)),
            _divided(self._edges_of(rows), self._robots_of(rows)),
            rows[:, self._teammates, _LARGEST].max(axis=1, initial=0),
        )
        return dict(zip(COLUMNS, values, strict=True))

    def running(self, before: Sums, first: int, last: int) -> dict[str, npt.NDArray[Any]]:
        """Return the measures of a run after each row from `first` to before `last`, and all `before`."""
        rows = self.buffer.array[first:last]
        degrees = rows[:, self._teammates, _LARGEST].max(axis=1, initial=before.largest)
        return {
            "observed_fraction": running_means(before.observed, self._targets_of(rows), self._observed_of(rows)),
            "mean_neighbours": running_means(before.edges, self._robots_of(rows), self._edges_of(rows)),
            "max_neighbours": np.maximum.accumulate(degrees),
        }


class History:
    """All stretches of a world, one after the other."""

    def __init__(self) -> None:
        self._stretches: list[Stretch] = []
        # Of the first stretches, which are finished; there may be thousands, if agents come and go.
        self._counted = 0
        self._earlier = Sums()

    def begin(self, relations: list[Relation], scores: tuple[str, ...] = ()) -> Stretch:
        """Begin a new stretch, with scores of these names, and return it."""
        if self._stretches:
            last = self._stretches[-1]
            last.buffer.array = last.buffer.written.copy()
            last.scores.array = last.scores.written.copy()
            if last.rows == 0:
                self._stretches.pop()
        self._stretches.append(Stretch(relations, scores))
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
    def _sums(self) -> Sums:
        return self.earlier.plus(self._stretches[-1].sums()) if self._stretches else self.earlier

    @property
    def observed_fraction(self) -> float:
        """The mean share of targets that are observed, over the rows with targets; NaN before the first."""
        return self._sums.observed.mean_share

    @property
    def max_neighbours(self) -> int:
        """The largest degree in any row; 0 before the first."""
        return self._sums.largest

    def largest_of(self, team: str | None, first: int = 0) -> int:
        """Return the largest degree in one team, or in any, in the rows from `first` on; 0 before the first."""
        largest = 0
        for stretch in self._stretches:
            largest = max(largest, stretch.largest_of(team, min(first, stretch.rows)))
            first = max(first - stretch.rows, 0)
        return largest

    def largest_by_group(self, first: int = 0) -> dict[tuple[str, str], int]:
        """Return the largest degree in each group that has been on a team, in the rows from `first` on."""
        largest: dict[tuple[str, str], int] = {}
        for stretch in self._stretches:
            for group, degree in stretch.largest_by_group(min(first, stretch.rows)).items():
                largest[group] = max(largest.get(group, 0), degree)
            first = max(first - stretch.rows, 0)
        return largest

    @property
    def mean_neighbours(self) -> float:
        """The mean degree over the robots and steps of the rows with robots; NaN before the first."""
        return self._sums.edges.mean_share

    def frame(self, scores: tuple[str, ...] = ()) -> pd.DataFrame:
        """Return the rows as a table, indexed by step from 1; `scores` are there even if no step has any yet."""
        parts = [stretch.columns() for stretch in self._stretches] or [Stretch([]).columns()]
        names = dict.fromkeys([*(name for part in parts for name in part), *scores])
        table = pd.DataFrame({name: np.concatenate([_column_of(part, name) for part in parts]) for name in names})
        table.index = pd.RangeIndex(1, len(table) + 1, name="step")
        return table


def _sum_of(rows: Integers, relations: list[int], column: int) -> Integers:
    """Return the sum of a column over some relations in each row."""
    if len(relations) == 1:
        # No copy: most worlds have one such relation, and thousands of short runs begin with it.
        return rows[:, relations[0], column]
    return np.asarray(rows[:, relations, column].sum(axis=1))


def _column_of(part: dict[str, npt.NDArray[Any]], name: str) -> npt.NDArray[Any]:
    """Return a column of a stretch; NaN for a score that was not yet kept."""
    return part[name] if name in part else np.full(len(part["observed"]), np.nan)


def _divided(numbers: Integers, sizes: int | Integers) -> npt.NDArray[np.float64]:
    """Return shares; NaN where nobody is there."""
    return np.asarray(numbers / np.where(np.asarray(sizes) > 0, sizes, np.nan))
