"""The exact search for the nearest situations (eq. 1) in a block of a table; most distances are only estimated.

Most readings of a situation are 1 (nothing sensed). The table holds the distance of each situation from the situation
of ones; a query corrects it for its other readings only. Exact distances are computed for the few transitions whose
estimate is within the rounding error of the k smallest. Each of these sums is taken in the order of the components.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.core.kernel import below_64, inlined, ones, scratch

BLOCK = 1024
"""Number of distances computed at once. They fit the first cache, and most memories fit one block."""

LANES = 64
"""Number of distances compared with a limit at once: one bit of a word each."""

_GROUP = 8
_HALVINGS = 8
_TINY = np.float32(1e-30)
_INFINITE, _ONE, _HALF, _BIT = np.float32(np.inf), np.float32(1.0), np.float32(0.5), np.uint64(1)


@inlined
def margin_of(inputs: int) -> float:
    """Return twice the largest error of an estimate of half a distance, for readings in [0, 1]."""
    # Each of at most 2 · inputs + 3 roundings has an error of at most 2⁻²⁴ of a number below 3 · inputs.
    return 2.0**-20 * (inputs + 2) ** 2


@inlined
def correction_of(query: Any, inputs: Any, margin: float) -> tuple[float, float]:
    """Return what a query adds to all estimates, and the margin: infinite if a reading is outside [0, 1]."""
    shift = 0.0
    for c in range(inputs):
        reading = query[np.uint64(c)]
        if reading != _ONE:
            shift -= 0.5 * (1.0 + reading)
            if not 0.0 <= reading <= 1.0:
                margin = np.inf
    return shift, margin


@inlined
def search_block(
    table: Any, begin: Any, count: Any, query: Any, correction: Any, index: Any, distance: Any, first: Any
) -> None:
    """Insert those columns of a block that are among the nearest so far.

    Parameters
    ----------
    table : ndarray, shape (inputs + 1, columns), float32
        Situations in the first `inputs` rows; in the last, half their distance from the situation of ones.
    begin, count : int
        The first column of the block, and the number of its columns, at most `BLOCK`.
    query : ndarray, shape (at least inputs,), float32
        A situation, without NaN.
    correction : tuple of two float
        The answer of `correction_of`.
    index, distance : ndarray, shape (k,), int64 and float32
        The nearest so far, the nearest first, and their distances; infinite where there is none. Changed.
    first : int
        The index of the table's first column.
    """
    estimate, least, candidate = scratch(BLOCK, np.float32), scratch(LANES, np.float32), scratch(BLOCK, np.int64)
    shift, margin = correction
    k = distance.shape[0]
    _estimate(table, query, np.float32(shift), begin, count, estimate)
    limit = _HALF * distance[k - 1]
    if limit == _INFINITE and k <= LANES:
        limit = _bound(estimate, count, k, least)
    found = _select(estimate, count, np.float32(limit + margin), begin, candidate)
    for group in range(0, found, _GROUP):
        _measure(table, query, group, candidate, least)
        for lane in range(min(_GROUP, found - group)):
            if least[lane] < distance[k - 1]:
                _insert(index, distance, first + candidate[group + lane], least[lane])


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
def _measure(table: Any, query: Any, group: Any, candidate: Any, total: Any) -> None:
    """Write the distances of the candidates ``group .. group + 7``."""
    for lane in range(_GROUP):
        total[np.uint64(lane)] = np.float32(0.0)
    for c in range(np.uint64(table.shape[0] - 1)):
        for lane in range(_GROUP):
            at = np.uint64(candidate[np.uint64(group + lane)])
            total[np.uint64(lane)] += abs(table[c, at] - query[c])


@inlined
def _bound(total: Any, count: Any, k: Any, least: Any) -> Any:
    """Return a limit below which at least k distances of a block are, and few more.

    It is found among the smallest distance of each lane: if k of these are below a limit, so are k distances. The limit
    is infinite if fewer than k distances are finite. `k` is at most `LANES`; `least` is work space for as many numbers.
    """
    for lane in range(LANES):
        least[np.uint64(lane)] = total[np.uint64(lane)]
    for part in range(LANES, count, LANES):
        for lane in range(LANES):
            i = np.uint64(lane)
            other = total[np.uint64(part) + i]
            least[i] = other if other < least[i] else least[i]
    high = _TINY
    for lane in range(k):
        high = max(high, least[np.uint64(lane)])
    low, high = np.float32(0.0), high + high
    for _ in range(_HALVINGS):
        middle = np.float32(0.5) * (low + high)
        if ones(below_64(least, 0, middle)) >= k:
            high = middle
        else:
            low = middle
    return high


@inlined
def _insert(index: Any, distance: Any, column: Any, far: Any) -> None:
    """Insert a column after all that are as near, which precede it in the table; the last one is dropped."""
    place = distance.shape[0] - 1
    while place > 0 and distance[place - 1] > far:
        distance[place] = distance[place - 1]
        index[place] = index[place - 1]
        place -= 1
    distance[place] = far
    index[place] = column
