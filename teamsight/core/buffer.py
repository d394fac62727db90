"""A buffer that grows: Python or compiled code writes rows into room made beforehand."""

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
        The number of rows for which there is room at first.

    Attributes
    ----------
    array : ndarray, shape (room, …)
        The written rows and the room after them; `make_room` returns True if it has replaced this array.
    rows : int
        The number of written rows; increase it after writing.
    """

    def __init__(self, shape: tuple[int, ...], dtype: npt.DTypeLike = np.float64, room: int = 16) -> None:
        self.array: npt.NDArray[Any] = np.zeros((room, *shape), dtype)
        self.rows = 0

    @property
    def written(self) -> npt.NDArray[Any]:
        """The written rows, as a view."""
        return self.array[: self.rows]

    def make_room(self, rows: int) -> bool:
        """Make room for this many more rows; return whether `array` was replaced."""
        need, room = self.rows + rows, len(self.array)
        if need <= room:
            return False
        longer = np.zeros((max(need, 2 * room), *self.array.shape[1:]), self.array.dtype)
        longer[: self.rows] = self.written
        self.array = longer
        return True
