"""The canonical order of pairs: by what they hold, so that a place says nothing of when or by whom a pair was met."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, inlined, kernel, scratch

Table = npt.NDArray[np.float32]

# Pairs that are compared with their neighbours at a time.
_PART = 16_384
# Groups so small are sorted by comparing whole pairs.
_FEW = 12
# At most two groups wait for each time that a group can be halved, and each takes three numbers.
_STACK = 3 * 2 * 64
# A linear congruential generator (Knuth, MMIX), whose higher bits are the better ones.
_FACTOR, _ONE, _HIGH = np.uint64(6364136223846793005), np.uint64(1), np.uint64(20)


class Sorting(NamedTuple):
    """The record of a call of `_find_order`."""

    table: Annotated[Table, "columns", "k"]
    order: Annotated[npt.NDArray[np.int64], "k"]
    key: Annotated[npt.NDArray[np.float32], "k"]


SORTING = Record(Sorting)
sorting_at = SORTING.at


def sort_pairs(table: Table) -> None:
    """Bring the columns of a table into lexicographic order, the first row counting most; in place.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        Dense and without NaN. −0 becomes 0, which is the same number in other bits.
    """
    for row in table:
        row += np.float32(0.0)
    order = canonical_order(table)
    if order is None:
        return
    sorted_row = np.empty(table.shape[1], np.float32)
    for row in table:
        np.take(row, order, out=sorted_row, mode="clip")
        row[:] = sorted_row


def canonical_order(table: Table) -> npt.NDArray[np.int64] | None:
    """Return the places of the pairs in lexicographic order, or None if that is how they stand."""
    order, key = np.arange(table.shape[1], dtype=np.int64), np.empty(table.shape[1], np.float32)
    return order if _ENTRY(SORTING.pack(Sorting(table, order, key))) else None


def is_ordered(table: Table) -> bool:
    """Say whether the pairs of a table stand in lexicographic order; a mapped table is read where need be, once."""
    for first in range(0, table.shape[1] - 1, _PART):
        part = table[:, first : first + _PART + 1]
        if (part[0, 1:] < part[0, :-1]).any():
            return False
        # Pairs that the rows so far do not tell from the next.
        equal = np.flatnonzero(part[0, 1:] == part[0, :-1])
        for row in part[1:]:
            if not len(equal):
                break
            one, other = row[equal], row[equal + 1]
            if (other < one).any():
                return False
            equal = equal[one == other]
    return True


def _find_order(address: int) -> int:
    sorting = sorting_at(address)
    if _is_ordered(sorting.table):
        return 0
    _sort(sorting.table, sorting.order, sorting.key)
    return 1


_ENTRY = Entry(_find_order)


@inlined
def _is_before(table: Any, one: Any, other: Any, row: Any) -> bool:
    """Say whether a pair comes before another, when they are equal above a row."""
    for r in range(row, table.shape[0]):
        a, b = table[r, one], table[r, other]
        if a != b:
            return a < b  # type: ignore[no-any-return]
    return False


@kernel
def _is_ordered(table: Any) -> bool:
    for pair in range(1, table.shape[1]):  # noqa: SIM110 (kernels have no generators)
        if _is_before(table, pair, pair - 1, 0):
            return False
    return True


@kernel
def _sort(table: Any, order: Any, key: Any) -> None:
    """Sort the places in `order` by their pairs; `key` is room for a number each.

    Notes
    -----
    Quicksort by one row at a time: what is less, equal and greater than a pivot is parted, and only what is equal goes
    on to the next row (Bentley and Sedgewick 1997). So a row is read only for pairs that the rows above did not tell
    apart. Of the three groups the largest is sorted last, which keeps the stack short.
    """
    stack = scratch(_STACK, np.int64)
    waiting = _wait(stack, 0, 0, order.shape[0], 0)
    lot = np.uint64(1)
    while waiting > 0:
        waiting -= 1
        first, last, row = stack[3 * waiting], stack[3 * waiting + 1], stack[3 * waiting + 2]
        if last - first <= _FEW:
            _insert_all(table, order, first, last, row)
            continue
        for i in range(first, last):
            key[i] = table[row, order[i]]
        lot = lot * _FACTOR + _ONE
        low, high = _part(order, key, first, last, lot)
        equal = high if row + 1 < table.shape[0] else low
        if high - low >= max(low - first, last - high):
            waiting = _wait(stack, waiting, low, equal, row + 1)
            waiting = _wait(stack, waiting, first, low, row)
            waiting = _wait(stack, waiting, high, last, row)
        elif low - first >= last - high:
            waiting = _wait(stack, waiting, first, low, row)
            waiting = _wait(stack, waiting, low, equal, row + 1)
            waiting = _wait(stack, waiting, high, last, row)
        else:
            waiting = _wait(stack, waiting, high, last, row)
            waiting = _wait(stack, waiting, low, equal, row + 1)
            waiting = _wait(stack, waiting, first, low, row)


@inlined
def _wait(stack: Any, waiting: Any, first: Any, last: Any, row: Any) -> Any:
    """Put a group on the stack, unless it needs no sorting; return how many are there."""
    if last - first < 2:
        return waiting
    stack[3 * waiting], stack[3 * waiting + 1], stack[3 * waiting + 2] = first, last, row
    return waiting + 1


@inlined
def _part(order: Any, key: Any, first: Any, last: Any, lot: Any) -> Any:
    """Part a group by a pivot: less, equal, greater. Return where the equal ones begin and end.

    The pivot is the median of three that are drawn: three fixed places would be the worst for memories that are merged.
    """
    size = np.uint64(last - first)
    a = key[np.uint64(first) + (lot >> _HIGH) % size]
    b = key[np.uint64(first) + (lot * _FACTOR >> _HIGH) % size]
    c = key[np.uint64(first) + (lot * _FACTOR * _FACTOR >> _HIGH) % size]
    pivot = max(min(a, b), min(max(a, b), c))
    low, i, high = first, first, last
    while i < high:
        if key[i] < pivot:
            _swap(order, key, i, low)
            low += 1
            i += 1
        elif key[i] > pivot:
            high -= 1
            _swap(order, key, i, high)
        else:
            i += 1
    return low, high


@inlined
def _swap(order: Any, key: Any, i: Any, j: Any) -> None:
    key[i], key[j] = key[j], key[i]
    order[i], order[j] = order[j], order[i]


@inlined
def _insert_all(table: Any, order: Any, first: Any, last: Any, row: Any) -> None:
    for i in range(first + 1, last):
        pair = order[i]
        place = i
        while place > first and _is_before(table, pair, order[place - 1], row):
            order[place] = order[place - 1]
            place -= 1
        order[place] = pair
