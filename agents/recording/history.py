"""History: one row for each completed step, and running sums."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.records import HISTORY_COLUMNS
from teamsight.agents.engine.relation import Relation
from teamsight.core.buffer import Buffer

_EDGES, _LARGEST, _OBSERVED = range(HISTORY_COLUMNS)
_FIRST_ROWS, _MOST_FIRST_ROWS = 64, 1024


class Stretch:
    """The steps during which the same groups observed one another; one column for each of their relations."""

    def __init__(self, relations: list[Relation]) -> None:
        self._teammates = [r for r, relation in enumerate(relations) if relation.name == TEAMMATES]
        self._teams = [relations[r].observers.team for r in self._teammates]
        self._groups = [(relations[r].observers.name, str(relations[r].observers.team)) for r in self._teammates]
        self._targets = [r for r, relation in enumerate(relations) if relation.counts]
        self.robots = sum(len(relations[r].observers) for r in self._teammates)
        met = {group.number: len(group) for r in self._targets for group in relations[r].observed}
        self.targets = sum(met.values())
        self.buffer = Buffer((len(relations), HISTORY_COLUMNS), np.int64, _FIRST_ROWS)
        # The same numbers for the positions before the first step.
        self.present = np.zeros((len(relations), HISTORY_COLUMNS), np.int64)
        self.observed_sum = 0
        self.largest = 0
        self._summed = 0

    def emptied(self) -> Stretch:
        """Return a new stretch of the same relations, without rows."""
        other = object.__new__(Stretch)
        other.__dict__.update(self.__dict__)
        # As much room as here, because the next run is often as long.
        room = min(len(self.buffer.array), _MOST_FIRST_ROWS)
        other.buffer = Buffer(self.buffer.array.shape[1:], np.int64, room)
        other.observed_sum = other.largest = other._summed = 0
        return other

    @property
    def rows(self) -> int:
        """The number of recorded steps."""
        return self.buffer.rows

    def sum_up(self) -> None:
        """Add the rows written since the last call to the sums."""
        new = self.buffer.written[self._summed :]
        if len(new):
            self.observed_sum += int(new[:, self._targets, _OBSERVED].sum())
            self.largest = max(self.largest, int(new[:, self._teammates, _LARGEST].max(initial=0)))
            self._summed = self.rows

    def largest_of(self, team: str | None, first: int) -> int:
        """Return the largest degree in one team, or in any, in the rows from `first` on."""
        own = [r for r, name in zip(self._teammates, self._teams, strict=True) if team in (None, name)]
        return int(self.buffer.written[first:, own, _LARGEST].max(initial=0))

    def largest_by_group(self, first: int) -> dict[tuple[str, str], int]:
        """Return the largest degree in each group that is on a team, by (group, team), in the rows from `first` on."""
        largest = self.buffer.written[first:, self._teammates, _LARGEST].max(axis=0, initial=0)
        return dict(zip(self._groups, largest.tolist(), strict=True))

    def observed_counts(self, first: int, last: int) -> npt.NDArray[np.int64]:
        """Return for each of these rows the number of targets that at least one robot observed."""
        return np.asarray(self.buffer.array[first:last, self._targets, _OBSERVED].sum(axis=1))

    @property
    def edges(self) -> int:
        """The number of edges between teammates in all rows."""
        return int(self.buffer.written[:, self._teammates, _EDGES].sum())

    def reading(self, name: str, is_recorded: bool) -> float:
        """Return `observed` or `mean_neighbours` of the last row, or of the present before it is recorded."""
        row = self.buffer.array[self.rows - 1] if is_recorded else self.present
        if name == "observed":
            return float(sum(row[r, _OBSERVED] for r in self._targets) / (self.targets or np.nan))
        return float(sum(row[r, _EDGES] for r in self._teammates) / (self.robots or np.nan))

    def columns(self, first: int = 0, last: int | None = None) -> dict[str, npt.NDArray[Any]]:
        """Return the columns of `World.history` for the rows of the stretch from `first` to before `last`."""
        raw = self.buffer.array[first : self.rows if last is None else last]
        # Without targets the share, and without robots the mean, is NaN.
        targets, robots = self.targets or np.nan, self.robots or np.nan
        return {
            "observed": raw[:, self._targets, _OBSERVED].sum(axis=1) / targets,
            "mean_neighbours": raw[:, self._teammates, _EDGES].sum(axis=1) / robots,
            "max_neighbours": raw[:, self._teammates, _LARGEST].max(axis=1, initial=0),
        }


class Totals(NamedTuple):
    """What was observed in all rows of some stretches that had targets.

    Attributes
    ----------
    observed : dict of int to int
        For each number of targets, in order of appearance, the sum of observed targets over its rows.
    rows : int
        The number of rows.
    """

    observed: dict[int, int]
    rows: int


class History:
    """All stretches of a world, one after the other."""

    def __init__(self) -> None:
        self._stretches: list[Stretch] = []
        # Of the first stretches, which are finished; there may be thousands, if agents come and go.
        self._counted = self._largest = 0
        self._totals = Totals({}, 0)

    def begin(self, relations: list[Relation]) -> Stretch:
        """Begin a new stretch and return it."""
        if self._stretches:
            last = self._stretches[-1]
            last.buffer.array = last.buffer.written.copy()
            if last.rows == 0:
                self._stretches.pop()
        self._stretches.append(Stretch(relations))
        return self._stretches[-1]

    def begin_like(self, stretch: Stretch) -> Stretch:
        """Begin a new stretch of the same relations and return it."""
        self._stretches.append(stretch.emptied())
        return self._stretches[-1]

    @property
    def earlier(self) -> Totals:
        """The totals of all stretches but the last."""
        finished = self._stretches[self._counted : -1]
        if finished:
            self._totals = _totals(finished, self._totals)
            self._largest = max(self._largest, *(stretch.largest for stretch in finished))
            self._counted += len(finished)
        return self._totals

    @property
    def observed_fraction(self) -> float:
        """The mean share of targets that are observed, over the rows with targets; NaN before the first."""
        observed, rows = _totals(self._stretches[-1:], self.earlier)
        return shares(observed) / rows if rows else float("nan")

    @property
    def max_neighbours(self) -> int:
        """The largest degree in any row; 0 before the first."""
        later = [stretch.largest for stretch in self._stretches[self._counted :]]
        return max(self._largest, *later, 0)

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
        edges: dict[int, int] = {}
        rows = 0
        for stretch in self._stretches:
            if stretch.robots and stretch.rows:
                edges[stretch.robots] = edges.get(stretch.robots, 0) + stretch.edges
                rows += stretch.rows
        return float(shares(edges) / rows) if rows else float("nan")

    def frame(self) -> pd.DataFrame:
        """Return the rows as a table, indexed by step from 1."""
        parts = [stretch.columns() for stretch in self._stretches] or [Stretch([]).columns()]
        table = pd.DataFrame({name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
        table.index = pd.RangeIndex(1, len(table) + 1, name="step")
        return table


def _totals(stretches: list[Stretch], before: Totals) -> Totals:
    """Return the totals of some stretches and those before them."""
    observed, rows = dict(before.observed), before.rows
    for stretch in stretches:
        if stretch.targets and stretch.rows:
            observed[stretch.targets] = observed.get(stretch.targets, 0) + stretch.observed_sum
            rows += stretch.rows
    return Totals(observed, rows)


def shares(observed: Mapping[int, Any]) -> Any:
    """Return the sum of observed shares, from the sum of observed targets for each number of targets."""
    # Dividing sums of integers gives the same bits however steps are divided into stretches. Not `sum`, which
    # compensates for rounding since Python 3.12.
    total: Any = 0.0
    for targets, number in observed.items():
        total = total + number / targets
    return total
