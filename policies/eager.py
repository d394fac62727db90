"""Eager learners, the paper's counterpart to lazy ones: values are computed beforehand, for one reward.

`TabularQ` uses a table of all situations, `LinearQ` a linear approximation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Count, Index
from teamsight.core.kernel import Entry, Record, inlined
from teamsight.policies.actions import ActionGrid, act
from teamsight.policies.interface import Floats, Integers
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
        See `LinearQ`.
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
_INPUTS, _FEATURES, _LINEAR_ACTIONS = range(3)


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
        act(parameters[_LINEAR_ACTIONS + 2 * best], parameters[_LINEAR_ACTIONS + 2 * best + 1], i, percept, action)


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
