"""Seeds that differ from run to run and are printed, so that pytest shows them when a test fails.

Set TEAMSIGHT_TEST_SEED to repeat a failure.
"""

from __future__ import annotations

import os
import secrets

import numpy as np


def fresh_seed() -> int:
    """Return a seed, and print it."""
    seed = int(os.environ.get("TEAMSIGHT_TEST_SEED") or secrets.randbits(31))
    print(f"TEAMSIGHT_TEST_SEED={seed}")
    return seed


def generator() -> np.random.Generator:
    """Return a generator whose seed is printed."""
    return np.random.default_rng(fresh_seed())
