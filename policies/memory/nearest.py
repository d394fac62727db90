"""The search for the nearest situations: one query at a time in kernels, or many, which read each block once."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, below_64, inlined, ones, plain, scratch, trailing_zeros

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


def nearest_columns(
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
    nearest = nearest_columns(situation, np.ones((1, inputs), np.float32), k)[0][0]
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
