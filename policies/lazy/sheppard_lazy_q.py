"""Lazy Q-learning as Sheppard and others have it: each robot goes on exploring, and stores what its pairs are worth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Floats, Percept, PolicyState
from teamsight.policies.lazy.action_values import components, degree_of, remedy, utility
from teamsight.policies.lazy.learner import LazyLearner, act, check_situation, digest_of, is_situation, refuse
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import Reward, name_of, own_reward, tabulate

#: Rewards are tabulated for up to so many targets gained and lost at once.
MOST_CHANGE = 8
#: Of so many targets in sight a robot keeps the identities.
MOST_SEEN = 64

_INPUTS, _THRESHOLD, _SIMILAR, _EXPLORE, _LEARNING_RATE, _DISCOUNT = range(6)
_REWARDS = 6
# In the first row of `ints`: how many pairs were stored, which awaits its outcome, how many targets were in sight.
_STORED, _PENDING, _SEEN = range(3)
_FULL_TURN = 2.0 * math.pi


@inlined
def _apart(store: Any, j: int, situation: Any, inputs: int, limit: float) -> float:
    """Return the distance of a stored situation by eq. 1, or something beyond `limit`."""
    total = 0.0
    for c in range(inputs):
        total += abs(store[j, c] - situation[c])
        if total > limit:
            break
    return total


@inlined
def _best_match(store: Any, count: int, situation: Any, parameters: Any) -> int:
    """Return the pair of highest Q among the similar situations, of equals the nearest; −1 if none is similar."""
    inputs = int(parameters[_INPUTS])
    best = -1
    nearness = 0.0
    for j in range(count):
        distance = _apart(store, j, situation, inputs, parameters[_THRESHOLD])
        if distance <= parameters[_THRESHOLD]:
            value = store[j, inputs + 2]
            known = store[best, inputs + 2] if best >= 0 else -np.inf
            if value > known or (value == known and distance < nearness):
                best = j
                nearness = distance
    return best


@inlined
def _learn(store: Any, count: int, pending: int, goal: float, parameters: Any) -> None:
    """Move the Q of the pair just tried, and of those similar to it, toward what came of it."""
    inputs = int(parameters[_INPUTS])
    for j in range(count):
        turn = abs(store[j, inputs] - store[pending, inputs]) / math.pi
        unlike = min(turn, 2.0 - turn) + abs(store[j, inputs + 1] - store[pending, inputs + 1])
        if unlike <= parameters[_SIMILAR] and (
            _apart(store, j, store[pending], inputs, parameters[_THRESHOLD]) <= parameters[_THRESHOLD]
        ):
            store[j, inputs + 2] += parameters[_LEARNING_RATE] * (goal - store[j, inputs + 2])


@inlined
def _reward(percept: Any, i: int, notes: Any, parameters: Any) -> Any:
    """Return what the change of the targets in sight is worth, and note those that are in sight now."""
    targets = percept.targets
    first = targets.start[i]
    now = min(targets.start[i + 1] - first, MOST_SEEN)
    before = notes[0, _SEEN]
    kept = 0
    at = 0
    for t in range(now):
        # Both lists ascend.
        while at < before and notes[1 + at, 0] < targets.identity[first + t]:
            at += 1
        kept += at < before and notes[1 + at, 0] == targets.identity[first + t]
    for t in range(now):
        notes[1 + t, 0] = targets.identity[first + t]
    notes[0, _SEEN] = now
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
        notes = arrays.state.ints[i]
        situation = percept.situation[i]
        if not is_situation(situation, inputs):
            refuse(i, percept, action)
            continue
        count = min(notes[0, _STORED], capacity)
        pending = notes[0, _PENDING]
        reward = _reward(percept, i, notes, parameters)
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
        slot = notes[0, _STORED] % capacity
        for c in range(inputs):
            store[slot, c] = situation[c]
        store[slot, inputs] = rotation
        store[slot, inputs + 1] = share
        store[slot, inputs + 2] = 0.0
        notes[0, _STORED] += 1
        notes[0, _PENDING] = slot


@dataclass(frozen=True, eq=False, repr=False)
class SheppardLazyQ(CompiledPolicy):
    """Do the best that was done in similar situations, now and then something else, and store what it was worth.

    Every robot has a store of its own. When the store is full, a new pair takes the place of the oldest.

    Parameters
    ----------
    inputs : int, default 32
        How many components a situation has: 16 under `NoAwareness`, 16 + δ under `RingAwareness`.
    reward : callable
        What is wanted, of the targets that the robot itself gained and lost; see `teamsight.policies.rewards`.
    threshold : float
        Situations at most so far apart by eq. 1 are similar.
    similar_action : float
        Pairs of similar situations are similar when their rotations, as shares of half a turn, and their distances, as
        shares of the speed, differ in all by at most this.
    explore : float
        The probability of a random action whatever is known; without a similar situation it is certain.
    learning_rate, discount : float
        Q ← Q + α [r + γ max Q′ − Q], 0..1 both; Q′ of a situation like which none is stored is 0.
    capacity : int
        How many pairs a robot stores.
    memory : LazyMemory, optional
        An exploration with which every robot's store begins, at the utilities that `LazyQ` would give its pairs.

    Attributes
    ----------
    rewards : ndarray, shape (81,), float64
        By the number of targets gained, then lost.
    values : ndarray, shape (pairs,), float64, or None
        The utilities at which the pairs of `memory` begin.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, the memory does not fit `inputs` or `capacity`, or the reward cannot be
        told from what a robot itself gained and lost.

    Notes
    -----
    *Source:* §8.1 after J. W. Sheppard and S. L. Salzberg (1997): a fixed distance, a random action where nothing is
    found and otherwise with probability 0.3, Q stored with new pairs and updated among similar ones. *Departs:* what
    is similar, α and the start are not given there. At most 8 targets gained or lost at once are told apart, and of
    more than 64 in sight the first 64 are followed.
    """

    inputs: int = 32
    reward: Reward = own_reward
    threshold: float = 1.0
    similar_action: float = 0.25
    explore: float = 0.3
    learning_rate: float = 0.5
    discount: float = 0.7
    capacity: int = 600
    memory: LazyMemory | None = None
    rewards: Floats = field(init=False)
    values: Floats | None = field(init=False, default=None)

    kernel = _learn_and_act
    draws = 3

    def __post_init__(self) -> None:
        if isinstance(self.inputs, LazyMemory):
            raise TypeError(f"inputs={self.inputs!r}: is a memory; give it as memory=, SheppardLazyQ(memory=...)")
        checks.count("inputs", self.inputs)
        for name in ("explore", "learning_rate", "discount"):
            checks.number(name, getattr(self, name), least=0, most=1)
        for name in ("threshold", "similar_action"):
            checks.number(name, getattr(self, name), least=0)
        checks.count("capacity", self.capacity)
        if self.memory is not None:
            components(self.memory, self.inputs)
            if len(self.memory) > self.capacity:
                raise ValueError(
                    f"capacity={self.capacity}: the memory has {len(self.memory)} pairs; give more room, or a "
                    "memory.sample() of fewer"
                )
            # Once, and not for every world that a robot begins in.
            k = min(LazyLearner.k, len(self.memory))
            values = utility(self.memory, self.reward, inputs=self.inputs, k=k, discount=self.discount)
            object.__setattr__(self, "values", values)
        object.__setattr__(self, "rewards", tabulate(self.reward, MOST_CHANGE).ravel())

    def __repr__(self) -> str:
        names = ("inputs", "threshold", "similar_action", "explore", "learning_rate", "discount", "capacity", "memory")
        told = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"SheppardLazyQ({name_of(self.reward)}, {told}, rewards={digest_of(self.rewards)})"

    @property
    def degree(self) -> str | None:  # type: ignore[override]
        """The name of the degree of awareness whose situations its memory holds; None without a memory."""
        return None if self.memory is None else degree_of(self.memory, self.inputs)

    @property
    def parameters(self) -> Floats:
        constants = [self.inputs, self.threshold, self.similar_action, self.explore, self.learning_rate, self.discount]
        return np.concatenate([constants, self.rewards])

    def start(self, size: int) -> PolicyState:
        floats = np.zeros((size, self.capacity, self.inputs + 3))
        ints = np.zeros((size, 1 + MOST_SEEN, 3), np.int64)
        ints[:, 0, _PENDING] = -1
        if self.memory is not None:
            pairs = len(self.memory)
            floats[:, :pairs, : self.inputs] = self.memory.situation[:, : self.inputs]
            floats[:, :pairs, self.inputs : self.inputs + 2] = self.memory.action
            floats[:, :pairs, self.inputs + 2] = self.values
            ints[:, 0, _STORED] = pairs
        return PolicyState(floats, ints)

    def remedy(self, degree: str, width: int) -> str:
        return "" if self.memory is None else remedy(self.memory, self.inputs, degree, width)

    def check_percept(self, percept: Percept) -> None:
        check_situation(type(self).__name__, percept, self.inputs)
