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

    def put(self, name: str, value: Any, *, read_only: bool = False) -> Any:
        """Return a copy of an array, or of each array of a NamedTuple, between fences; other values as they are.

        Parameters
        ----------
        name : str
            Its name in errors.
        value : object
            The array or arrays.
        read_only : bool, default False
            Whether the content must not change either.
        """
        if isinstance(value, tuple):
            parts = zip(getattr(value, "_fields", ()), value, strict=True)
            return type(value)(*(self.put(f"{name}.{part}", inner, read_only=read_only) for part, inner in parts))
        if not isinstance(value, np.ndarray):
            return value
        array = np.ascontiguousarray(value)
        block = np.full(array.nbytes + 2 * _WIDTH + 64, _FILLING, np.uint8)
        first = _WIDTH + -block.ctypes.data % 64
        last = first + array.nbytes
        copy = block[first:last].view(array.dtype).reshape(array.shape)
        copy[...] = array
        self._fenced.append(_Fenced(name, block, first, last, array.copy() if read_only else None))
        return copy

    def check(self, kernel: str) -> None:
        """Raise an error if `kernel`, named with its class, wrote where it must not.

        Raises
        ------
        ValueError
            Naming the first such array.
        """
        for name, block, first, last, original in self._fenced:
            is_changed = original is not None and original.tobytes() != block[first:last].tobytes()
            if is_changed or (block[:first] != _FILLING).any() or (block[last:] != _FILLING).any():
                raise ValueError(
                    f"{kernel} writes next to {name}, or into it although it is read-only; index arrays within their "
                    "shape"
                )
