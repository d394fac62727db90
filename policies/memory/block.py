"""Find the k smallest distances of a block, with SIMD lanes."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.core.kernel import below_64, inlined, ones

BLOCK = 1024
"""Number of distances computed at once. They fit the first cache, and most memories fit one block."""

LANES = 64
"""Number of distances compared with a limit at once: one bit of a word each."""

_HALVINGS = 8
_TINY = np.float32(1e-30)


@inlined
def bound(total: Any, count: Any, k: Any, least: Any) -> Any:
    """Return a limit below which at least k distances of a block are, and few more.

    It is found among the smallest distance of each lane: if k of these are below a limit, so are k distances. The limit
    is infinite if fewer than k distances are finite.

    Parameters
    ----------
    total : ndarray, shape (BLOCK,), float32
        The distances, infinite behind the last.
    count : int
        Number of distances.
    k : int
        At most `LANES`.
    least : ndarray, shape (LANES,), float32
        Work space.
    """
    for lane in range(LANES):
        least[np.uint64(lane)] = total[np.uint64(lane)]
    for part in range(LANES, count, LANES):
        for lane in range(LANES):
            i = np.uint64(lane)
            other = total[np.uint64(part) + i]
            least[i] = other if other < least[i] else least[i]
    high = _TINY
    for lane in range(k):
        high = max(high, least[np.uint64(lane)])
    low, high = np.float32(0.0), high + high
    for _ in range(_HALVINGS):
        middle = np.float32(0.5) * (low + high)
        if ones(below_64(least, 0, middle)) >= k:
            high = middle
        else:
            low = middle
    return high


@inlined
def insert(index: Any, distance: Any, k: Any, column: Any, far: Any) -> None:
    """Insert a column after all that are as near, which precede it in the table; the last one is dropped."""
    place = k - 1
    while place > 0 and distance[place - 1] > far:
        distance[place] = distance[place - 1]
        index[place] = index[place - 1]
        place -= 1
    distance[place] = far
    index[place] = column
