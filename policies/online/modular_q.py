"""Modular Q-learning: a small table for each partner, merged by greatest mass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Any, TypeVar

import numpy as np

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState
from teamsight.policies.online.boltzmann import chosen_action, largest
from teamsight.policies.online.cells import cell, cells, closest
from teamsight.policies.online.lattice import MOVES, lattice_move
from teamsight.policies.online.prey_q import MOST_DEPTH

_RATE, _DISCOUNT, _TEMPERATURE, _VALUES_ENDS, _DEPTH, _ROWS = range(6)

# The integers of a module: the row of its last decision, −1 where a trial begins, and the identity of its partner, −1
# for none yet. Behind the modules: the last action.
_ROW, _PARTNER = range(2)

#: The largest number of modules.
MOST_MODULES = 64

M = TypeVar("M", bound="ModularQ")


@inlined
def _meet(i: int, teammates: Any, ints: Any, modules: int) -> None:
    """Give each teammate that the robot meets for the first time a module, while there are any."""
    for k in range(teammates.start[i], teammates.start[i + 1]):
        identity = teammates.identity[k]
        for m in range(modules):
            if ints[m, _PARTNER] == identity or identity < 0:
                break
            if ints[m, _PARTNER] < 0:
                ints[m, _PARTNER] = identity
                break


@inlined
def _place_of(i: int, teammates: Any, identity: int) -> int:
    """Return the index of a teammate in the list of robot `i`; −1 if it is not perceived."""
    for k in range(teammates.start[i], teammates.start[i + 1]):
        if identity >= 0 and teammates.identity[k] == identity:
            return k
    return -1


@inlined
def _learn(values: Any, row: int, taken: int, now: int, reward: float, is_end: bool, parameters: Any) -> None:
    ahead = 0.0
    if not is_end or parameters[_VALUES_ENDS] > 0.0:
        ahead = largest(values[now])
    goal = reward + parameters[_DISCOUNT] * ahead
    values[row, taken] = values[row, taken] + parameters[_RATE] * (goal - values[row, taken])


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    depth, rows = int(parameters[_DEPTH]), int(parameters[_ROWS])
    modules = arrays.state.ints.shape[1] - 1
    places = (2 * depth + 1) * (2 * depth + 1) + 1
    for i in range(percept.heading.shape[0]):
        values, ints = arrays.state.floats[i], arrays.state.ints[i]
        # The row behind those of the modules holds the sums.
        mass = values[modules * rows]
        _meet(i, percept.teammates, ints, modules)
        prey = cell(percept.targets, closest(percept.targets, i, parameters[_DEPTH], noise[1, i]), depth)
        for m in range(modules):
            partner = cell(percept.teammates, _place_of(i, percept.teammates, ints[m, _PARTNER]), depth)
            now = m * rows + prey * places + partner
            row = ints[m, _ROW]
            if row >= 0 and parameters[_RATE] > 0.0:
                _learn(values, row, ints[modules, 0], now, percept.reward[i], percept.ended[i], parameters)
            for a in range(values.shape[1]):
                mass[a] = values[now, a] if m == 0 else mass[a] + values[now, a]
            ints[m, _ROW] = -1 if percept.ended[i] else now
        number = chosen_action(mass, parameters[_TEMPERATURE], noise[0, i])
        ints[modules, 0] = number
        lattice_move(number, i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class ModularQ(CompiledPolicy):
    """Q-learning with a module for each partner: the action of the greatest mass, the sum of all modules' values.

    A module is a table over the cell of the closest prey and the cell of one partner. All modules of a robot get its
    reward, and each corrects its own values as in `OnlineQ`. Partners are told apart by their identity, and get modules
    in the order in which the robot first perceives them; those for whom no module is left are ignored. With p places of
    the prey and as many of a partner, δ modules have δ·p² rows, where one table of all would have p^(δ + 1).

    Parameters
    ----------
    depth : int, default 3
        Prey and partners are perceived in a square of this many cells to each side.
    modules : int, default 3
        The number of modules: δ.
    learning_rate : float, default 0.8
        α, in [0, 1]; 0 keeps the tables as they are.
    discount : float, default 0.9
        Discount factor γ, in [0, 1].
    temperature : float, default 0.4
        Temperature of the choice by the merged values; 0 for the greatest.
    moves : {4, 5}, default 5
        North, east, south, west, and to stay.
    values_ends : bool, default False
        Whether what is perceived at the end of a trial counts by its value; by default it counts 0.
    first : PolicyState, optional
        The state with which robots begin, as `frozen` sets it. By default all values are 0, and no partner was met.

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits.

    Notes
    -----
    *Source:* Ono and Fukumoto (1996), as Touzet §9 describes it; Whitehead, Karlsson and Tenenberg (1993) for greatest
    mass. *Departs:* their constants are not known; ours are Tan's.
    """

    depth: int = 3
    modules: int = 3
    learning_rate: float = 0.8
    discount: float = 0.9
    temperature: float = 0.4
    moves: int = 5
    values_ends: bool = False
    first: PolicyState | None = None

    kernel = _decide
    draws = 2

    def __post_init__(self) -> None:
        checks.count("depth", self.depth, most=MOST_DEPTH)
        checks.count("modules", self.modules, most=MOST_MODULES)
        for name in ("learning_rate", "discount"):
            checks.number(name, getattr(self, name), least=0, most=1)
        checks.number("temperature", self.temperature, least=0)
        checks.count("moves", self.moves, least=MOVES[0], most=MOVES[1])
        checks.flag("values_ends", self.values_ends)

    @property
    def rows(self) -> int:
        """The number of rows of a module."""
        return cells(self.depth) ** 2

    @property
    def entries(self) -> int:
        """The number of values in the tables of one robot."""
        return self.modules * self.rows * self.moves

    @property
    def parameters(self) -> tuple[float, ...]:
        numbers = (self.learning_rate, self.discount, self.temperature)
        return *numbers, float(self.values_ends), float(self.depth), float(self.rows)

    @property
    def is_sound(self) -> bool:
        return True  # It makes lattice moves only.

    def start(self, size: int) -> PolicyState:
        shape = (size, self.modules * self.rows + 1, self.moves)
        if self.first is not None:
            if self.first.floats.shape != shape:
                raise ValueError(
                    f"first: holds tables of the shape {self.first.floats.shape}; must be {shape}, for {size} robots"
                )
            return PolicyState(self.first.floats.copy(), self.first.ints.copy())
        return PolicyState(np.zeros(shape), np.full((size, self.modules + 1, 2), -1, np.int64))

    def frozen(self: M, state: PolicyState) -> M:
        """Return the greedy policy of a team that has learned; it learns no more.

        Parameters
        ----------
        state : PolicyState
            The state of the team, such as ``world.hunters.policy_state``: its tables, and whose module is which.
        """
        ints = state.ints.copy()
        ints[:, :, _ROW] = -1
        return replace(self, first=PolicyState(state.floats.copy(), ints), learning_rate=0.0, temperature=0.0)

    def __repr__(self) -> str:
        shown = {name: value for name, value in vars(self).items() if name != "first"}
        if self.first is not None:
            shown["first"] = blake2b(self.first.floats.tobytes(), digest_size=4).hexdigest()
        return f"{type(self).__name__}({', '.join(f'{name}={value}' for name, value in shown.items())})"
