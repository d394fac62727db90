"""Modular Q-learning: a small table for each partner, merged by greatest mass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Annotated, Any, TypeVar

import numpy as np

from teamsight.core import checks
from teamsight.core.component import Allowed, Flag, NonNegative, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState
from teamsight.policies.online.lattice_walk import EVERY, Moves, lattice_move
from teamsight.policies.online.online_q import chosen_action, largest
from teamsight.policies.online.prey_q import MOST_DEPTH, at_rank, cell, cells, closest

_RATE, _DISCOUNT, _TEMPERATURE, _VALUES_ENDS, _DEPTH, _TABLES, _ROWS, _BY_DISTANCE = range(8)

# The integers of a place for a partner: the row of the last decision in its table, −1 where a trial begins, and the
# identity of the partner, −1 for none yet. Behind the places: the last action.
_ROW, _PARTNER = range(2)

#: The largest number of modules, and of values of one robot: 400 MB.
MOST_MODULES, MOST_ENTRIES = 64, 50_000_000
#: Which partner a module is for.
BY = ("identity", "distance")

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
def _known(i: int, teammates: Any, identity: int) -> int:
    """Return the index of a teammate in the list of robot `i`; −1 if it is not perceived."""
    for k in range(teammates.start[i], teammates.start[i + 1]):
        if identity >= 0 and teammates.identity[k] == identity:
            return k
    return -1


@inlined
def _row(i: int, t: int, prey: int, teammates: Any, ints: Any, parameters: Any) -> int:
    """Return the row of table `t`: the cells of the prey and of one partner, or of all if there is one table."""
    depth = int(parameters[_DEPTH])
    side = 2 * depth + 1
    first, last = t, t + 1
    if parameters[_TABLES] == 1.0:
        first, last = 0, ints.shape[0] - 1
    row = prey
    for m in range(first, last):
        if parameters[_BY_DISTANCE] > 0.0:
            k = at_rank(teammates, i, m, parameters[_DEPTH])
        else:
            k = _known(i, teammates, ints[m, _PARTNER])
        row = row * (side * side + 1) + cell(teammates, k, depth)
    return row


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
    tables, rows = int(parameters[_TABLES]), int(parameters[_ROWS])
    modules = arrays.state.ints.shape[1] - 1
    for i in range(percept.heading.shape[0]):
        values, ints = arrays.state.floats[i], arrays.state.ints[i]
        # The row behind those of the tables holds the sums.
        mass = values[tables * rows]
        if parameters[_BY_DISTANCE] == 0.0:
            _meet(i, percept.teammates, ints, modules)
        nearest = closest(percept.targets, i, parameters[_DEPTH], noise[1, i])
        prey = cell(percept.targets, nearest, int(parameters[_DEPTH]))
        for t in range(tables):
            now = t * rows + _row(i, t, prey, percept.teammates, ints, parameters)
            row = ints[t, _ROW]
            if row >= 0 and parameters[_RATE] > 0.0:
                _learn(values, row, ints[modules, 0], now, percept.reward[i], percept.ended[i], parameters)
            for a in range(values.shape[1]):
                mass[a] = values[now, a] if t == 0 else mass[a] + values[now, a]
            ints[t, _ROW] = -1 if percept.ended[i] else now
        number = chosen_action(mass, parameters[_TEMPERATURE], noise[0, i], EVERY)
        ints[modules, 0] = number
        lattice_move(number, i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class ModularQ(CompiledPolicy):
    """Q-learning with a module for each partner: the action of the greatest mass, the sum of all modules' values.

    A module is a table over the cell of the closest prey and the cell of one partner. All modules of a robot get its
    reward, and each corrects its own values as in `OnlineQ`. With p places of the prey and as many of a partner, δ
    modules have δ·p² rows, where one table over all, ``monolithic=True``, has p^(δ + 1).

    By identity, partners get modules in the order in which the robot first perceives them, and keep them; those for
    whom no module is left are ignored. By distance, module m is for the m-th nearest teammate at each decision, for
    degrees of awareness that show no identity.

    Parameters
    ----------
    depth : int, default 3
        Prey and partners are perceived in a square of this many cells to each side.
    modules : int, default 3
        The number of modules: δ.
    by : {"identity", "distance"}, default "identity"
        Which partner a module is for.
    monolithic : bool, default False
        Whether one table over the prey and all partners replaces the modules.
    learning_rate : float, default 0.1
        Learning rate α, in [0, 1]; 0 keeps the tables as they are.
    discount : float, default 0.9
        Discount factor γ, in [0, 1].
    temperature : float, default 0.001
        Temperature of the choice by the merged values; 0 for the greatest.
    moves : {4, 5}, default 5
        Moves to the north, east, south and west; 5 to stay in place too.
    values_ends : bool, default False
        Whether what is perceived at the end of a trial counts by its value; by default it counts 0.
    first : PolicyState, optional
        The state with which robots begin, as `frozen` sets it. By default all values are 0, and no partner was met.

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits, the tables of a robot have more than `MOST_ENTRIES` values, or `first` is not
        the state of robots with these options.

    Notes
    -----
    *Source:* Ono and Fukumoto (1996), as Touzet §9 describes it; Whitehead, Karlsson and Tenenberg (1993) for greatest
    mass. *Departs:* their constants are not known. Ours are chosen for four hunters and one prey, see
    docs/tasks/surround.md: first values of 0 are optimistic where each step costs something, and at a low temperature
    they lead hunters to what they have rarely met, the prey and each other.
    """

    depth: Annotated[int, Allowed(least=1, most=MOST_DEPTH)] = 3
    modules: Annotated[int, Allowed(least=1, most=MOST_MODULES)] = 3
    by: Annotated[str, Allowed(choices=BY)] = "identity"
    monolithic: Flag = False
    learning_rate: Probability = 0.1
    discount: Probability = 0.9
    temperature: NonNegative = 0.001
    moves: Moves = 5
    values_ends: Flag = False
    first: PolicyState | None = None

    kernel = _decide
    draws = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.entries > MOST_ENTRIES:
            modular = replace(self, monolithic=False, first=None).entries
            cure = f"; modules of their own have {modular:,}" if modular <= MOST_ENTRIES else ""
            raise ValueError(
                f"depth={self.depth}, modules={self.modules}: the tables of a robot have {self.entries:,} values; must "
                f"be at most {MOST_ENTRIES:,}{cure}"
            )
        if self.first is not None:
            object.__setattr__(self, "first", self._kept(self.first))

    def _kept(self, first: Any) -> PolicyState:
        """Return a copy of a first state that nobody can change; the kernel does not check what it reads."""
        if not isinstance(first, PolicyState):
            raise TypeError(f"first={checks.shown(first)}: must be a PolicyState, such as world.hunters.policy_state")
        floats, given = np.array(first.floats, float), np.asarray(first.ints)
        robots, rows = floats.shape[:1], self.tables * self.rows
        for name, array, rest in (("floats", floats, (rows + 1, self.moves)), ("ints", given, (self.modules + 1, 2))):
            if array.shape != (*robots, *rest):
                raise ValueError(
                    f"first: its {name} have the shape {array.shape}; must be (robots, {rest[0]}, {rest[1]}); freeze "
                    "the state of a team with the same options"
                )
        if given.dtype.kind != "i" or not np.isfinite(floats).all():
            raise ValueError("first: its ints must be whole numbers, and its floats finite; freeze the state of a team")
        ints = given.astype(np.int64)
        if (ints[:, :-1, _ROW] >= rows).any() or (ints[:, -1, _ROW] < -1).any() or (ints[:, -1] >= self.moves).any():
            raise ValueError(
                f"first: its ints name rows of tables below {rows} and actions below {self.moves} only; freeze the "
                "state of a team with the same options"
            )
        floats.flags.writeable = ints.flags.writeable = False
        return PolicyState(floats, ints)

    @property
    def needs(self) -> tuple[str, ...]:  # type: ignore[override]
        """Teammates, and their identities, unless partners are taken by their distance."""
        return ("identities",) if self.by == BY[0] else ("teammates",)

    @property
    def tables(self) -> int:
        """The number of tables of a robot."""
        return 1 if self.monolithic else self.modules

    @property
    def rows(self) -> int:
        """The number of rows of a table."""
        return int(cells(self.depth) ** (self.modules + 1 if self.monolithic else 2))

    @property
    def entries(self) -> int:
        """The number of values in the tables of one robot."""
        return self.tables * self.rows * self.moves

    @property
    def parameters(self) -> tuple[float, ...]:
        numbers = (self.learning_rate, self.discount, self.temperature)
        sizes = (self.depth, self.tables, self.rows)
        return *numbers, float(self.values_ends), *map(float, sizes), float(self.by == BY[1])

    @property
    def is_sound(self) -> bool:
        return True  # It makes lattice moves only.

    def start(self, size: int) -> PolicyState:
        if self.first is not None:
            if len(self.first.floats) != size:
                raise ValueError(
                    f"first: is the state of {len(self.first.floats)} robots, and the group has {size}; freeze the "
                    "state of a team of this size"
                )
            return PolicyState(self.first.floats.copy(), self.first.ints.copy())
        shape = (size, self.tables * self.rows + 1, self.moves)
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
        return replace(self, first=PolicyState(state.floats, ints), learning_rate=0.0, temperature=0.0)

    def __repr__(self) -> str:
        shown = {name: value for name, value in vars(self).items() if name != "first"}
        if self.first is not None:
            shown["first"] = blake2b(self.first.floats.tobytes(), digest_size=4).hexdigest()
        return f"{type(self).__name__}({', '.join(f'{name}={value}' for name, value in shown.items())})"
