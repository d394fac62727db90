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


def descend(first: Sweep, sweeps: int, seed: int) -> None:
    """Visit all transitions in `sweeps` random orders, while the learning rate falls linearly from the first to 0.

    Parameters
    ----------
    first : Sweep
        The first sweep; its order and its last learning rate are replaced, and its weights changed in place.
    sweeps : int
        Number of sweeps; each has another random order.
    seed : int
        Seed of the orders.
    """
    rng = np.random.default_rng(seed)
    for sweep in range(sweeps):
        order = rng.permutation(len(first.action)).astype(np.int64)
        rate, last = (first.learning_rate * (1 - part / sweeps) for part in (sweep, sweep + 1))
        _DESCEND(SWEEP.pack(first._replace(order=order, learning_rate=rate, last_learning_rate=last)))
