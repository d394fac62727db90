"""Pessimistic lazy Q-learning: the action of which the worst that is known is best."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from teamsight.core import checks
from teamsight.core.kernel import inlined, scratch
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.action_values import MOST_MATCHES
from teamsight.policies.lazy.learner import K, LazyLearner, act, find_matches, first_own, refuse

_MOST_ACTIONS = 256
_FULL_TURN = 2.0 * math.pi


@inlined
def _best_worst(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    k = int(parameters[K])
    grid = first_own(parameters)
    rotations = parameters[grid]
    distances = int(parameters[grid + 1])
    values = grid + 2
    nearest_action = values + arrays.table.shape[1]
    index = scratch(MOST_MATCHES, np.int64)
    distance = scratch(MOST_MATCHES, np.float32)
    worst = scratch(_MOST_ACTIONS, np.float64)
    for i in range(percept.heading.shape[0]):
        if not find_matches(percept.situation[i], arrays, k, index, distance):
            refuse(i, percept, action)
            continue
        for one in range(int(rotations) * distances):
            worst[one] = np.inf
        for match in range(k):
            one = int(parameters[nearest_action + index[match]])
            worst[one] = min(worst[one], parameters[values + index[match]])
        best = int(parameters[nearest_action + index[0]])
        for match in range(1, k):
            one = int(parameters[nearest_action + index[match]])
            if worst[one] > worst[best]:
                best = one
        rotation = _FULL_TURN * (best // distances) / rotations
        act(rotation, (best % distances + 1) / distances, i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class PessimisticLazyQ(LazyLearner):
    """Do the action of a grid whose worst utility among the matching pairs is best.

    Each pair speaks for the action of the grid that is nearest to its own; actions for which none of the `k` matches
    speaks are left out. Of equals the action of the nearer pair is taken.

    Parameters
    ----------
    rotations, distances : int
        The grid: so many directions, the first straight ahead; and so many equal parts of the speed, the last all of
        it. At most 256 actions. The other parameters are those of `LazyLearner`.

    Notes
    -----
    *Source:* C. F. Touzet, "Distributed lazy Q-learning for cooperative mobile robots" (2004), as recalled: for each
    action the minimum utility over the matching situations, and the action whose minimum is largest. *Departs:* its
    grid and its number of matches are not known to us. The utilities themselves are those of `LazyQ`.
    """

    k: int = 30
    rotations: int = 8
    distances: int = 2

    kernel = _best_worst

    def __post_init__(self) -> None:
        checks.count("rotations", self.rotations)
        checks.count("distances", self.distances)
        if self.rotations * self.distances > _MOST_ACTIONS:
            raise ValueError(
                f"rotations={self.rotations}, distances={self.distances}: more than {_MOST_ACTIONS} actions; use fewer"
            )
        super().__post_init__()

    def _constants(self) -> dict[str, Any]:
        return super()._constants() | {"rotations": self.rotations, "distances": self.distances}

    @property
    def parameters(self) -> Floats:
        kept = self.search_table.kept
        grid = [self.rotations, self.distances]
        return np.concatenate([super().parameters, grid, self.values[kept], self._nearest_action()[kept]])

    def _nearest_action(self) -> Floats:
        """Return for each pair the number of the action that it speaks for."""
        rotation, share = np.asarray(self.memory.action, float).T
        turn = np.floor(rotation / _FULL_TURN * self.rotations + 0.5) % self.rotations
        # Halfway between two distances, the longer.
        part = np.clip(np.floor(share * self.distances + 0.5) - 1, 0, self.distances - 1)
        return np.asarray(turn * self.distances + part)
