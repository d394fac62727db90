"""The k least of a block of distances, which are compared in SIMD lanes."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.core.kernel import below_64, inlined, ones

BLOCK = 1024
"""How many distances are found at once: they stay in the first cache, and most memories begin and end in one block."""

LANES = 64
"""How many distances are compared with a limit at once: one bit of a word for each."""

_HALVINGS = 8
_TINY = np.float32(1e-30)


@inlined
def bound(total: Any, count: Any, k: Any, least: Any) -> Any:
    """Return a limit that at least k distances of a block are below, but few more, so that few insertions are wasted.

    It is found from the smallest distance of each lane: if these are below the limit in k lanes, k distances are. It is
    infinite if fewer than k distances are finite.
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
def insert(index: Any, distance: Any, k: Any, transition: Any, far: Any) -> None:
    """Put a transition behind all that are as near, since those stand before it in the table; the last falls out."""
    place = k - 1
    while place > 0 and distance[place - 1] > far:
        distance[place] = distance[place - 1]
        index[place] = index[place - 1]
        place -= 1
    distance[place] = far
    index[place] = transition
