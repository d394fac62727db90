"""Selection: rows of a group given by a list, an array or a mask."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.core import checks


def rows_of(index: Any, size: int, group: str) -> list[int]:
    """Return the rows that an index of one dimension selects from a group of `size` agents.

    Raises
    ------
    TypeError, IndexError
        If they are not whole numbers or a mask, or if a row or the length of a mask is wrong.
    """
    rows = np.asarray(index)
    if rows.ndim != 1 or (rows.dtype.kind not in "iub" and rows.size):
        raise TypeError(
            f"{group}[{checks.shown(index)}]: give a row, a slice, a list of rows, or a mask of shape ({size},)"
        ) from None
    if rows.dtype.kind == "b":
        if len(rows) != size:
            raise IndexError(
                f"{group}[…]: the mask has {len(rows)} elements; give {size}, one for each agent"
            ) from None
        rows = np.flatnonzero(rows)
    outside = rows[(rows < -size) | (rows >= size)]
    if outside.size:
        raise IndexError(
            f"{group}[{outside[0]}]: the group has {size} agents, with rows from 0 to {size - 1}"
        ) from None
    return [int(row) for row in rows]
