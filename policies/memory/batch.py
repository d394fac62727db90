"""The nearest situations of many queries at once: each block of a large memory is read once for all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.core.kernel import Entry, array_at, below_64, inlined, scratch
from teamsight.policies.memory.block import BLOCK, LANES, bound, insert

# So many comparisons are made without Python, which is some seconds: then Ctrl-C is heard.
_COMPARISONS = 1 << 31
_LEAST_QUERIES = 64

# In float32. The rows of a block are shifted by a line of the cache each, or all would want the same place in it.
_LINE = 16
_ROW = BLOCK + _LINE

_ONE, _EIGHT, _INFINITE = np.uint64(1), np.uint64(8), np.float32(np.inf)

_SEARCH = np.dtype(
    [(name, np.int64) for name in ("table", "columns", "transitions", "block", "query", "queries", "inputs")]
    + [(name, np.int64) for name in ("k", "index", "distance")]
)


@inlined
def _sum_distances(table: Any, inputs: Any, query: Any, begin: Any, count: Any, limit: Any, total: Any) -> None:
    """Write the distances of the transitions ``begin .. begin + count - 1`` to `total`, and infinity behind them.

    Once all partial sums have reached the limit, none is finished: these transitions are too far anyway.
    """
    # Unsigned indices need no check for negative values. Eight components at once keep a sum in its register.
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
def _gap(table: Any, query: Any, component: Any, transition: Any) -> Any:
    return abs(table[component, transition] - query[component])


@inlined
def _is_any_below(total: Any, count: Any, limit: Any) -> bool:
    for part in range(0, count, LANES):  # noqa: SIM110 (kernels have no generators)
        if below_64(total, part, limit) != 0:
            return True
    return False


@inlined
def _keep_nearest(total: Any, count: Any, begin: Any, k: Any, index: Any, distance: Any, least: Any) -> None:
    """Enter those of a block of transitions that belong to the k nearest so far; `least` is room for 64 numbers."""
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
    ask = array_at(address, 1, _SEARCH)[0]
    table = array_at(ask.table, (ask.columns, ask.transitions), np.float32)
    block = array_at(ask.block, (ask.inputs, _ROW), np.float32)
    query = array_at(ask.query, (ask.queries, ask.inputs), np.float32)
    index = array_at(ask.index, (ask.queries, ask.k), np.int64)
    distance = array_at(ask.distance, (ask.queries, ask.k), np.float32)
    total, least = scratch(BLOCK, np.float32), scratch(LANES, np.float32)
    for begin in range(0, ask.transitions, BLOCK):
        count = min(BLOCK, ask.transitions - begin)
        # The rows of a large table lie so far apart that they displace one another from the caches.
        for c in range(ask.inputs):
            for i in range(np.uint64(count)):
                block[np.uint64(c), i] = table[np.uint64(c), np.uint64(begin) + i]
        for q in range(ask.queries):
            _sum_distances(block, ask.inputs, query[q], 0, count, distance[q, ask.k - 1], total)
            _keep_nearest(total, count, begin, ask.k, index[q], distance[q], least)
    return 0


_ENTRY = Entry(_search)


def nearest(
    table: npt.NDArray[np.float32], queries: npt.NDArray[np.float32], k: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Return the places and distances of the k nearest transitions of each query, as `k_nearest` finds them.

    Parameters
    ----------
    table : ndarray, shape (columns, transitions), float32
        A memory's table.
    queries : ndarray, shape (q, inputs), float32
        Situations, dense and without NaN; so many rows of the table are compared.
    k : int
        How many transitions; at least 1, at most as many as there are.

    Returns
    -------
    index : ndarray, shape (q, k), int64
        The places.
    distance : ndarray, shape (q, k), float32
        The distances.
    """
    index, distance = np.full((len(queries), k), -1, np.int64), np.full((len(queries), k), np.inf, np.float32)
    room = np.empty(queries.shape[1] * _ROW + _LINE, np.float32)
    block = room[-room.ctypes.data // room.itemsize % _LINE :]
    record = np.zeros(1, _SEARCH)
    ask = record[0]
    ask["columns"], ask["transitions"] = table.shape
    ask["inputs"], ask["k"] = queries.shape[1], k
    ask["table"], ask["block"] = table.ctypes.data, block.ctypes.data
    step = max(_COMPARISONS // table.shape[1], _LEAST_QUERIES)
    for start in range(0, len(queries), step):
        part = slice(start, start + step)
        ask["queries"] = len(queries[part])
        for name, array in (("query", queries), ("index", index), ("distance", distance)):
            ask[name] = array[part].ctypes.data
        _ENTRY(record.ctypes.data)
    return index, distance
