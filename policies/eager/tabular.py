"""Tabular Q-learning: one number for each state and action."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Count
from teamsight.core.kernel import inlined
from teamsight.policies.actions import ActionGrid, act
from teamsight.policies.interface import Floats
from teamsight.policies.learner import EagerLearner, is_situation, refuse
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import rewards_of

#: Largest number of states of a table: with 16 actions, 64 MiB.
MOST_STATES = 1_000_000
#: What the number of levels may be.
Levels = Annotated[int, Allowed(least=2, cure="one for a sensed body, one for none")]


class TooManyStatesError(ValueError):
    """Raised when a table would need more than `MOST_STATES` states."""


@dataclass(frozen=True)
class StateGrid(Component):
    """A discretisation of situations: neighbouring sectors are merged, and readings become levels.

    Parameters
    ----------
    own : int
        Number of components that show targets.
    added : int
        Number of components that the degree of awareness adds.
    rings : sequence of int, optional
        Numbers of sectors of the rings with which the added components begin; see ``Awareness.rings``. Components that
        belong to no ring are kept as they are.
    sectors : int, default 4
        Sectors per ring after merging. A merged sector has the smallest reading of its parts.
    levels : int, default 3
        p, the levels of one sensor: the last is "nothing sensed", the others divide the range.

    Raises
    ------
    TypeError, ValueError
        If a number is too small, or sectors cannot be merged evenly.
    TooManyStatesError
        If there are more than `MOST_STATES` states.

    Notes
    -----
    *Source:* §3, search space size = p^d; here d is `dimensions`.
    """

    own: int
    added: int
    rings: Sequence[int] = ()
    sectors: Count = 4
    levels: Levels = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        rings = self.rings
        if not isinstance(rings, Sequence) or sum(checks.count("rings", ring) for ring in rings) > self.added:
            raise ValueError(f"rings={checks.shown(rings)}: must be numbers of sectors, in all at most {self.added}")
        object.__setattr__(self, "rings", tuple(rings))
        for ring in (self.own, *rings):
            if ring % self.sectors:
                even = math.gcd(self.own, *rings)
                whose = "targets" if ring == self.own else "a ring that the degree of awareness adds"
                cure = f"give {even} or a divisor of it" if even > 1 else "give 1"
                raise ValueError(f"sectors={self.sectors}: must divide the {ring} sectors of {whose} evenly; {cure}")
        if self.levels**self.dimensions > MOST_STATES:
            raise TooManyStatesError(
                f"a table of {self.levels}^{self.dimensions} states ({self.levels} readings of {self.dimensions} "
                f"sensors): must have at most {MOST_STATES:,}; merge into fewer sectors or levels, use a degree that "
                "adds fewer inputs, or a learner without a table: LinearQ or LazyQ"
            )

    @property
    def dimensions(self) -> int:
        """d, the number of sensors."""
        return int(self.dimension.max()) + 1

    @property
    def dimension(self) -> npt.NDArray[np.int64]:
        """The sensor that each component of a situation belongs to, shape (own + added,)."""
        rings = (self.own, *self.rings)
        found = [
            # The first merged sector is centred on straight ahead.
            (np.arange(ring) + ring // self.sectors // 2) % ring * self.sectors // ring + number * self.sectors
            for number, ring in enumerate(rings)
        ]
        rest = self.own + self.added - sum(rings)
        return np.concatenate([*found, len(rings) * self.sectors + np.arange(rest)]).astype(np.int64)

    def __len__(self) -> int:
        """Return p^d."""
        return int(self.levels**self.dimensions)

    def index(self, situation: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """Return the state of each situation, shape (transitions,).

        Parameters
        ----------
        situation : ndarray, shape (transitions, own + added), float32
            Readings as shares of their range, 1 where nothing is sensed; clipped to [0, 1].
        """
        dimension, state = self.dimension, np.zeros(len(situation), np.int64)
        for number in range(self.dimensions):
            nearest = situation[:, dimension == number].min(axis=1).clip(0, 1)
            level = np.minimum((nearest * np.float32(self.levels - 1)).astype(np.int64), self.levels - 1)
            state = state * self.levels + level
        return state


@inlined
def state_of(situation: Any, levels: int, dimensions: int, dimension: Any, first: int) -> int:
    """Return the state of one situation; ``dimension[first:]`` is the sensor of each component."""
    state = 0
    for number in range(dimensions):
        nearest = np.float32(1.0)
        for component in range(situation.shape[0]):
            if dimension[first + component] == number and situation[component] < nearest:
                nearest = situation[component]
        reading = max(nearest, np.float32(0.0))
        state = state * levels + min(int(reading * np.float32(levels - 1)), levels - 1)
    return state


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
    sectors : int, default 4
        Sectors per ring to which situations are merged; see `StateGrid`.
    levels : int, default 3
        Levels of one sensor to which readings are rounded; see `StateGrid`.
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

    sectors: Count = 4
    levels: Levels = 3
    sweeps: Count = 50
    states: StateGrid = field(init=False)
    values: npt.NDArray[np.float32] = field(init=False)

    title = "a table of states"
    kernel = _look_up
    draws = 2

    def __post_init__(self) -> None:
        super().__post_init__()
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
