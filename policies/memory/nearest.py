"""The nearest situations by eq. 1, for kernels: exact, and fast by SIMD lanes alone.

Distances are taken for a block of pairs at once, component after component: lanes lie side by side in the table's rows,
and every sum is still taken in the order of the components, so it has the bits of the plain loop.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.core.kernel import below_64, inlined, ones, scratch

BLOCK = 1024
"""How many pairs are compared at once: their sums stay in the first cache, and most memories begin and end in one."""

LANES = 64
"""How many sums are asked at once whether they are below a limit: one bit of a word for each."""

_HALVINGS = 6
_ONE, _EIGHT = np.uint64(1), np.uint64(8)
_TINY, _INFINITE = np.float32(1e-30), np.float32(np.inf)


@inlined
def k_nearest(table: Any, inputs: int, query: Any, k: int, index: Any, distance: Any, first: int = 0) -> None:
    """Find the k pairs whose situations are most similar to a query.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        A memory's table.
    inputs : int
        How many of its rows are compared.
    query : ndarray, shape (at least inputs,), float32
        A situation, without NaN.
    k : int
        How many pairs; at least 1.
    index : ndarray, shape (at least k,), int64
        Their places are written here, the nearest first, and among equals the first in the table; −1 where the table
        has fewer than k.
    distance : ndarray, shape (at least k,), float32
        Their distances: sums of absolute differences, in the order of the rows; infinite where there is none.
    first : int
        The first row to compare: 0 for situations, the memory's inputs + 2 for next situations.

    Notes
    -----
    *Source:* section 8.1, eq. 1.
    """
    total, least = scratch(BLOCK, np.float32), scratch(LANES, np.float32)
    for i in range(k):
        index[i] = -1
        distance[i] = _INFINITE
    for begin in range(0, table.shape[1], BLOCK):
        count = min(BLOCK, table.shape[1] - begin)
        sum_distances(table, first, inputs, query, begin, count, distance[k - 1], total)
        keep_nearest(total, count, begin, k, index, distance, least)


@inlined
def sum_distances(
    table: Any, first: Any, inputs: Any, query: Any, begin: Any, count: Any, limit: Any, total: Any
) -> None:
    """Write the distances of the pairs ``begin .. begin + count - 1`` to `total`, and infinity behind them.

    When every sum has reached the limit, none is finished: as they stand, they tell that these pairs are too far.
    """
    # Numbers without a sign spare the question whether a place counts from the end. Eight components at a time keep a
    # sum in its register for longer.
    f, b, n = np.uint64(first), np.uint64(begin), np.uint64(count)
    for i in range(BLOCK):
        total[np.uint64(i)] = np.float32(0.0) if i < count else _INFINITE
    c: Any = np.uint64(0)
    while c + _EIGHT <= np.uint64(inputs):
        for i in range(n):
            far = total[i] + _gap(table, f, query, c, b + i)
            for more in range(1, 8):
                far += _gap(table, f, query, c + np.uint64(more), b + i)
            total[i] = far
        if not _is_any_below(total, count, limit):
            return
        c += _EIGHT
    while c < np.uint64(inputs):
        for i in range(n):
            total[i] += _gap(table, f, query, c, b + i)
        c += _ONE


@inlined
def _gap(table: Any, first: Any, query: Any, component: Any, pair: Any) -> Any:
    return abs(table[first + component, pair] - query[component])


@inlined
def _is_any_below(total: Any, count: Any, limit: Any) -> bool:
    for part in range(0, count, LANES):  # noqa: SIM110 (kernels have no generators)
        if below_64(total, part, limit) != 0:
            return True
    return False


@inlined
def keep_nearest(total: Any, count: Any, begin: Any, k: Any, index: Any, distance: Any, least: Any) -> None:
    """Enter those of a block of pairs that belong to the k nearest so far; `least` is room for 64 numbers."""
    limit = distance[k - 1]
    if limit == _INFINITE and k <= LANES:
        limit = _bound(total, count, k, least)
    for part in range(0, count, LANES):
        near: Any = below_64(total, part, limit)
        while near != 0:
            at: Any = np.uint64(part) + np.uint64(trailing_zeros(near))
            near &= near - _ONE
            if total[at] < distance[k - 1]:
                _insert(index, distance, k, begin + np.int64(at), total[at])
        limit = min(limit, distance[k - 1])


@inlined
def _bound(total: Any, count: Any, k: Any, least: Any) -> Any:
    """Return a limit that at least k of a block's distances are below, and few more; so that few are entered in vain.

    The least of each lane stands for the block: k lanes whose least is below the limit are k pairs below it. Where
    fewer than k are finite, so is no limit.
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
def _insert(index: Any, distance: Any, k: Any, pair: Any, far: Any) -> None:
    """Put a pair behind all that are as near, since those stand before it in the table; the last falls out."""
    place = k - 1
    while place > 0 and distance[place - 1] > far:
        distance[place] = distance[place - 1]
        index[place] = index[place - 1]
        place -= 1
    distance[place] = far
    index[place] = pair
