"""Q-learning with linear function approximation: for each action a weighted sum of features of the situation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.actions import act
from teamsight.policies.eager.descent import Sweep, descend
from teamsight.policies.eager.features import weigh
from teamsight.policies.eager.learner import EagerLearner
from teamsight.policies.interface import Floats
from teamsight.policies.learner import is_situation, refuse
from teamsight.policies.rewards import rewards_of

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

    features: int = 3
    learning_rate: float = 0.05
    sweeps: int = 40
    seed: int = 0
    weights: npt.NDArray[np.float32] = field(init=False)

    title = "a linear approximator"
    kernel = _highest_sum

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.count("features", self.features)
        checks.count("sweeps", self.sweeps)
        checks.count("seed", self.seed, least=0)
        checks.number("learning_rate", self.learning_rate, above=0, most=1)
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
