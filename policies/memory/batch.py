"""The nearest situations of many queries: each block of a large memory is read once for all queries."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, inlined, scratch
from teamsight.policies.memory.block import BLOCK, correction_of, margin_of, search_block

# Comparisons in one compiled call, which takes some seconds. Ctrl-C is handled between calls.
_COMPARISONS = 1 << 31
_LEAST_QUERIES = 64

# In float32. Each row of a block is shifted by a cache line, or all rows would compete for the same lines.
_LINE = 16
_ROW = BLOCK + _LINE

Floats32 = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int64]


class _Batch(NamedTuple):
    """The record of a search: a table, work space for one block of it, the queries and the results."""

    table: Annotated[Floats32, "rows", "columns"]
    block: Annotated[Floats32, "inputs + 1", _ROW]
    query: Annotated[Floats32, "queries", "inputs"]
    found: Annotated[Integers, "queries", "k"]
    distance: Annotated[Floats32, "queries", "k"]


_BATCH = Record(_Batch)
_batch_at = _BATCH.at


@inlined
def _load(table: Any, begin: Any, count: Any, block: Any) -> bool:
    """Copy columns of a table as `search_block` reads them; return whether all readings are in [0, 1]."""
    inputs = block.shape[0] - 1
    half = scratch(BLOCK, np.float64)
    is_in_range = True
    for i in range(np.uint64(count)):
        half[i] = 0.0
    for c in range(np.uint64(inputs)):
        for i in range(np.uint64(count)):
            reading = table[c, np.uint64(begin) + i]
            block[c, i] = reading
            half[i] += 0.5 * abs(1.0 - reading)
            is_in_range &= (reading >= 0.0) & (reading <= 1.0)
    for i in range(np.uint64(count)):
        block[inputs, i] = half[i]
    return is_in_range


def _search(address: int) -> int:
    batch = _batch_at(address)
    inputs, columns = batch.query.shape[1], batch.table.shape[1]
    for begin in range(0, columns, BLOCK):
        count = min(BLOCK, columns - begin)
        # The rows of a large table are so far apart that they evict one another from the caches.
        margin = margin_of(inputs) if _load(batch.table, begin, count, batch.block) else np.inf
        for q in range(batch.query.shape[0]):
            query = batch.query[q]
            correction = correction_of(query, inputs, margin)
            search_block(batch.block, 0, count, query, correction, batch.found[q], batch.distance[q], begin)
    return 0


_ENTRY = Entry(_search)


def nearest(
    table: npt.NDArray[np.float32], queries: npt.NDArray[np.float32], k: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Return the k nearest transitions of each query and their distances, as `LazyMemory.nearest` does.

    Parameters
    ----------
    table : ndarray, shape (columns, transitions), float32
        The table of a memory.
    queries : ndarray, shape (q, inputs), float32
        Situations, dense and without NaN. Their number of inputs is the number of rows compared.
    k : int
        Number of transitions, from 1 to the number in the table.
    """
    index, distance = np.full((len(queries), k), -1, np.int64), np.full((len(queries), k), np.inf, np.float32)
    rows = queries.shape[1] + 1
    room = np.empty(rows * _ROW + _LINE, np.float32)
    start = -room.ctypes.data // room.itemsize % _LINE
    block = room[start : start + rows * _ROW].reshape(rows, _ROW)
    step = max(_COMPARISONS // table.shape[1], _LEAST_QUERIES)
    for first in range(0, len(queries), step):
        part = slice(first, first + step)
        _ENTRY(_BATCH.pack(_Batch(table, block, queries[part], index[part], distance[part])))
    return index, distance
