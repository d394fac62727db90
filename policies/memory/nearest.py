"""The search for the nearest situations (eq. 1) in kernels: exact, although most distances are only estimated.

Most readings of a situation are 1 (nothing sensed). The table holds the distance of each situation from the situation
of ones; a query corrects it for its other readings only. Exact distances are computed for the few transitions whose
estimate is within the rounding error of the k smallest. Each of these sums is taken in the order of the components.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.core.kernel import below_64, inlined, scratch
from teamsight.policies.memory import batch
from teamsight.policies.memory.block import BLOCK, LANES, bound, insert

_GROUP = 8
_INFINITE, _ONE, _HALF, _BIT = np.float32(np.inf), np.float32(1.0), np.float32(0.5), np.uint64(1)


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
    """Return the table in which `k_nearest` searches.

    Parameters
    ----------
    table : ndarray, shape (columns, transitions), float32
        The table of a memory.
    inputs : int
        Number of rows to compare.
    k : int
        The largest number of matches of a query.
    """
    situation = table[:inputs]
    # Equal situations are adjacent, and no more than k of them can be among the k nearest.
    is_first = np.concatenate([[True], (situation[:, 1:] != situation[:, :-1]).any(axis=0)])
    number = np.arange(len(is_first))
    kept = np.flatnonzero(number - np.maximum.accumulate(np.where(is_first, number, 0)) < k)
    situation = np.ascontiguousarray(situation[:, kept])
    half = np.abs(1.0 - situation.astype(float)).sum(axis=0) / 2
    in_range = bool(((situation >= 0) & (situation <= 1)).all())
    # Each of at most 2 · inputs + 3 roundings has an error of at most 2⁻²⁴ of a number below 3 · inputs.
    margin = 2.0**-20 * (inputs + 2) ** 2 if in_range else np.inf
    nearest = batch.nearest(situation, np.ones((1, inputs), np.float32), k)[0][0]
    return SearchTable(kept, np.concatenate([situation, half[None].astype(np.float32)]), margin, nearest)


@inlined
def k_nearest(table: Any, margin: float, query: Any, k: int, index: Any, distance: Any) -> None:
    """Find the k columns whose situations are most similar to a query.

    Parameters
    ----------
    table : ndarray, shape (inputs + 1, columns), float32
        The table of a `SearchTable`.
    margin : float
        The margin of the `SearchTable`.
    query : ndarray, shape (at least inputs,), float32
        A situation, without NaN.
    k : int
        Number of columns to find, at least 1.
    index : ndarray, shape (at least k,), int64
        Written: the columns, the nearest first, ties in the order of the table; −1 if the table has fewer than k.
    distance : ndarray, shape (at least k,), float32
        Written: the sums of absolute differences, in the order of the rows; infinite if the table has fewer than k.

    Notes
    -----
    *Source:* section 8.1, eq. 1.
    """
    estimate, least = scratch(BLOCK, np.float32), scratch(LANES, np.float32)
    candidate = scratch(BLOCK, np.int64)
    inputs = table.shape[0] - 1
    shift = 0.0
    for c in range(inputs):
        reading = query[np.uint64(c)]
        if reading != _ONE:
            shift -= 0.5 * (1.0 + reading)
            if not 0.0 <= reading <= 1.0:
                margin = np.inf
    for i in range(k):
        index[i] = -1
        distance[i] = _INFINITE
    for begin in range(0, table.shape[1], BLOCK):
        count = min(BLOCK, table.shape[1] - begin)
        _estimate(table, query, np.float32(shift), begin, count, estimate)
        limit = _HALF * distance[k - 1]
        if limit == _INFINITE and k <= LANES:
            limit = bound(estimate, count, k, least)
        found = _select(estimate, count, np.float32(limit + margin), begin, candidate)
        for group in range(0, found, _GROUP):
            _measure(table, query, group, found, candidate, least)
            for lane in range(min(_GROUP, found - group)):
                if least[lane] < distance[k - 1]:
                    insert(index, distance, k, candidate[group + lane], least[lane])


@inlined
def _estimate(table: Any, query: Any, shift: Any, begin: Any, count: Any, estimate: Any) -> None:
    """Write estimates of half the distances of a block, and infinity behind them.

    A reading q in place of 1 changes half of |t − 1|, where t ≤ 1, by max(t, q) − (1 + q) / 2.
    """
    # Unsigned indices need no check for negative values.
    b, n, inputs = np.uint64(begin), np.uint64(count), np.uint64(table.shape[0] - 1)
    for i in range(n):
        estimate[i] = table[inputs, b + i] + shift
    for i in range(n, np.uint64(BLOCK)):
        estimate[i] = _INFINITE
    for c in range(inputs):
        reading = query[c]
        if reading != _ONE:
            for i in range(n):
                other = table[c, b + i]
                estimate[i] += other if other > reading else reading


@inlined
def _select(estimate: Any, count: Any, limit: Any, begin: Any, candidate: Any) -> Any:
    """Write the columns whose estimate is below the limit, padded with the first of them to a full group."""
    found: Any = np.uint64(0)
    for part in range(0, count, LANES):
        near: Any = below_64(estimate, part, limit)
        while near != 0:
            candidate[found] = begin + part + np.int64(trailing_zeros(near))
            near &= near - _BIT
            found += _BIT
    for more in range(found, -(-np.int64(found) // _GROUP) * _GROUP):
        candidate[np.uint64(more)] = candidate[0]
    return np.int64(found)


@inlined
def _measure(table: Any, query: Any, group: Any, found: Any, candidate: Any, total: Any) -> None:
    """Write the distances of the candidates ``group .. group + 7``."""
    for lane in range(_GROUP):
        total[np.uint64(lane)] = np.float32(0.0)
    for c in range(np.uint64(table.shape[0] - 1)):
        for lane in range(_GROUP):
            at = np.uint64(candidate[np.uint64(group + lane)])
            total[np.uint64(lane)] += abs(table[c, at] - query[c])
