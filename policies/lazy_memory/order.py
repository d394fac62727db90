"""The canonical order of pairs: by what they hold, so that a place says nothing of when or by whom a pair was met."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Table = npt.NDArray[np.float32]

_SIGN = np.uint32(1 << 31)


def sort_pairs(table: Table) -> None:
    """Bring the columns of a table into lexicographic order, the first row counting most; in place.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        Without NaN. −0 becomes 0, which is the same number in other bits.
    """
    for row in table:
        row += np.float32(0.0)
    order = canonical_order(table)
    if order is not None:
        for row in table:
            row[:] = row[order]


def canonical_order(table: Table) -> npt.NDArray[np.int64] | None:
    """Return the places of the pairs in lexicographic order, or None if that is how they stand.

    Notes
    -----
    Pairs that are equal so far form groups; each row of the table splits the groups that are left, until every pair
    stands alone. Sorting by all rows at once would sort ten million pairs seventy times.
    """
    pairs = table.shape[1]
    order = np.arange(pairs)
    # Places whose pair is not alone in its group, and the number of their group; numbers rise with the places.
    place, group = order.copy(), np.zeros(pairs, np.uint64)
    moved = False
    for row in table:
        if not len(place):
            break
        pair = order[place]
        key = (group << np.uint64(32)) | _rising_bits(row[pair])
        if np.any(key[1:] < key[:-1]):
            moved = True
            by_key = np.argsort(key)
            order[place], key = pair[by_key], key[by_key]
        differs = np.ones(len(key) + 1, np.bool_)
        np.not_equal(key[1:], key[:-1], out=differs[1:-1])
        shared = ~(differs[1:] & differs[:-1])
        group = np.cumsum(differs[:-1], dtype=np.uint64)[shared]
        place = place[shared]
    return order if moved else None


def _rising_bits(numbers: Table) -> Any:
    """Return whole numbers that stand in the order of the float32 given."""
    bits = numbers.view(np.uint32)
    return np.where(bits & _SIGN, ~bits, bits | _SIGN)
