"""Conversion of recorded transitions to a table: checked, one row per component, in canonical order."""

from __future__ import annotations

import math
from collections.abc import Mapping
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


ACTION = ("rotation", "distance")

# The float32 next to π lies above π.
_LIMITS = {"rotation": (-float(np.float32(math.pi)), float(np.float32(math.pi))), "distance": (0.0, 1.0)}
_ROWS = 4096
# Numbers of a row that fit into the cache of a core.
_CACHED = 32_768
#: Largest absolute value; sums of differences of such numbers are finite in float32.
MOST = 1e30
_UNITS = {"rotation": "in radians, −π..π", "distance": "as a share of the robot's speed, 0..1"}


def table_of(situation: Any, action: Any, next_situation: Any, facts: Mapping[str, Any]) -> Table:
    """Return the table of transitions, for `LazyMemory.of` and with its parameters; the arrays are copied once.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit, there is no transition, or a number is not finite or outside its limits.
    """
    before = _shaped("situation", situation, "transitions", "inputs")
    transitions, inputs = before.shape
    if transitions == 0:
        raise ValueError("situation: has 0 transitions; a memory needs at least 1: explore for at least one step")
    if inputs == 0:
        raise ValueError("situation: has 0 components; a memory needs at least 1: give the percept's `situation`")
    did = _shaped("action", action, transitions, len(ACTION))
    after = _shaped("next_situation", next_situation, transitions, inputs)
    if not all(isinstance(name, str) for name in facts):
        raise TypeError(f"facts: have the names {list(facts)}; the name of a fact must be a string")
    parts = {"situation": before, "action": did, "next_situation": after}
    for name in sorted(facts):
        parts[f"fact {name!r}"] = _shaped(f"fact {name!r}", facts[name], transitions)[:, None]
    table = np.empty((2 * inputs + len(ACTION) + len(facts), transitions), np.float32)
    first = 0
    for name, part in parts.items():
        _fill(table[first : first + part.shape[1]], part, name)
        first += part.shape[1]
    for name, row in zip(ACTION, table[inputs:], strict=False):
        _check_limits(name, row)
    sort_transitions(table)
    return table


def check_layout(table: Table, inputs: int, facts: int) -> None:
    """Raise an error if a table has not the type, the order or the shape of `table_of`.

    Raises
    ------
    ValueError
        If it has not, or contains no transition.
    """
    columns = 2 * inputs + len(ACTION) + facts
    if table.dtype != np.float32 or table.ndim != 2 or len(table) != columns or not table.flags.c_contiguous:
        raise ValueError(
            f"table: is {table.dtype} of shape {table.shape}; for {inputs} inputs and {facts} facts it must be "
            f"C-contiguous float32 of shape ({columns}, transitions); use LazyMemory.of"
        )
    if not table.shape[1]:
        raise ValueError("table: has 0 transitions; a memory needs at least 1: explore first")


def check_table(table: Table, inputs: int) -> None:
    """Raise an error if `table_of` could not have made this table of situations of `inputs` components.

    Raises
    ------
    ValueError
        If a number is not finite, outside its limits or −0, or the transitions are not in canonical order.
    """
    for column, row in enumerate(table):
        name = ACTION[column - inputs] if 0 <= column - inputs < len(ACTION) else ""
        low, high = _LIMITS.get(name, (-MOST, MOST))
        # In parts that fit into the cache, so that memory is read once.
        for first in range(0, len(row), _CACHED):
            part = row[first : first + _CACHED]
            least, largest = part.min(), part.max()
            # Written so that NaN fails too.
            if not (least >= low and largest <= high):
                wrong = largest if least >= low else least
                raise ValueError(f"table[{column}] holds {wrong:g}, allowed are {low:g} to {high:g}")
            # The bits of −0 are those of the smallest integer.
            if part.view(np.int32).min() == np.iinfo(np.int32).min:
                raise ValueError(f"table[{column}] holds -0")
    if not is_ordered(table):
        raise ValueError("its transitions are not in canonical order")


def queries_of(queries: Any, width: int, inputs: int) -> Table:
    """Return the first `width` components of situations that have `width` or `inputs` of them.

    Raises
    ------
    TypeError, ValueError
        If they have another shape, or a reading is not within the limits of a memory.
    """
    asked = _shaped("queries", queries, "transitions", "inputs")
    if asked.shape[1] not in (width, inputs):
        raise ValueError(f"queries: have {asked.shape[1]} components; {width} are compared: give {width}")
    asked = np.ascontiguousarray(asked[:, :width], np.float32)
    if not (np.abs(asked) <= MOST).all():
        raise ValueError(f"queries: hold NaN or more than {MOST:g}; the readings of a situation are finite")
    return asked


def _shaped(name: str, value: Any, *shape: int | str) -> npt.NDArray[Any]:
    """Return `value` as an array of numbers of this shape; a word stands for any length."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: is not an array ({error}); give rows of equal length") from None
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name}: has the type {array.dtype}; it must be numbers")
    known = [n if isinstance(length, int) else length for n, length in zip(array.shape, shape, strict=False)]
    if array.ndim != len(shape) or tuple(known) != shape:
        wanted = ", ".join(map(str, shape)) + "," * (len(shape) == 1)
        raise ValueError(f"{name}: has the shape {array.shape}; it must be ({wanted})")
    return array


def _fill(rows: Table, values: npt.NDArray[Any], name: str) -> None:
    """Write values of shape (transitions, rows) to rows of a table, transposed."""
    with np.errstate(over="ignore"):
        # In parts, so that each cache line of a large array is fetched once.
        for start in range(0, len(values), _ROWS):
            rows[:, start : start + _ROWS] = values[start : start + _ROWS].T
    for component, row in enumerate(rows):
        # Written so that NaN fails too.
        wrong = ~(np.abs(row) <= MOST)
        if wrong.any():
            transition = int(np.argmax(wrong))
            place = f"{transition}, {component}" if values.shape[1] > 1 else f"{transition}"
            raise ValueError(
                f"{name}[{place}] = {values[transition, component]}: must be finite and at most {MOST:g}; leave such "
                "transitions out, or mend the exploration that recorded them"
            )


def _check_limits(name: str, row: Table) -> None:
    low, high = _LIMITS[name]
    wrong = (row < low) | (row > high)
    if wrong.any():
        raise ValueError(f"action: {name} = {row[np.argmax(wrong)]:g}; it must be {_UNITS[name]}")
