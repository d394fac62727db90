"""Lazy Q-learning as the paper has it: the best action among those of the nearest situations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from teamsight.core.kernel import inlined, scratch
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.action_values import MOST_MATCHES
from teamsight.policies.lazy.learner import LazyLearner, act, is_situation, refuse
from teamsight.policies.memory import LazyMemory
from teamsight.policies.memory.nearest import k_nearest

#: The exploration that ships with the package: 5 robots, 120 steps, 10 targets, and the seed that the search chose
#: (docs/lazy-search.md). Made by ``teamsight learn explore --seed 38``.
SHIPPED = Path(__file__).parent.parent / "data" / "lazy-600.safetensors"

_INPUTS, _ACTION, _K = range(3)
_VALUES = 3


@inlined
def _best_of_nearest(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    table = arrays.table
    parameters = arrays.parameters
    inputs = int(parameters[_INPUTS])
    row = int(parameters[_ACTION])
    k = int(parameters[_K])
    index = scratch(MOST_MATCHES, np.int64)
    distance = scratch(MOST_MATCHES, np.float32)
    for i in range(percept.heading.shape[0]):
        if not is_situation(percept.situation[i], inputs):
            refuse(i, percept, action)
            continue
        k_nearest(table, inputs, percept.situation[i], k, index, distance)
        best = index[0]
        for match in range(1, k):
            # Only a higher utility counts, so that of equals the nearest stays.
            if parameters[_VALUES + index[match]] > parameters[_VALUES + best]:
                best = index[match]
        act(table[row, best], table[row + 1, best], i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class LazyQ(LazyLearner):
    """Do what was done in the best of the `k` nearest situations.

    There is no maximum distance and no random action. Of equal utilities the nearer pair decides; of equally near
    pairs the one whose content comes first.

    Parameters are those of `LazyLearner`.

    Notes
    -----
    *Source:* §8.1 and §8.2. *Departs:* the paper leaves open k, γ, the sweeps, and whose reward it is; what
    each is worth is told in docs/lazy-search.md.
    """

    kernel = _best_of_nearest

    @property
    def parameters(self) -> Floats:
        return np.concatenate([[self.inputs, self.memory.inputs, self.k], self.values])


@cache
def shipped() -> LazyMemory:
    """Return the exploration that ships with the package."""
    return LazyMemory.load(SHIPPED)


def lazy_collective() -> LazyQ:
    """Return `LazyQ` on the shipped exploration, comparing the robot's own 16 inputs; for `NoAwareness`."""
    return LazyQ(shipped(), inputs=shipped().own)


def lazy_cooperative() -> LazyQ:
    """Return `LazyQ` on the shipped exploration, comparing all 32 inputs; for ``RingAwareness(16)``."""
    return LazyQ(shipped())
