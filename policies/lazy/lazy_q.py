"""Lazy Q-learning as in the paper: the best action among those of the nearest situations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from teamsight.core.kernel import inlined, scratch
from teamsight.policies.actions import ActionGrid, act
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.learner import MOST_MATCHES, K, LazyLearner, Matches, find_matches, first_own
from teamsight.policies.learner import refuse
from teamsight.policies.memory import LazyMemory

#: The exploration that ships with the package: 5 robots, 120 steps, 10 targets. ``teamsight learn explore`` makes it by
#: default; its seed, 0, was not chosen among others.
SHIPPED = Path(__file__).parent.parent / "data" / "lazy-600.safetensors"


@inlined
def _best_of_nearest(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    k = int(parameters[K])
    columns = arrays.table.shape[1]
    values = first_own(parameters)
    index = scratch(MOST_MATCHES, np.int64)
    distance = scratch(MOST_MATCHES, np.float32)
    for i in range(percept.heading.shape[0]):
        if not find_matches(percept.situation[i], arrays, k, index, distance):
            refuse(i, percept, action)
            continue
        best = index[0]
        for match in range(1, k):
            # Strictly greater, so that the nearest of equal values is kept.
            if parameters[values + index[match]] > parameters[values + best]:
                best = index[match]
        rotation = values + columns + best
        act(parameters[rotation], parameters[rotation + columns], i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class LazyQ(LazyLearner):
    """Repeat the action of the highest value among the `k` nearest situations.

    There is no maximum distance and no random action. Of equal values the nearer transition is used; of equally near
    transitions the one that comes first in the canonical order of the memory. Parameters are those of `LazyLearner`.

    Notes
    -----
    *Source:* §8.1 and §8.2. *Departs:* the paper does not give k, γ and the number of sweeps, and does not say whether
    the reward is the robot's or the team's; docs/lazy-q.md shows why this reading does not learn.
    """

    title = "lazy Q-learning"
    kernel = _best_of_nearest

    @property
    def parameters(self) -> Floats:
        kept = self.search_table.kept
        return np.concatenate([super().parameters, self.values[kept], *self.memory.action[kept].T])


@cache
def shipped() -> LazyMemory:
    """Return the exploration that ships with the package."""
    return LazyMemory.load(SHIPPED)


def lazy_collective() -> LazyQ:
    """Return `LazyQ` on the shipped exploration with the robot's own 16 inputs, for `NoAwareness`."""
    return LazyQ(shipped(), inputs=shipped().own)


def lazy_cooperative() -> LazyQ:
    """Return `LazyQ` on the shipped exploration with all 32 inputs, for ``RingAwareness(16)``."""
    return LazyQ(shipped())


_MOST_ACTIONS = 256


@inlined
def _best_worst(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    k = int(parameters[K])
    grid = first_own(parameters)
    actions = int(parameters[grid])
    values = grid + 1 + 2 * actions
    nearest_action = values + arrays.table.shape[1]
    index = scratch(MOST_MATCHES, np.int64)
    distance = scratch(MOST_MATCHES, np.float32)
    worst = scratch(_MOST_ACTIONS, np.float64)
    for i in range(percept.heading.shape[0]):
        if not find_matches(percept.situation[i], arrays, k, index, distance):
            refuse(i, percept, action)
            continue
        for one in range(actions):
            worst[one] = np.inf
        for match in range(k):
            one = int(parameters[nearest_action + index[match]])
            worst[one] = min(worst[one], parameters[values + index[match]])
        best = int(parameters[nearest_action + index[0]])
        for match in range(1, k):
            one = int(parameters[nearest_action + index[match]])
            if worst[one] > worst[best]:
                best = one
        chosen = grid + 1 + 2 * best
        act(parameters[chosen], parameters[chosen + 1], i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class PessimisticLazyQ(LazyLearner):
    """Do the action of a grid whose lowest value among the matching transitions is highest.

    Each transition counts for the action of the grid that is nearest to its own. Actions without a match are not
    considered. Of equal actions the one of the nearer transition is used.

    Parameters
    ----------
    memory, reward, inputs, discount, k, sweeps
        As for `LazyLearner`; `k` is 30 by default.
    actions : ActionGrid
        The actions to choose from, at most 256. By default 8 rotations, each with the whole or half the speed.

    Notes
    -----
    *Source:* C. F. Touzet, "Distributed lazy Q-learning for cooperative mobile robots" (2004), quoted from memory: for
    each action the minimum value over the matching situations, and the action with the largest minimum. *Departs:* its
    grid and number of matches are unknown to us. Values are those of `LazyQ`.
    """

    k: Matches = 30
    # A recorded distance halfway between both counts for the whole speed, which is listed first.
    actions: ActionGrid = ActionGrid(8, (1.0, 0.5))  # noqa: RUF009 (frozen)

    title = "pessimistic lazy Q-learning"
    kernel = _best_worst

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.actions, ActionGrid):
            raise TypeError(f"actions={self.actions!r}: must be an ActionGrid(rotations, distances)")
        if len(self.actions) > _MOST_ACTIONS:
            raise ValueError(f"actions={self.actions}: has {len(self.actions)} actions; at most {_MOST_ACTIONS} fit")

    @property
    def parameters(self) -> Floats:
        kept, grid = self.search_table.kept, self.actions
        nearest_action = grid.index(self.memory.action[kept])
        actions = [[len(grid)], grid.actions.ravel()]
        return np.concatenate([super().parameters, *actions, self.values[kept], nearest_action])
