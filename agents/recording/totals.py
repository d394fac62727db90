"""Totals: what is observed, or linked, in the rows of the history, as whole numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

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
        return Totals({sizes: int(numbers.sum())}, len(numbers)) if sizes and len(numbers) else NOTHING
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
