"""Descent: semi-gradient Q-learning over the pairs of a memory, in one compiled call."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, array_at
from teamsight.policies.eager.features import correct, weigh
from teamsight.policies.interface import Floats, Integers

_LESSON = np.dtype(
    [(name, np.int64) for name in ("situation", "next_situation", "reward", "action", "order", "weights")]
    + [(name, np.int64) for name in ("pairs", "inputs", "features", "actions")]
    + [(name, np.float64) for name in ("discount", "learning_rate", "last_learning_rate")]
)


def _descend(address: int) -> int:
    """Go through all pairs once, in the order given; the learning rate falls evenly."""
    lesson = array_at(address, 1, _LESSON)[0]
    pairs, inputs, features, actions = lesson.pairs, lesson.inputs, lesson.features, lesson.actions
    situation = array_at(lesson.situation, (pairs, inputs), np.float32)
    following = array_at(lesson.next_situation, (pairs, inputs), np.float32)
    reward = array_at(lesson.reward, pairs, np.float64)
    action = array_at(lesson.action, pairs, np.int64)
    order = array_at(lesson.order, pairs, np.int64)
    weights = array_at(lesson.weights, (actions, 1 + inputs * features), np.float64)
    for step in range(pairs):
        pair = order[step]
        best = weigh(weights, 0, following[pair], inputs, features)
        for number in range(1, actions):
            best = max(best, weigh(weights, number, following[pair], inputs, features))
        row = action[pair]
        error = reward[pair] + lesson.discount * best - weigh(weights, row, situation[pair], inputs, features)
        learning_rate = lesson.learning_rate + (lesson.last_learning_rate - lesson.learning_rate) * step / pairs
        correct(weights, row, situation[pair], inputs, features, learning_rate * error)
    return 0


_DESCEND = Entry(_descend)


def descend(
    before: tuple[npt.NDArray[np.float32], Integers],
    after: tuple[npt.NDArray[np.float32], Floats],
    weights: Floats,
    *,
    features: int,
    discount: float,
    learning_rate: float,
    sweeps: int,
    seed: int,
) -> None:
    """Learn weights from pairs.

    Parameters
    ----------
    before : tuple of two ndarray
        The situations, shape (pairs, inputs), float32, and the numbers of the actions taken, shape (pairs,), int64.
    after : tuple of two ndarray
        The situations that followed, and the rewards, shape (pairs,), float64.
    weights : ndarray, shape (actions, 1 + inputs × features), float64
        Changed in place.
    features : int
        See `teamsight.policies.eager.features`.
    discount : float
        Discount factor γ, in [0, 1].
    learning_rate : float
        By which share of its error a Q is corrected at first; it falls evenly to 0.
    sweeps : int
        How often the pairs are gone through, each time in another order.
    seed : int
        Of the orders.
    """
    rng = np.random.default_rng(seed)
    arrays: dict[str, npt.NDArray[Any]] = {
        "situation": np.ascontiguousarray(before[0], np.float32),
        "next_situation": np.ascontiguousarray(after[0], np.float32),
        "reward": np.ascontiguousarray(after[1], float),
        "action": np.ascontiguousarray(before[1], np.int64),
        "weights": weights,
    }
    lesson = np.zeros(1, _LESSON)
    for name, array in arrays.items():
        lesson[0][name] = array.ctypes.data
    lesson[0]["pairs"], lesson[0]["inputs"] = arrays["situation"].shape
    lesson[0]["features"], lesson[0]["actions"], lesson[0]["discount"] = features, len(weights), discount
    for sweep in range(sweeps):
        order = rng.permutation(len(arrays["action"])).astype(np.int64)
        lesson[0]["order"] = order.ctypes.data
        lesson[0]["learning_rate"] = learning_rate * (1 - sweep / sweeps)
        lesson[0]["last_learning_rate"] = learning_rate * (1 - (sweep + 1) / sweeps)
        _DESCEND(lesson.ctypes.data)
