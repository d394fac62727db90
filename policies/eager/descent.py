"""Semi-gradient Q-learning on the transitions of a memory, in one compiled call."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, array_at
from teamsight.policies.eager.features import correct, weigh
from teamsight.policies.interface import Floats, Integers

_TASK = np.dtype(
    [(name, np.int64) for name in ("situation", "next_situation", "reward", "action", "order", "weights")]
    + [(name, np.int64) for name in ("transitions", "inputs", "features", "actions")]
    + [(name, np.float64) for name in ("discount", "learning_rate", "last_learning_rate")]
)


def _descend(address: int) -> int:
    """Visit all transitions once in the given order, while the learning rate falls linearly."""
    task = array_at(address, 1, _TASK)[0]
    transitions, inputs, features, actions = task.transitions, task.inputs, task.features, task.actions
    situation = array_at(task.situation, (transitions, inputs), np.float32)
    following = array_at(task.next_situation, (transitions, inputs), np.float32)
    reward = array_at(task.reward, transitions, np.float64)
    action = array_at(task.action, transitions, np.int64)
    order = array_at(task.order, transitions, np.int64)
    weights = array_at(task.weights, (actions, 1 + inputs * features), np.float64)
    for step in range(transitions):
        transition = order[step]
        best = weigh(weights, 0, following[transition], inputs, features)
        for number in range(1, actions):
            best = max(best, weigh(weights, number, following[transition], inputs, features))
        row = action[transition]
        error = reward[transition] + task.discount * best - weigh(weights, row, situation[transition], inputs, features)
        learning_rate = task.learning_rate + (task.last_learning_rate - task.learning_rate) * step / transitions
        correct(weights, row, situation[transition], inputs, features, learning_rate * error)
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
    """Learn the weights of a linear function from transitions.

    Parameters
    ----------
    before : tuple of two ndarray
        Situations, shape (transitions, inputs), float32, and the index of each action, shape (transitions,), int64.
    after : tuple of two ndarray
        Next situations, and rewards, shape (transitions,), float64.
    weights : ndarray, shape (actions, 1 + inputs × features), float64
        Changed in place.
    features : int
        Hat features per component; see `teamsight.policies.eager.features`.
    discount : float
        Discount factor γ, in [0, 1].
    learning_rate : float
        Learning rate α of the first step; it falls linearly to 0.
    sweeps : int
        How often each transition is visited, each time in another random order.
    seed : int
        Seed of the orders.
    """
    rng = np.random.default_rng(seed)
    arrays: dict[str, npt.NDArray[Any]] = {
        "situation": np.ascontiguousarray(before[0], np.float32),
        "next_situation": np.ascontiguousarray(after[0], np.float32),
        "reward": np.ascontiguousarray(after[1], float),
        "action": np.ascontiguousarray(before[1], np.int64),
        "weights": weights,
    }
    task = np.zeros(1, _TASK)
    for name, array in arrays.items():
        task[0][name] = array.ctypes.data
    task[0]["transitions"], task[0]["inputs"] = arrays["situation"].shape
    task[0]["features"], task[0]["actions"], task[0]["discount"] = features, len(weights), discount
    for sweep in range(sweeps):
        order = rng.permutation(len(arrays["action"])).astype(np.int64)
        task[0]["order"] = order.ctypes.data
        task[0]["learning_rate"] = learning_rate * (1 - sweep / sweeps)
        task[0]["last_learning_rate"] = learning_rate * (1 - (sweep + 1) / sweeps)
        _DESCEND(task.ctypes.data)
