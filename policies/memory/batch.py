"""The nearest situations of many queries at once: each block of a large memory is read once for all of them."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.core.kernel import Entry, Record, below_64, inlined, scratch
from teamsight.policies.memory.block import BLOCK, LANES, bound, insert

# So many comparisons are made without Python, which is some seconds: then Ctrl-C is heard.
_COMPARISONS = 1 << 31
_LEAST_QUERIES = 64

# In float32. The rows of a block are shifted by a line of the cache each, or all would want the same place in it.
_LINE = 16
_ROW = BLOCK + _LINE

_ONE, _EIGHT, _INFINITE = np.uint64(1), np.uint64(8), np.float32(np.inf)


class Search(NamedTuple):
    """The record of a search; q queries for the k nearest.

    Attributes
    ----------
    table, query, place, distance
        As for `nearest`.
    block : ndarray, shape (inputs, …), float32
        Room for a block of the table.
    """

    table: Annotated[npt.NDArray[np.float32], "columns", "transitions"]
    block: Annotated[npt.NDArray[np.float32], "inputs", _ROW]
    query: Annotated[npt.NDArray[np.float32], "q", "inputs"]
    place: Annotated[npt.NDArray[np.int64], "q", "k"]
    distance: Annotated[npt.NDArray[np.float32], "q", "k"]


SEARCH = Record(Search)
search_at = SEARCH.at


@inlined
def _sum_distances(table: Any, inputs: Any, query: Any, begin: Any, count: Any, limit: Any, total: Any) -> None:
    """Write the distances of the pairs ``begin .. begin + count - 1`` to `total`, and infinity behind them.

    When every sum has reached the limit, none is finished: as they stand, they tell that these pairs are too far.
    """
    # Numbers without a sign spare the question whether a place counts from the end. Eight components at a time keep a
    # sum in its register for longer.
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
def _gap(table: Any, query: Any, component: Any, pair: Any) -> Any:
    return abs(table[component, pair] - query[component])


@inlined
def _is_any_below(total: Any, count: Any, limit: Any) -> bool:
    for part in range(0, count, LANES):  # noqa: SIM110 (kernels have no generators)
        if below_64(total, part, limit) != 0:
            return True
    return False


@inlined
def _keep_nearest(total: Any, count: Any, begin: Any, k: Any, index: Any, distance: Any, least: Any) -> None:
    """Enter those of a block of pairs that belong to the k nearest so far; `least` is room for 64 numbers."""
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
    table, block, query, index, distance = search_at(address)
    pairs, inputs, k = table.shape[1], query.shape[1], index.shape[1]
    total, least = scratch(BLOCK, np.float32), scratch(LANES, np.float32)
    for begin in range(0, pairs, BLOCK):
        count = min(BLOCK, pairs - begin)
        # The rows of a large table lie so far apart that they displace one another from the caches.
        for c in range(inputs):
            for i in range(np.uint64(count)):
                block[np.uint64(c), i] = table[np.uint64(c), np.uint64(begin) + i]
        for q in range(query.shape[0]):
            _sum_distances(block, inputs, query[q], 0, count, distance[q, k - 1], total)
            _keep_nearest(total, count, begin, k, index[q], distance[q], least)
    return 0


_ENTRY = Entry(_search)


def nearest(
    table: npt.NDArray[np.float32], queries: npt.NDArray[np.float32], k: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Return the places and distances of the k nearest pairs of each query, as `k_nearest` finds them.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        A memory's table.
    queries : ndarray, shape (q, inputs), float32
        Situations, dense and without NaN; so many rows of the table are compared.
    k : int
        How many pairs; at least 1, at most as many as there are.

    Returns
    -------
    index : ndarray, shape (q, k), int64
        The places.
    distance : ndarray, shape (q, k), float32
        The distances.
    """
    index, distance = np.full((len(queries), k), -1, np.int64), np.full((len(queries), k), np.inf, np.float32)
    inputs = queries.shape[1]
    room = np.empty(inputs * _ROW + _LINE, np.float32)
    first = -room.ctypes.data // room.itemsize % _LINE
    block = room[first : first + inputs * _ROW].reshape(inputs, _ROW)
    step = max(_COMPARISONS // table.shape[1], _LEAST_QUERIES)
    for start in range(0, len(queries), step):
        part = slice(start, start + step)
        _ENTRY(SEARCH.pack(Search(table, block, queries[part], index[part], distance[part])))
    return index, distance
