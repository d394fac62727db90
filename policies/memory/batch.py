"""The nearest situations of many queries at once: each block of a large memory is read once for all of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, array_at, scratch
from teamsight.policies.memory.nearest import BLOCK, LANES, keep_nearest, sum_distances

# So many comparisons are made without Python, which is some seconds: then Ctrl-C is heard.
_COMPARISONS = 1 << 31
_LEAST_QUERIES = 64

# In float32. The rows of a block are shifted by a line of the cache each, or all would want the same place in it.
_LINE = 16
_ROW = BLOCK + _LINE

_SEARCH = np.dtype(
    [(name, np.int64) for name in ("table", "columns", "pairs", "block", "query", "queries", "inputs")]
    + [(name, np.int64) for name in ("k", "index", "distance")]
)


def _search(address: int) -> int:
    ask = array_at(address, 1, _SEARCH)[0]
    table = array_at(ask.table, (ask.columns, ask.pairs), np.float32)
    block = array_at(ask.block, (ask.inputs, _ROW), np.float32)
    query = array_at(ask.query, (ask.queries, ask.inputs), np.float32)
    index = array_at(ask.index, (ask.queries, ask.k), np.int64)
    distance = array_at(ask.distance, (ask.queries, ask.k), np.float32)
    total, least = scratch(BLOCK, np.float32), scratch(LANES, np.float32)
    for begin in range(0, ask.pairs, BLOCK):
        count = min(BLOCK, ask.pairs - begin)
        # The rows of a large table lie so far apart that they displace one another from the caches.
        for c in range(ask.inputs):
            for i in range(np.uint64(count)):
                block[np.uint64(c), i] = table[np.uint64(c), np.uint64(begin) + i]
        for q in range(ask.queries):
            sum_distances(block, 0, ask.inputs, query[q], 0, count, distance[q, ask.k - 1], total)
            keep_nearest(total, count, begin, ask.k, index[q], distance[q], least)
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
    room = np.empty(queries.shape[1] * _ROW + _LINE, np.float32)
    block = room[-room.ctypes.data // room.itemsize % _LINE :]
    record = np.zeros(1, _SEARCH)
    ask = record[0]
    ask["columns"], ask["pairs"] = table.shape
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
