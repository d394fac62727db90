"""Fences: copies of arrays that reveal writes next to them, or into them if they are read-only."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

# Bytes on either side: a multiple of a cache line, so that arrays are aligned as in a world.
_WIDTH = 4096
_FILLING = 0xA5


class _Fenced(NamedTuple):
    name: str
    block: npt.NDArray[np.uint8]
    first: int
    last: int
    original: npt.NDArray[Any] | None


class Fences:
    """A set of arrays, each between two stretches of bytes that must not change."""

    def __init__(self) -> None:
        self._fenced: list[_Fenced] = []

    def put(self, name: str, array: npt.NDArray[Any], *, read_only: bool = False) -> npt.NDArray[Any]:
        """Return a copy of an array between fences.

        Parameters
        ----------
        name : str
            The name that `broken` returns.
        array : ndarray
            The array.
        read_only : bool, default False
            Whether its content must not change either.
        """
        array = np.ascontiguousarray(array)
        block = np.full(array.nbytes + 2 * _WIDTH + 64, _FILLING, np.uint8)
        first = _WIDTH + -block.ctypes.data % 64
        last = first + array.nbytes
        copy = block[first:last].view(array.dtype).reshape(array.shape)
        copy[...] = array
        self._fenced.append(_Fenced(name, block, first, last, array.copy() if read_only else None))
        return copy

    def broken(self) -> str:
        """Return the name of the first array with a forbidden write; "" if there is none."""
        for name, block, first, last, original in self._fenced:
            if (block[:first] != _FILLING).any() or (block[last:] != _FILLING).any():
                return name
            if original is not None and original.tobytes() != block[first:last].tobytes():
                return name
        return ""
