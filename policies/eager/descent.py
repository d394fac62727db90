"""Semi-gradient Q-learning on the transitions of a memory, in one compiled call."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record
from teamsight.policies.eager.features import correct, weigh
from teamsight.policies.interface import Floats, Integers


class Sweep(NamedTuple):
    """The record of a sweep over all transitions.

    Attributes
    ----------
    situation, next_situation, reward, action
        The transitions, k of them; actions by number.
    order : ndarray, shape (k,), int64
        The order of the visits.
    weights : ndarray, shape (actions, terms), float64
        Changed in place.
    features : int
        See `teamsight.policies.eager.features`.
    discount, learning_rate, last_learning_rate : float
        The learning rate falls linearly from the first to the last.
    """

    situation: Annotated[npt.NDArray[np.float32], "k", "inputs"]
    next_situation: Annotated[npt.NDArray[np.float32], "k", "inputs"]
    reward: Annotated[Floats, "k"]
    action: Annotated[Integers, "k"]
    order: Annotated[Integers, "k"]
    weights: Annotated[Floats, "actions", "terms"]
    features: int
    discount: float
    learning_rate: float
    last_learning_rate: float


SWEEP = Record(Sweep)
sweep_at = SWEEP.at


def _descend(address: int) -> int:
    """Visit all transitions once in the given order, while the learning rate falls linearly."""
    sweep = sweep_at(address)
    situation, following, weights, features = sweep.situation, sweep.next_situation, sweep.weights, sweep.features
    transitions, inputs = situation.shape
    for step in range(transitions):
        transition = sweep.order[step]
        best = weigh(weights, 0, following[transition], inputs, features)
        for number in range(1, weights.shape[0]):
            best = max(best, weigh(weights, number, following[transition], inputs, features))
        row = sweep.action[transition]
        value = weigh(weights, row, situation[transition], inputs, features)
        error = sweep.reward[transition] + sweep.discount * best - value
        learning_rate = sweep.learning_rate + (sweep.last_learning_rate - sweep.learning_rate) * step / transitions
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
        Number of visits to each transition; each sweep has another random order.
    seed : int
        Seed of the orders.
    """
    rng = np.random.default_rng(seed)
    situation, action = np.ascontiguousarray(before[0], np.float32), np.ascontiguousarray(before[1], np.int64)
    following, reward = np.ascontiguousarray(after[0], np.float32), np.ascontiguousarray(after[1], float)
    for sweep in range(sweeps):
        order = rng.permutation(len(action)).astype(np.int64)
        first, last = (learning_rate * (1 - part / sweeps) for part in (sweep, sweep + 1))
        _DESCEND(SWEEP.pack(
            Sweep(situation, following, reward, action, order, weights, features, discount, first, last)
        ))  # fmt: skip
