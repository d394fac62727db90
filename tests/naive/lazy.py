"""Slow twins of the lazy memory, written like the paper's sentences."""

from __future__ import annotations

from typing import Any

import numpy as np


def similarity(a: Any, b: Any) -> np.float32:
    """Eq. 1: the sum over the components of the absolute differences of two situations."""
    total = np.float32(0)
    for one, other in zip(a, b, strict=True):
        total = total + abs(np.float32(one) - np.float32(other))
    return total


def nearest(situations: Any, query: Any, k: int) -> list[tuple[np.float32, int]]:
    """The k transitions of smallest distance and, among equals, of smallest place; as (distance, place)."""
    return sorted((similarity(s, query), place) for place, s in enumerate(situations))[:k]
