"""Lazy Q-learning after Sheppard: robots continue to explore, and each stores and updates its own utilities."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from teamsight.core import checks
from teamsight.core.component import NonNegative, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.actions import act
from teamsight.policies.interface import Floats, PolicyState
from teamsight.policies.lazy.learner import LazyLearner, action_values
from teamsight.policies.learner import Learner, is_situation, refuse
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import tabulate

#: Rewards are tabulated for up to this many targets gained and lost at once.
MOST_CHANGE = 8
#: A robot keeps the identities of at most this many sensed targets.
MOST_SEEN = 64

_OWN_INPUTS = 32
_CAPACITY = 600

# The table of rewards follows.
_INPUTS, _THRESHOLD, _SIMILAR, _EXPLORE, _LEARNING_RATE, _DISCOUNT, _REWARDS = range(7)
# In the first row of `ints`: number of transitions stored, index of the last, number of targets that were sensed.
_STORED, _PENDING, _SEEN = range(3)
_FULL_TURN = 2.0 * math.pi


@inlined
def _apart(store: Any, j: int, situation: Any, inputs: int, limit: float) -> float:
    """Return the distance of a stored situation by eq. 1, or a number above `limit`."""
    total = 0.0
    for c in range(inputs):
        total += abs(store[j, c] - situation[c])
        if total > limit:
            break
    return total


@inlined
def _best_match(store: Any, count: int, situation: Any, parameters: Any) -> int:
    """Return the transition of highest utility among the similar situations; −1 if none is similar."""
    inputs = int(parameters[_INPUTS])
    best = -1
    nearness = 0.0
    for j in range(count):
        distance = _apart(store, j, situation, inputs, parameters[_THRESHOLD])
        if distance <= parameters[_THRESHOLD]:
            value = store[j, inputs + 2]
            known = store[best, inputs + 2] if best >= 0 else -np.inf
            # Of equal utilities the nearest.
            if value > known or (value == known and distance < nearness):
                best = j
                nearness = distance
    return best


@inlined
def _learn(store: Any, count: int, pending: int, goal: float, parameters: Any) -> None:
    """Move the utility of the last transition, and of those similar to it, towards the goal."""
    inputs = int(parameters[_INPUTS])
    for j in range(count):
        turn = abs(store[j, inputs] - store[pending, inputs]) / math.pi
        unlike = min(turn, 2.0 - turn) + abs(store[j, inputs + 1] - store[pending, inputs + 1])
        if unlike <= parameters[_SIMILAR] and (
            _apart(store, j, store[pending], inputs, parameters[_THRESHOLD]) <= parameters[_THRESHOLD]
        ):
            store[j, inputs + 2] += parameters[_LEARNING_RATE] * (goal - store[j, inputs + 2])


@inlined
def _reward(percept: Any, i: int, ints: Any, parameters: Any) -> Any:
    """Return the reward for the change of the sensed targets, and store those that are sensed now."""
    targets = percept.targets
    first = targets.start[i]
    now = min(targets.start[i + 1] - first, MOST_SEEN)
    before = ints[0, _SEEN]
    kept = 0
    at = 0
    for t in range(now):
        # Both lists ascend.
        while at < before and ints[1 + at, 0] < targets.identity[first + t]:
            at += 1
        kept += at < before and ints[1 + at, 0] == targets.identity[first + t]
    for t in range(now):
        ints[1 + t, 0] = targets.identity[first + t]
    ints[0, _SEEN] = now
    gained = min(now - kept, MOST_CHANGE)
    lost = min(before - kept, MOST_CHANGE)
    return parameters[_REWARDS + gained * (MOST_CHANGE + 1) + lost]


@inlined
def _learn_and_act(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    inputs = int(parameters[_INPUTS])
    capacity = arrays.state.floats.shape[1]
    for i in range(percept.heading.shape[0]):
        store = arrays.state.floats[i]
        ints = arrays.state.ints[i]
        situation = percept.situation[i]
        if not is_situation(situation, inputs):
            refuse(i, percept, action)
            continue
        count = min(ints[0, _STORED], capacity)
        pending = ints[0, _PENDING]
        reward = _reward(percept, i, ints, parameters)
        if pending >= 0:
            best = _best_match(store, count, situation, parameters)
            ahead = store[best, inputs + 2] if best >= 0 else 0.0
            _learn(store, count, pending, reward + parameters[_DISCOUNT] * ahead, parameters)
        best = -1
        if noise[0, i] >= parameters[_EXPLORE]:
            best = _best_match(store, count, situation, parameters)
        rotation = _FULL_TURN * (noise[1, i] - 0.5) if best < 0 else store[best, inputs]
        share = noise[2, i] if best < 0 else store[best, inputs + 1]
        act(rotation, share, i, percept, action)
        slot = ints[0, _STORED] % capacity
        for c in range(inputs):
            store[slot, c] = situation[c]
        store[slot, inputs] = rotation
        store[slot, inputs + 1] = share
        store[slot, inputs + 2] = 0.0
        ints[0, _STORED] += 1
        ints[0, _PENDING] = slot


@dataclass(frozen=True, eq=False, repr=False)
class SheppardLazyQ(Learner):
    """Repeat the action of highest utility among similar situations, explore now and then, and update utilities.

    Every robot has a store of its own. In a full store a new transition replaces the oldest.

    Parameters
    ----------
    memory : LazyMemory, optional
        Transitions with which every robot's store begins, at their action values.
    reward : callable
        The reward for the targets that the robot itself gained and lost; see `teamsight.policies.rewards`.
    inputs : int, optional
        Number of components of a situation. By default all of the memory; without a memory 32, those of
        ``RingAwareness(16)``.
    discount : float, default 0.7
        Discount factor γ, in [0, 1]. The value of a situation without a similar one in the store is 0.
    learning_rate : float, default 0.5
        Learning rate α in Q ← Q + α [r + γ max Q′ − Q], in [0, 1].
    threshold : float, default 1
        Largest distance, by eq. 1, of similar situations.
    similar_action : float, default 0.25
        Largest difference of similar actions: the sum of the difference in rotation, in half turns, and in distance, in
        shares of the speed.
    explore : float, default 0.3
        Probability of a random action. Without a similar situation the action is always random.
    capacity : int, optional
        Transitions that a robot stores: by default 600, or as many as the memory has if these are more.

    Attributes
    ----------
    rewards : ndarray, shape (81,), float64
        By the number of targets gained, then lost.
    values : ndarray, shape (transitions,), float64, or None
        Action values of the transitions of `memory`.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, the memory does not fit `inputs` or `capacity`, or the reward needs more
        than the numbers of targets gained and lost.

    Notes
    -----
    *Source:* §8.1, after J. W. Sheppard and S. L. Salzberg (1997): a fixed distance; a random action if nothing similar
    is found, and otherwise with probability 0.3; Q stored with new transitions and updated for similar ones. *Departs:*
    similarity, α and the initial values are not given there. More than 8 targets gained or lost at once count as 8, and
    of more than 64 sensed targets only the first 64 count.
    """

    memory: LazyMemory | None = None  # type: ignore[assignment]
    discount: Probability = 0.7
    learning_rate: Probability = 0.5
    threshold: NonNegative = 1.0
    similar_action: NonNegative = 0.25
    explore: Probability = 0.3
    capacity: int = None  # type: ignore[assignment]  # replaced by a number in __post_init__
    rewards: Floats = field(init=False)
    values: Floats | None = field(init=False, default=None)

    title = "Sheppard's lazy Q-learning"
    kernel = _learn_and_act
    draws = 3

    def __post_init__(self) -> None:
        if self.memory is not None:
            super().__post_init__()
        else:
            # Not that of `Learner`, which reads the memory.
            super(Learner, self).__post_init__()
            if self.inputs is None:
                object.__setattr__(self, "inputs", _OWN_INPUTS)
            checks.count("inputs", self.inputs)
        size = 0 if self.memory is None else len(self.memory)
        if self.capacity is None:
            object.__setattr__(self, "capacity", max(size, _CAPACITY))
        checks.count("capacity", self.capacity)
        if size > self.capacity:
            raise ValueError(
                f"capacity={self.capacity}: the memory has {size} transitions; give a larger capacity, or a smaller "
                "memory.sample()"
            )
        if self.memory is not None:
            # Computed here, once for all worlds that use the policy.
            k = min(LazyLearner.k, size)
            values = action_values(self.memory, self.reward, inputs=self.inputs, k=k, discount=self.discount)
            object.__setattr__(self, "values", values)
        object.__setattr__(self, "rewards", tabulate(self.reward, MOST_CHANGE).ravel())

    @property
    def learned(self) -> Floats:
        return self.rewards

    @property
    def degree(self) -> str | None:  # type: ignore[override]
        """Name of the degree of awareness of the memory's situations; None without a memory."""
        return None if self.memory is None else super().degree

    def remedy(self, degree: str, width: int) -> str:
        return "" if self.memory is None else super().remedy(degree, width)

    @property
    def parameters(self) -> Floats:
        constants = [self.inputs, self.threshold, self.similar_action, self.explore, self.learning_rate, self.discount]
        return np.concatenate([constants, self.rewards])

    def start(self, size: int) -> PolicyState:
        floats = np.zeros((size, self.capacity, self.inputs + 3))
        ints = np.zeros((size, 1 + MOST_SEEN, 3), np.int64)
        ints[:, 0, _PENDING] = -1
        if self.memory is not None:
            stored = len(self.memory)
            floats[:, :stored, : self.inputs] = self.memory.situation[:, : self.inputs]
            floats[:, :stored, self.inputs : self.inputs + 2] = self.memory.action
            floats[:, :stored, self.inputs + 2] = self.values
            ints[:, 0, _STORED] = stored
        return PolicyState(floats, ints)
