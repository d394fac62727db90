"""Memory of ended recordings, for the next ones: to use memory for the first time costs more than to record."""

from __future__ import annotations

import threading

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]

# The largest size of all of it [bytes].
_MOST = 2**24
_spare: list[Bytes] = []
# Worlds in several threads may be recorded, and no two may get the same memory.
_lock = threading.Lock()


def memory(size: int) -> Bytes:
    """Return at least so many bytes: the largest spare ones, or new ones."""
    with _lock:
        fitting = [number for number, one in enumerate(_spare) if len(one) >= size]
        if fitting:
            return _spare.pop(max(fitting, key=lambda number: len(_spare[number])))
    # Not of zeros: a page of it takes memory when something is written there.
    return np.empty(size, np.uint8)


def give_back(spare: Bytes) -> None:
    """Keep memory that is used no more, unless there is much already."""
    with _lock:
        if len(spare) + sum(map(len, _spare)) <= _MOST:
            _spare.append(spare)
