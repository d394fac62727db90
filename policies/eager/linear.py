"""Q-learning with a function approximator: for each action a weighted sum of what the situation shows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.actions import grid_distance, grid_rotation
from teamsight.policies.eager.descent import descend
from teamsight.policies.eager.features import weigh
from teamsight.policies.eager.learner import EagerLearner
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.learner import act, is_situation, refuse

_INPUTS, _FEATURES, _TURNS, _PACES = range(4)


@inlined
def _weigh_all(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    weights = arrays.table
    parameters = arrays.parameters
    inputs = int(parameters[_INPUTS])
    features = int(parameters[_FEATURES])
    turns = int(parameters[_TURNS])
    paces = int(parameters[_PACES])
    for i in range(percept.heading.shape[0]):
        if not is_situation(percept.situation[i], inputs):
            refuse(i, percept, action)
            continue
        best = 0
        most = weigh(weights, 0, percept.situation[i], inputs, features)
        for number in range(1, turns * paces):
            value = weigh(weights, number, percept.situation[i], inputs, features)
            if value > most:
                best = number
                most = value
        act(grid_rotation(best, turns, paces), grid_distance(best, paces), i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class LinearQ(EagerLearner):
    """Q-learning with linear function approximation: it grows with the inputs, not with p to their power.

    Each component of a situation has a few hat features (`features`); each action has a weight for each of them and a
    constant. The pairs are gone through `sweeps` times in random orders; each time the weights are
    moved along the gradient of Q(s, a) towards r + γ max Q(s′, ·), at a learning rate that falls to 0.

    Parameters
    ----------
    memory, reward, inputs, discount, actions
        As for `EagerLearner`.
    features : int, default 3
        How many ranges of each reading are told apart.
    learning_rate : float, default 0.05
        By which share of its error a Q is corrected at first; above 0, at most 1.
    sweeps : int, default 40
        How often the pairs are gone through.
    seed : int, default 0
        Of their orders.

    Attributes
    ----------
    weights : ndarray, shape (actions, 1 + inputs × features), float32
        What was learned.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, or learning diverges.

    Notes
    -----
    *Source:* §3, where the search space is what an eager learner has to visit; the paper names no approximator. Steps
    are normalised by the features' length, as in the normalised least-mean-squares rule, so that `learning_rate` means
    the same under every degree of awareness.
    """

    features: int = 3
    learning_rate: float = 0.05
    sweeps: int = 40
    seed: int = 0
    weights: npt.NDArray[np.float32] = field(init=False)

    kernel = _weigh_all

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.count("features", self.features)
        checks.count("sweeps", self.sweeps)
        checks.count("seed", self.seed, least=0)
        checks.number("learning_rate", self.learning_rate, above=0, most=1)
        object.__setattr__(self, "weights", self._learn())

    def _learn(self) -> npt.NDArray[np.float32]:
        memory, width = self.memory, self.width
        weights = np.zeros((len(self.actions), 1 + width * self.features))
        descend(
            (memory.situation[:, :width], self.actions.index(memory.action)),
            (memory.next_situation[:, :width], self.rewards()),
            weights,
            features=self.features, discount=self.discount, learning_rate=self.learning_rate, sweeps=self.sweeps,
            seed=self.seed,
        )  # fmt: skip
        # Beyond what float32 holds counts too: the weights would be infinite where robots read them.
        if not (np.abs(weights) < np.finfo(np.float32).max).all():
            given = f"learning_rate={self.learning_rate}, discount={self.discount}"
            raise ValueError(f"{given}: learning diverges; lower one of them")
        return weights.astype(np.float32)

    @property
    def parameters(self) -> Floats:
        return np.array([self.width, self.features, self.actions.turns, self.actions.paces], float)

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.weights
