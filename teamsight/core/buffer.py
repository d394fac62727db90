"""A buffer that grows: rows are written into room made beforehand, by Python or by compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


class Buffer:
    """Rows of one shape and type.

    Parameters
    ----------
    shape : tuple of int
        The shape of a row.
    dtype : dtype
        The type of its elements.
    room : int
        How many rows there is room for at first.

    Attributes
    ----------
    array : ndarray, shape (room, …)
        The rows written and the room after them; another array whenever `make_room` returns True.
    rows : int
        How many rows are written; whoever writes them adds them here.
    """

    def __init__(self, shape: tuple[int, ...], dtype: npt.DTypeLike = np.float64, room: int = 16) -> None:
        self.array: npt.NDArray[Any] = np.zeros((room, *shape), dtype)
        self.rows = 0

    @property
    def written(self) -> npt.NDArray[Any]:
        """The rows written, as a view."""
        return self.array[: self.rows]

    def make_room(self, rows: int) -> bool:
        """Make room for so many more rows; return whether `array` is another one now."""
        need, room = self.rows + rows, len(self.array)
        if need <= room:
            return False
        longer = np.zeros((max(need, 2 * room), *self.array.shape[1:]), self.array.dtype)
        longer[: self.rows] = self.written
        self.array = longer
        return True
