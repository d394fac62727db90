"""Q-learning with linear function approximation: for each action a weighted sum of features of the situation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.component import Allowed, Count, Index
from teamsight.core.kernel import Entry, Record, inlined
from teamsight.policies.actions import act
from teamsight.policies.interface import Floats, Integers
from teamsight.policies.learner import EagerLearner, is_situation, refuse
from teamsight.policies.rewards import rewards_of


@inlined
def hat_of(reading: float, features: int) -> tuple[int, float]:
    """Return the first of the two hat features that a reading below 1 activates, and the activation of the second.

    The hats have equidistant centres from 0 to 1; a single one covers everything. The two activations add up to 1, so
    that learning at one distance generalises to nearby ones. Negative readings, which only user-defined degrees of
    awareness give, count as 0.
    """
    if features == 1:
        return 0, 0.0
    where = max(reading, 0.0) * (features - 1)
    first = min(int(where), features - 2)
    return first, where - first


@inlined
def weigh(weights: Any, row: int, situation: Any, inputs: int, features: int) -> float:
    """Return the value of an action: the sum of its weights over the active features of a situation.

    `weights` has one row for each action: a constant, then the weights of each component's features. A reading of 1
    (nothing sensed) activates no feature.
    """
    total = float(weights[row, 0])
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            first, share = hat_of(float(reading), features)
            at = 1 + component * features + first
            total += (1.0 - share) * weights[row, at]
            if share > 0.0:
                total += share * weights[row, at + 1]
    return total


@inlined
def correct(weights: Any, row: int, situation: Any, inputs: int, features: int, error: float) -> None:
    """Change an action's weights so that its value in a situation grows by `error`."""
    square = 1.0
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            _, share = hat_of(float(reading), features)
            square += (1.0 - share) * (1.0 - share) + share * share
    part = error / square
    weights[row, 0] += part
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            first, share = hat_of(float(reading), features)
            at = 1 + component * features + first
            weights[row, at] += (1.0 - share) * part
            if share > 0.0:
                weights[row, at + 1] += share * part


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
        See `teamsight.policies.eager.linear`.
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


# The parameters end with rotation and distance of each action.
_INPUTS, _FEATURES, _ACTIONS = range(3)


@inlined
def _highest_sum(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    weights = arrays.table
    parameters = arrays.parameters
    inputs = int(parameters[_INPUTS])
    features = int(parameters[_FEATURES])
    for i in range(percept.heading.shape[0]):
        if not is_situation(percept.situation[i], inputs):
            refuse(i, percept, action)
            continue
        best = 0
        most = weigh(weights, 0, percept.situation[i], inputs, features)
        for number in range(1, weights.shape[0]):
            value = weigh(weights, number, percept.situation[i], inputs, features)
            if value > most:
                best = number
                most = value
        act(parameters[_ACTIONS + 2 * best], parameters[_ACTIONS + 2 * best + 1], i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class LinearQ(EagerLearner):
    """Q-learning with linear function approximation: its size grows linearly with the inputs.

    Each component of a situation has a few hat features (`features`); each action has a weight for each of them and a
    constant. The transitions are visited `sweeps` times in random orders. Each visit moves the weights along the
    gradient of Q(s, a) towards r + γ max Q(s′, ·), at a learning rate that falls linearly to 0.

    Parameters
    ----------
    memory, reward, inputs, discount, actions
        As for `EagerLearner`.
    features : int, default 3
        Hat features per component.
    learning_rate : float, default 0.05
        Learning rate α of the first step, in (0, 1].
    sweeps : int, default 40
        Number of visits to each transition.
    seed : int, default 0
        Seed of the random orders.

    Attributes
    ----------
    weights : ndarray, shape (actions, 1 + inputs × features), float32
        The learned weights.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, or learning diverges.

    Notes
    -----
    *Source:* §3, where an eager learner has to visit the whole search space; the paper names no approximator. Steps are
    normalised by the length of the feature vector, as in the normalised least-mean-squares rule, so that
    `learning_rate` means the same under every degree of awareness.
    """

    features: Count = 3
    learning_rate: Annotated[float, Allowed(above=0, most=1)] = 0.05
    sweeps: Count = 40
    seed: Index = 0
    weights: npt.NDArray[np.float32] = field(init=False)

    title = "a linear approximator"
    kernel = _highest_sum

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "weights", self._learn())

    def _learn(self) -> npt.NDArray[np.float32]:
        memory, width = self.memory, self.inputs
        weights = np.zeros((len(self.actions), 1 + width * self.features))
        first = Sweep(
            np.ascontiguousarray(memory.situation[:, :width]),
            np.ascontiguousarray(memory.next_situation[:, :width]),
            rewards_of(memory, self.reward),
            self.actions.index(memory.action),
            np.arange(len(memory)),
            weights, self.features, self.discount, self.learning_rate, 0.0,
        )  # fmt: skip
        descend(first, self.sweeps, self.seed)
        # They are used as float32, where larger numbers would be infinite.
        if not (np.abs(weights) < np.finfo(np.float32).max).all():
            given = f"learning_rate={self.learning_rate}, discount={self.discount}"
            raise ValueError(f"{given}: learning diverges; lower one of them")
        return weights.astype(np.float32)

    @property
    def parameters(self) -> Floats:
        return np.concatenate([[self.inputs, self.features], self.actions.actions.ravel()])

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.weights
