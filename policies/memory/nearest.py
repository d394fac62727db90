"""The search for the nearest situations in kernels, one query at a time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined, plain
from teamsight.policies.memory import batch
from teamsight.policies.memory.block import BLOCK, correction_of, margin_of, search_block


class SearchTable(NamedTuple):
    """The situations that a kernel searches. Of equal situations it holds the first k.

    Attributes
    ----------
    kept : ndarray, shape (columns,), int64
        The transition of the memory that each column is, ascending.
    table : ndarray, shape (inputs + 1, columns), float32
        Situations in the first `inputs` rows; in the last, half their distance from the situation of ones.
    margin : float
        Twice the largest error of an estimate of half a distance; infinite if a reading is outside [0, 1].
    nearest_to_ones : ndarray, shape (k,), int64
        The columns nearest to the situation of ones.
    """

    kept: npt.NDArray[np.int64]
    table: npt.NDArray[np.float32]
    margin: float
    nearest_to_ones: npt.NDArray[np.int64]


def search_table(table: npt.NDArray[np.float32], inputs: int, k: int) -> SearchTable:
    """Return the table in which `k_nearest` finds up to `k` matches, by the first `inputs` rows of a memory's table."""
    situation = table[:inputs]
    # Equal situations are adjacent, and no more than k of them can be among the k nearest.
    is_first = np.concatenate([[True], (situation[:, 1:] != situation[:, :-1]).any(axis=0)])
    number = np.arange(len(is_first))
    kept = np.flatnonzero(number - np.maximum.accumulate(np.where(is_first, number, 0)) < k)
    situation = np.ascontiguousarray(situation[:, kept])
    half = np.abs(1.0 - situation.astype(float)).sum(axis=0) / 2
    in_range = bool(((situation >= 0) & (situation <= 1)).all())
    margin = plain(margin_of)(inputs) if in_range else np.inf
    nearest = batch.nearest(situation, np.ones((1, inputs), np.float32), k)[0][0]
    return SearchTable(kept, np.concatenate([situation, half[None].astype(np.float32)]), margin, nearest)


@inlined
def k_nearest(table: Any, margin: float, query: Any, k: int, index: Any, distance: Any) -> None:
    """Find the k columns whose situations are most similar to a query.

    Parameters
    ----------
    table, margin
        Those of a `SearchTable`.
    query : ndarray, shape (at least inputs,), float32
        A situation, without NaN.
    k : int
        Number of columns to find, at least 1.
    index : ndarray, shape (at least k,), int64
        Written: the columns, the nearest first, ties in the order of the table; −1 if the table has fewer than k.
    distance : ndarray, shape (at least k,), float32
        Written: the sums of absolute differences, in the order of the rows; infinite if the table has fewer than k.
    """
    inputs = table.shape[0] - 1
    correction = correction_of(query, inputs, margin)
    for i in range(k):
        index[i] = -1
        distance[i] = np.float32(np.inf)
    for begin in range(0, table.shape[1], BLOCK):
        count = min(BLOCK, table.shape[1] - begin)
        search_block(table, begin, count, query, correction, index[:k], distance[:k], 0)
