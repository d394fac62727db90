"""Fences: copies of arrays that reveal writes next to them, or into them if they are read-only."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

# Bytes on either side: a multiple of a cache line, so that arrays are aligned as in a world.
_WIDTH = 4096
_FILLING = 0xA5


class Fences:
    """A set of arrays, each between two stretches of bytes that must not change."""

    def __init__(self) -> None:
        # Bytes that must not change, each with its name and its first content.
        self._fixed: list[tuple[str, npt.NDArray[np.uint8], bytes]] = []

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
        for part in [block] if read_only else [block[:first], block[last:]]:
            self._fixed.append((name, part, part.tobytes()))
        return copy

    def broken(self) -> str:
        """Return the name of the first array with a forbidden write; "" if there is none."""
        return next((name for name, part, before in self._fixed if part.tobytes() != before), "")
