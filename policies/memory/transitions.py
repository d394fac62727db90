"""From what an exploration recorded to a table: checked, one row a component, in canonical order."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.policies.memory.order import Table, is_ordered, sort_pairs

ACTION = ("rotation", "distance")

# The float32 next to π lies above π.
_LIMITS = {"rotation": (-float(np.float32(math.pi)), float(np.float32(math.pi))), "distance": (0.0, 1.0)}
_PART = 4096
# Numbers of a row that stay in the cache of a core.
_CACHED = 32_768
#: The largest number: sums of differences of such are finite float32.
MOST = 1e30
_AXES = ("pairs", "inputs")
_UNITS = {"rotation": "in radians, −π..π", "distance": "as a share of the robot's speed, 0..1"}


def table_of(situation: Any, action: Any, next_situation: Any, facts: Mapping[str, Any]) -> Table:
    """Return the table of these pairs; the arrays given are copied once.

    Parameters
    ----------
    situation, next_situation : array_like, shape (pairs, inputs)
        Before and after.
    action : array_like, shape (pairs, 2)
        Rotation [rad] and distance [share of the robot's speed].
    facts : mapping of str to array_like, shape (pairs,)
        What rewards are made of.

    Raises
    ------
    ValueError
        If shapes do not fit, there is no pair, or a number is not finite or outside its limits.
    """
    before = two_dimensional("situation", situation)
    pairs, inputs = before.shape
    if pairs == 0:
        raise ValueError("situation: has 0 pairs; a memory needs at least 1: explore for at least one step")
    if inputs == 0:
        raise ValueError("situation: has 0 components; a memory needs at least 1: give the percept's `situation`")
    did = two_dimensional("action", action, pairs, len(ACTION))
    after = two_dimensional("next_situation", next_situation, pairs, inputs)
    if not all(isinstance(name, str) for name in facts):
        raise TypeError(f"facts: have the names {list(facts)}; the name of a fact must be a text")
    table = np.empty((2 * inputs + len(ACTION) + len(facts), pairs), np.float32)
    _fill(table[:inputs], before, "situation")
    _fill(table[inputs : inputs + len(ACTION)], did, "action")
    _fill(table[inputs + len(ACTION) : len(table) - len(facts)], after, "next_situation")
    for row, name in zip(table[len(table) - len(facts) :], sorted(facts), strict=True):
        fact = _numbers(f"fact {name!r}", facts[name])
        if fact.shape != (pairs,):
            raise ValueError(f"fact {name!r}: has the shape {fact.shape}; it must have one number a pair, ({pairs},)")
        _fill(row[None], fact[:, None], f"fact {name!r}")
    for name, row in zip(ACTION, table[inputs:], strict=False):
        _check_limits(name, row)
    sort_pairs(table)
    return table


def check_table(table: Table, inputs: int) -> None:
    """Refuse a table that `table_of` could not have made; reads all of it.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        The numbers of a file.
    inputs : int
        How many components a situation has.

    Raises
    ------
    ValueError
        If a number is not finite, outside its limits or −0, or the pairs are not in canonical order.
    """
    for column, row in enumerate(table):
        name = ACTION[column - inputs] if 0 <= column - inputs < len(ACTION) else ""
        low, high = _LIMITS.get(name, (-MOST, MOST))
        # Part by part, so that only the first reads memory.
        for first in range(0, len(row), _CACHED):
            part = row[first : first + _CACHED]
            least, largest = part.min(), part.max()
            # So that NaN is wrong too.
            if not (least >= low and largest <= high):
                wrong = largest if least >= low else least
                raise ValueError(f"table[{column}] holds {wrong:g}, allowed are {low:g} to {high:g}")
            # As an integer, −0 is the least of all numbers.
            if part.view(np.int32).min() == np.iinfo(np.int32).min:
                raise ValueError(f"table[{column}] holds -0")
    if not is_ordered(table):
        raise ValueError("its pairs are not in the order of their content")


def two_dimensional(name: str, value: Any, pairs: int | None = None, columns: int | None = None) -> npt.NDArray[Any]:
    """Return `value` as an array with these numbers of rows and columns, where they are known.

    Raises
    ------
    TypeError, ValueError
        If it is no such array.
    """
    array = _numbers(name, value)
    wanted = (pairs, columns)
    if array.ndim != 2 or any(known not in (None, n) for known, n in zip(wanted, array.shape, strict=True)):
        shape = ", ".join(str(word if known is None else known) for word, known in zip(_AXES, wanted, strict=True))
        raise ValueError(f"{name}: has the shape {array.shape}; it must be ({shape})")
    return array


def _numbers(name: str, value: Any) -> npt.NDArray[Any]:
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: is no array ({error}); give rows of equal length") from None
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name}: has the type {array.dtype}; it must be numbers")
    return array


def _fill(rows: Table, values: npt.NDArray[Any], name: str) -> None:
    """Write values, one row a pair, to the rows of a table, one column a pair."""
    with np.errstate(over="ignore"):
        # Part by part, or each line of a large array would be fetched once for every component.
        for start in range(0, len(values), _PART):
            rows[:, start : start + _PART] = values[start : start + _PART].T
    for component, row in enumerate(rows):
        # So that NaN is wrong too.
        wrong = ~(np.abs(row) <= MOST)
        if wrong.any():
            pair = int(np.argmax(wrong))
            place = f"{pair}, {component}" if values.shape[1] > 1 else f"{pair}"
            raise ValueError(
                f"{name}[{place}] = {values[pair, component]}: a memory holds finite float32 only, up to {MOST:g}; "
                "leave such pairs out, or mend the exploration that recorded them"
            )


def _check_limits(name: str, row: Table) -> None:
    low, high = _LIMITS[name]
    wrong = (row < low) | (row > high)
    if wrong.any():
        raise ValueError(f"action: {name} = {row[np.argmax(wrong)]:g}; it must be {_UNITS[name]}")
