"""Seeds that are printed, so that pytest shows them when a test fails.

The same test gets the same seeds in every run; with ``pytest --explore`` they differ. Set TEAMSIGHT_TEST_SEED to repeat a
failure.
"""

from __future__ import annotations

import os
import secrets

import numpy as np

#: Returns so many random bits; `conftest.py` replaces it.
draw = secrets.randbits


def fresh_seed() -> int:
    """Return a seed, and print it."""
    seed = int(os.environ.get("TEAMSIGHT_TEST_SEED") or draw(31))
    print(f"TEAMSIGHT_TEST_SEED={seed}")
    return seed


def generator() -> np.random.Generator:
    """Return a generator whose seed is printed."""
    return np.random.default_rng(fresh_seed())
