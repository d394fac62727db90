"""The nearest situations by eq. 1."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.kernel import Entry, array_at, below_64, inlined, scratch

BLOCK = 256
_ONE = np.uint64(1)
_EIGHT = np.uint64(8)
_INFINITE = np.float32(np.inf)


@inlined
def _gap(table: Any, first: Any, query: Any, component: Any, pair: Any) -> Any:
    return abs(table[first + component, pair] - query[component])


@inlined
def _distances(table: Any, first: int, inputs: int, query: Any, begin: int, count: int, total: Any) -> None:
    """Write the distances of the pairs ``begin .. begin + count - 1``; what comes after them in `total` is infinite.

    Eight components at a time, so that a sum stays in its register for longer; each sum is still taken in the order
    of the components. Numbers without a sign spare the check whether a place counts from the end.
    """
    f, b, n = np.uint64(first), np.uint64(begin), np.uint64(count)
    for i in range(BLOCK):
        total[np.uint64(i)] = np.float32(0.0) if i < count else _INFINITE
    c = np.uint64(0)
    while c + _EIGHT <= np.uint64(inputs):
        for i in range(n):
            far = total[i] + _gap(table, f, query, c, b + i)
            for more in range(1, 8):
                far += _gap(table, f, query, c + np.uint64(more), b + i)
            total[i] = far
        c += _EIGHT
    while c < np.uint64(inputs):
        for i in range(n):
            total[i] += _gap(table, f, query, c, b + i)
        c += _ONE


@inlined
def _insert(index: Any, distance: Any, k: int, j: Any, d: Any) -> None:
    place = k - 1
    while place > 0 and distance[place - 1] > d:
        distance[place] = distance[place - 1]
        index[place] = index[place - 1]
        place -= 1
    distance[place] = d
    index[place] = j


@inlined
def k_nearest(table: Any, inputs: int, query: Any, k: int, index: Any, distance: Any, first: int = 0) -> None:
    """Find the k pairs whose situations are most similar to a query, by eq. 1; for kernels.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        A memory's table.
    inputs : int
        How many of its rows are compared.
    query : ndarray, shape (at least inputs,), float32
        A situation.
    k : int
        How many pairs.
    index : ndarray, shape (at least k,), int64
        Their places are written here, the nearest first, and among equals the first in the table; −1 where the table
        has fewer than k.
    distance : ndarray, shape (at least k,), float32
        Their distances: sums of absolute differences, in the order of the rows; infinite where there is none.
    first : int
        The first row to compare: 0 for situations, inputs + 2 for next situations.

    Notes
    -----
    *Source:* section 8.1, eq. 1.
    """
    pairs = table.shape[1]
    total = scratch(BLOCK, np.float32)
    for i in range(k):
        index[i] = -1
        distance[i] = _INFINITE
    for begin in range(0, pairs, BLOCK):
        count = min(BLOCK, pairs - begin)
        _distances(table, first, inputs, query, begin, count, total)
        for part in range(0, count, 64):
            near: Any = below_64(total, part, distance[k - 1])
            while near != 0:
                at: Any = np.uint64(part) + np.uint64(trailing_zeros(near))
                near &= near - _ONE
                if total[at] < distance[k - 1]:
                    _insert(index, distance, k, begin + np.int64(at), total[at])


_SEARCH = np.dtype(
    [(name, np.int64) for name in ("table", "columns", "pairs", "inputs", "query", "queries", "k", "index", "distance")]
)


def _search(address: int) -> int:
    ask = array_at(address, 1, _SEARCH)[0]
    table = array_at(ask.table, (ask.columns, ask.pairs), np.float32)
    query = array_at(ask.query, (ask.queries, ask.inputs), np.float32)
    index = array_at(ask.index, (ask.queries, ask.k), np.int64)
    distance = array_at(ask.distance, (ask.queries, ask.k), np.float32)
    for i in range(ask.queries):
        k_nearest(table, ask.inputs, query[i], ask.k, index[i], distance[i])
    return 0


_ENTRY = Entry(_search)


def nearest(
    table: npt.NDArray[np.float32], queries: npt.NDArray[np.float32], k: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Return the places and distances of the k nearest pairs of each query, each of shape (queries, k)."""
    index, distance = np.empty((len(queries), k), np.int64), np.empty((len(queries), k), np.float32)
    record = np.zeros(1, _SEARCH)
    ask = record[0]
    ask["columns"], ask["pairs"] = table.shape
    ask["queries"], ask["inputs"] = queries.shape
    ask["k"] = k
    for name, array in (("table", table), ("query", queries), ("index", index), ("distance", distance)):
        ask[name] = array.ctypes.data
    _ENTRY(record.ctypes.data)
    return index, distance
