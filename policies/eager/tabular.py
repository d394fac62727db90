"""Tabular Q-learning: one number for each state and action."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.actions import ActionGrid, act
from teamsight.policies.eager.learner import EagerLearner
from teamsight.policies.eager.state_grid import StateGrid, state_of
from teamsight.policies.interface import Floats
from teamsight.policies.learner import is_situation, refuse
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import rewards_of

# Rotation and distance of each action follow, then the sensor that each component belongs to.
_LEVELS, _DIMENSIONS, _ACTIONS = range(3)
_FULL_TURN = 6.283185307179586


@inlined
def _look_up(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    table = arrays.table
    parameters = arrays.parameters
    levels = int(parameters[_LEVELS])
    dimensions = int(parameters[_DIMENSIONS])
    for i in range(percept.heading.shape[0]):
        if not is_situation(percept.situation[i], percept.situation.shape[1]):
            refuse(i, percept, action)
            continue
        state = state_of(percept.situation[i], levels, dimensions, parameters, _ACTIONS + 2 * table.shape[1])
        best = -1
        for number in range(table.shape[1]):
            value = table[state, number]
            if value > -np.inf and (best < 0 or value > table[state, best]):
                best = number
        if best < 0:
            act((noise[0, i] - 0.5) * _FULL_TURN, noise[1, i], i, percept, action)
        else:
            act(parameters[_ACTIONS + 2 * best], parameters[_ACTIONS + 2 * best + 1], i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class TabularQ(EagerLearner):
    """Q-learning with a table: do the action of the highest value; a random one in a state that was never visited.

    In each of `sweeps` sweeps every Q becomes the mean, over all transitions of its state and action, of the reward and
    the discounted best value that follows: Q(s, a) ← mean of r + γ max Q(s′, ·). Actions that were never tried in a
    state do not count there, and a state that was never visited has the value 0.

    Parameters
    ----------
    memory, reward, inputs, discount, actions
        As for `EagerLearner`.
    sectors, levels : int
        The discretisation of situations; see `StateGrid`.
    sweeps : int, default 50
        Number of sweeps.

    Attributes
    ----------
    states : StateGrid
        The states.
    values : ndarray, shape (states, actions), float32
        The action values; −∞ for actions that were never tried.
    met : float
        Share of the states that were visited.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, or there are more states than fit.

    Notes
    -----
    *Source:* §3, the search space of p^d situations that an eager learner has to visit. *Departs:* all transitions of a
    state and action are used at once, instead of one by one at a learning rate, so that their order does not matter.
    """

    sectors: int = 4
    levels: int = 3
    sweeps: int = 50
    states: StateGrid = field(init=False)
    values: npt.NDArray[np.float32] = field(init=False)

    title = "a table of states"
    kernel = _look_up
    draws = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.count("sweeps", self.sweeps)
        added = self.inputs - self.memory.own
        rings = self.memory.settings.get("rings", ()) if added else ()
        states = StateGrid(self.memory.own, added, rings, self.sectors, self.levels)
        object.__setattr__(self, "states", states)
        rewards = rewards_of(self.memory, self.reward)
        table = learn_table(self.memory, rewards, states, self.actions, self.discount, self.sweeps)
        object.__setattr__(self, "values", table)

    @property
    def met(self) -> float:
        """Share of the states that were visited."""
        return float((self.values > -np.inf).any(axis=1).mean())

    @property
    def parameters(self) -> Floats:
        states, actions = self.states, self.actions.actions.ravel()
        return np.concatenate([[states.levels, states.dimensions], actions, states.dimension])

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.values


def learn_table(
    memory: LazyMemory, rewards: Floats, states: StateGrid, actions: ActionGrid, discount: float, sweeps: int
) -> npt.NDArray[np.float32]:
    """Return the value of each state and action, −∞ for actions that were never tried; see `TabularQ`.

    Raises
    ------
    ValueError
        If a value is beyond the range of float32.
    """
    width = states.own + states.added
    before = states.index(memory.situation[:, :width]) * len(actions) + actions.index(memory.action)
    after = states.index(memory.next_situation[:, :width])
    # Only cells with a transition are computed, however large the table is.
    tried, cell = np.unique(before, return_inverse=True)
    met, first = np.unique(tried // len(actions), return_index=True)
    place = np.minimum(np.searchsorted(met, after), len(met) - 1)
    known = met[place] == after
    count = np.bincount(cell)
    values = np.zeros(len(tried))
    for _ in range(sweeps):
        best = np.maximum.reduceat(values, first)
        goal = rewards + discount * np.where(known, best[place], 0.0)
        values = np.bincount(cell, goal) / count
    # −∞ marks actions that were never tried.
    if not (np.abs(values) < np.finfo(np.float32).max).all():
        raise ValueError(f"discount={discount}: the values exceed float32; give smaller rewards")
    table = np.full(len(states) * len(actions), -np.inf, np.float32)
    table[tried] = values
    return table.reshape(len(states), len(actions))
