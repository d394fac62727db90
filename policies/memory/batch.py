"""The nearest situations of many queries: each block of a large memory is read once for all queries."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.core.kernel import Entry, Record, below_64, inlined, scratch
from teamsight.policies.memory.block import BLOCK, LANES, bound, insert

# Comparisons in one compiled call, which takes some seconds. Ctrl-C is handled between calls.
_COMPARISONS = 1 << 31
_LEAST_QUERIES = 64

# In float32. Each row of a block is shifted by a cache line, or all rows would compete for the same lines.
_LINE = 16
_ROW = BLOCK + _LINE

_ONE, _EIGHT, _INFINITE = np.uint64(1), np.uint64(8), np.float32(np.inf)

Floats32 = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int64]


class _Batch(NamedTuple):
    """The record of a search: a table, work space for one block of it, the queries and the results."""

    table: Annotated[Floats32, "rows", "columns"]
    block: Annotated[Floats32, "inputs", _ROW]
    query: Annotated[Floats32, "queries", "inputs"]
    found: Annotated[Integers, "queries", "k"]
    distance: Annotated[Floats32, "queries", "k"]


_BATCH = Record(_Batch)
_batch_at = _BATCH.at


@inlined
def _sum_distances(table: Any, inputs: Any, query: Any, begin: Any, count: Any, limit: Any, total: Any) -> None:
    """Write the distances of the columns ``begin .. begin + count - 1`` to `total`, and infinity behind them.

    Stops early when every partial sum has reached the limit, since no column can then be nearer.
    """
    # Unsigned indices need no check for negative values. Eight components at a time keep a sum in its register.
    b, n = np.uint64(begin), np.uint64(count)
    for i in range(BLOCK):
        total[np.uint64(i)] = np.float32(0.0) if i < count else _INFINITE
    c: Any = np.uint64(0)
    while c + _EIGHT <= np.uint64(inputs):
        for i in range(n):
            far = total[i] + _gap(table, query, c, b + i)
            for more in range(1, 8):
                far += _gap(table, query, c + np.uint64(more), b + i)
            total[i] = far
        if not _is_any_below(total, count, limit):
            return
        c += _EIGHT
    while c < np.uint64(inputs):
        for i in range(n):
            total[i] += _gap(table, query, c, b + i)
        c += _ONE


@inlined
def _gap(table: Any, query: Any, component: Any, column: Any) -> Any:
    return abs(table[component, column] - query[component])


@inlined
def _is_any_below(total: Any, count: Any, limit: Any) -> bool:
    for part in range(0, count, LANES):  # noqa: SIM110 (kernels have no generators)
        if below_64(total, part, limit) != 0:
            return True
    return False


@inlined
def _keep_nearest(total: Any, count: Any, begin: Any, k: Any, index: Any, distance: Any, least: Any) -> None:
    """Insert the columns of a block that belong to the k nearest so far; `least` is work space of 64 numbers."""
    limit = distance[k - 1]
    if limit == _INFINITE and k <= LANES:
        limit = bound(total, count, k, least)
    for part in range(0, count, LANES):
        near: Any = below_64(total, part, limit)
        while near != 0:
            at: Any = np.uint64(part) + np.uint64(trailing_zeros(near))
            near &= near - _ONE
            if total[at] < distance[k - 1]:
                insert(index, distance, k, begin + np.int64(at), total[at])
        limit = min(limit, distance[k - 1])


def _search(address: int) -> int:
    batch = _batch_at(address)
    inputs, k = batch.block.shape[0], batch.found.shape[1]
    columns = batch.table.shape[1]
    total, least = scratch(BLOCK, np.float32), scratch(LANES, np.float32)
    for begin in range(0, columns, BLOCK):
        count = min(BLOCK, columns - begin)
        # The rows of a large table are so far apart that they evict one another from the caches.
        for c in range(inputs):
            for i in range(np.uint64(count)):
                batch.block[np.uint64(c), i] = batch.table[np.uint64(c), np.uint64(begin) + i]
        for q in range(batch.query.shape[0]):
            query, index, distance = batch.query[q], batch.found[q], batch.distance[q]
            _sum_distances(batch.block, inputs, query, 0, count, distance[k - 1], total)
            _keep_nearest(total, count, begin, k, index, distance, least)
    return 0


_ENTRY = Entry(_search)


def nearest(
    table: npt.NDArray[np.float32], queries: npt.NDArray[np.float32], k: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Return the k nearest transitions of each query, and their distances.

    Parameters
    ----------
    table : ndarray, shape (columns, transitions), float32
        The table of a memory.
    queries : ndarray, shape (q, inputs), float32
        Situations, dense and without NaN. Their number of inputs is the number of rows compared.
    k : int
        Number of transitions, from 1 to the number in the table.

    Returns
    -------
    index : ndarray, shape (q, k), int64
        The transitions, the nearest first, ties in the order of the table.
    distance : ndarray, shape (q, k), float32
        The distances.
    """
    index, distance = np.full((len(queries), k), -1, np.int64), np.full((len(queries), k), np.inf, np.float32)
    inputs = queries.shape[1]
    room = np.empty(inputs * _ROW + _LINE, np.float32)
    start = -room.ctypes.data // room.itemsize % _LINE
    block = room[start : start + inputs * _ROW].reshape(inputs, _ROW)
    step = max(_COMPARISONS // table.shape[1], _LEAST_QUERIES)
    for first in range(0, len(queries), step):
        part = slice(first, first + step)
        _ENTRY(_BATCH.pack(_Batch(table, block, queries[part], index[part], distance[part])))
    return index, distance
