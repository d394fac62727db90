"""Tabular Q-learning: one number for each state and action."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.actions import ActionGrid, grid_distance, grid_rotation
from teamsight.policies.eager.learner import EagerLearner
from teamsight.policies.eager.state_grid import StateGrid, state_of
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.learner import act, is_situation, refuse
from teamsight.policies.memory import LazyMemory

_LEVELS, _DIMENSIONS, _TURNS, _PACES, _DIMENSION = range(5)
_FULL_TURN = 6.283185307179586


@inlined
def _look_up(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    table = arrays.table
    parameters = arrays.parameters
    levels = int(parameters[_LEVELS])
    dimensions = int(parameters[_DIMENSIONS])
    turns = int(parameters[_TURNS])
    paces = int(parameters[_PACES])
    for i in range(percept.heading.shape[0]):
        if not is_situation(percept.situation[i], percept.situation.shape[1]):
            refuse(i, percept, action)
            continue
        state = state_of(percept.situation[i], levels, dimensions, parameters, _DIMENSION)
        best = -1
        for number in range(turns * paces):
            value = table[state, number]
            if value > -np.inf and (best < 0 or value > table[state, best]):
                best = number
        if best < 0:
            act((noise[0, i] - 0.5) * _FULL_TURN, noise[1, i], i, percept, action)
        else:
            act(grid_rotation(best, turns, paces), grid_distance(best, paces), i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class TabularQ(EagerLearner):
    """Q-learning with a table: do what is worth most in this state; in a state that was never met, anything.

    The pairs are gone through `sweeps` times. Each time every Q is moved to the mean, over the pairs of its state and
    action, of what followed: Q(s, a) ← mean of r + γ max Q(s′, ·). Actions that were never tried in a state do not
    count there, and a state that was never met is worth 0.

    Parameters
    ----------
    memory, reward, inputs, discount, actions
        As for `EagerLearner`.
    sectors, levels : int
        How a situation becomes a state; see `StateGrid`.
    sweeps : int, default 50
        How often.

    Attributes
    ----------
    states : StateGrid
        The states.
    table : ndarray, shape (states, actions), float32
        The Q of each; −∞ for what was never tried.
    met : float
        The share of the states that the pairs set out from.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, or there are more states than fit.

    Notes
    -----
    *Source:* §3, the search space of p^d situations that an eager learner has to visit. *Departs:* all pairs of a state
    and action at once, instead of one after the other at a learning rate; so the order of the pairs does not matter.
    """

    sectors: int = 4
    levels: int = 3
    sweeps: int = 50
    states: StateGrid = field(init=False)
    values: npt.NDArray[np.float32] = field(init=False)

    kernel = _look_up
    draws = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.count("sweeps", self.sweeps)
        added = self.width - self.memory.own
        states = StateGrid(self.memory.own, added, self.degree, self.sectors, self.levels)
        object.__setattr__(self, "states", states)
        table = learn_table(self.memory, self.rewards(), states, self.actions, self.discount, self.sweeps)
        object.__setattr__(self, "values", table)

    @property
    def met(self) -> float:
        """The share of the states that the pairs set out from."""
        return float((self.values > -np.inf).any(axis=1).mean())

    @property
    def parameters(self) -> Floats:
        states, actions = self.states, self.actions
        head = [states.levels, states.dimensions, actions.turns, actions.paces]
        return np.concatenate([head, states.dimension]).astype(float)

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.values


def learn_table(
    memory: LazyMemory, rewards: Floats, states: StateGrid, actions: ActionGrid, discount: float, sweeps: int
) -> npt.NDArray[np.float32]:
    """Return the Q of every state and action, −∞ for what was never tried; see `TabularQ`.

    Raises
    ------
    ValueError
        If one is beyond float32.
    """
    width = states.own + states.added
    before = states.index(memory.situation[:, :width]) * len(actions) + actions.index(memory.action)
    after = states.index(memory.next_situation[:, :width])
    # Only what was met is gone through, however large the table is.
    tried, cell = np.unique(before, return_inverse=True)
    met, first = np.unique(tried // len(actions), return_index=True)
    place = np.minimum(np.searchsorted(met, after), len(met) - 1)
    known = met[place] == after
    count = np.bincount(cell)
    values = np.zeros(len(tried))
    for _ in range(sweeps):
        best = np.maximum.reduceat(values, first)
        worth = rewards + discount * np.where(known, best[place], 0.0)
        values = np.bincount(cell, worth) / count
    # −∞ is what was never tried, so that nothing else may be.
    if not (np.abs(values) < np.finfo(np.float32).max).all():
        raise ValueError(f"discount={discount}: what is learned is beyond float32; give smaller rewards")
    table = np.full(len(states) * len(actions), -np.inf, np.float32)
    table[tried] = values
    return table.reshape(len(states), len(actions))
