"""Conversion of recorded transitions to a table: checked, one row per component, in canonical order."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.policies.memory.order import Table, is_ordered, sort_transitions

ACTION = ("rotation", "distance")

# The float32 next to π lies above π.
_LIMITS = {"rotation": (-float(np.float32(math.pi)), float(np.float32(math.pi))), "distance": (0.0, 1.0)}
_PART = 4096
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
        for start in range(0, len(values), _PART):
            rows[:, start : start + _PART] = values[start : start + _PART].T
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
