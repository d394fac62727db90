"""The canonical order of transitions: by their content, so that it does not depend on how they were recorded."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, inlined, kernel, scratch

Table = npt.NDArray[np.float32]

# Transitions that are compared with their neighbours at once.
_PART = 16_384
# Groups up to this size are sorted by comparing whole transitions.
_FEW = 12
# Quicksort puts at most two groups on the stack for each halving; each takes three numbers.
_STACK = 3 * 2 * 64
# A linear congruential generator (Knuth, MMIX), whose higher bits are the better ones.
_FACTOR, _ONE, _HIGH = np.uint64(6364136223846793005), np.uint64(1), np.uint64(20)


class Sorting(NamedTuple):
    """The record of a call of `_sort_order`."""

    table: Annotated[Table, "columns", "k"]
    order: Annotated[npt.NDArray[np.int64], "k"]
    key: Annotated[npt.NDArray[np.float32], "k"]


SORTING = Record(Sorting)
sorting_at = SORTING.at


def sort_transitions(table: Table) -> None:
    """Sort the columns of a table lexicographically, by the first row first; in place.

    The table is C-contiguous and without NaN. −0 becomes 0, so that equal numbers have equal bits.
    """
    for row in table:
        row += np.float32(0.0)
    if is_ordered(table):
        return
    order = canonical_order(table)
    sorted_row = np.empty(table.shape[1], np.float32)
    for row in table:
        np.take(row, order, out=sorted_row, mode="clip")
        row[:] = sorted_row


def canonical_order(table: Table) -> npt.NDArray[np.int64]:
    """Return the indices that sort the columns lexicographically."""
    order, key = np.arange(table.shape[1], dtype=np.int64), np.empty(table.shape[1], np.float32)
    _ENTRY(SORTING.pack(Sorting(table, order, key)))
    return order


def is_ordered(table: Table) -> bool:
    """Return whether the columns of a table are in lexicographic order; only reads what it needs of a mapped table."""
    for first in range(0, table.shape[1] - 1, _PART):
        part = table[:, first : first + _PART + 1]
        if (part[0, 1:] < part[0, :-1]).any():
            return False
        # Transitions that are equal to the next in all rows so far.
        equal = np.flatnonzero(part[0, 1:] == part[0, :-1])
        for row in part[1:]:
            if not len(equal):
                break
            one, other = row[equal], row[equal + 1]
            if (other < one).any():
                return False
            equal = equal[one == other]
    return True


def _sort_order(address: int) -> int:
    sorting = sorting_at(address)
    _sort(sorting.table, sorting.order, sorting.key)
    return 0


_ENTRY = Entry(_sort_order)


@inlined
def _is_before(table: Any, one: Any, other: Any, row: Any) -> bool:
    """Return whether a transition comes before another, given that they are equal above a row."""
    for r in range(row, table.shape[0]):
        a, b = table[r, one], table[r, other]
        if a != b:
            return a < b  # type: ignore[no-any-return]
    return False


@kernel
def _sort(table: Any, order: Any, key: Any) -> None:
    """Sort the indices in `order` by their transitions; `key` is scratch space of the same length.

    Notes
    -----
    Multikey quicksort (Bentley and Sedgewick 1997): a group is partitioned by one row into less, equal and greater,
    and only the equal part is compared in the next row. So a row is read only for transitions that are equal in the
    rows above. The largest part is sorted last, which bounds the stack.
    """
    stack = scratch(_STACK, np.int64)
    depth = _push(stack, 0, 0, order.shape[0], 0)
    lot = np.uint64(1)
    while depth > 0:
        depth -= 1
        first, last, row = stack[3 * depth], stack[3 * depth + 1], stack[3 * depth + 2]
        if last - first <= _FEW:
            _insertion_sort(table, order, first, last, row)
            continue
        for i in range(first, last):
            key[i] = table[row, order[i]]
        lot = lot * _FACTOR + _ONE
        low, high = _partition(order, key, first, last, lot)
        equal = high if row + 1 < table.shape[0] else low
        largest = max(low - first, high - low, last - high)
        for is_largest in (True, False):
            if (high - low == largest) == is_largest:
                depth = _push(stack, depth, low, equal, row + 1)
            if (low - first == largest) == is_largest:
                depth = _push(stack, depth, first, low, row)
            if (last - high == largest) == is_largest:
                depth = _push(stack, depth, high, last, row)


@inlined
def _push(stack: Any, depth: Any, first: Any, last: Any, row: Any) -> Any:
    """Push a group, unless it needs no sorting; return the number of groups on the stack."""
    if last - first < 2:
        return depth
    stack[3 * depth], stack[3 * depth + 1], stack[3 * depth + 2] = first, last, row
    return depth + 1


@inlined
def _partition(order: Any, key: Any, first: Any, last: Any, lot: Any) -> Any:
    """Partition a group by a pivot into less, equal and greater; return the limits of the equal part.

    The pivot is the median of three random elements: fixed ones would be the worst case for merged memories.
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
def _insertion_sort(table: Any, order: Any, first: Any, last: Any, row: Any) -> None:
    for i in range(first + 1, last):
        transition = order[i]
        place = i
        while place > first and _is_before(table, transition, order[place - 1], row):
            order[place] = order[place - 1]
            place -= 1
        order[place] = transition
