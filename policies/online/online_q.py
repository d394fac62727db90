"""Online Q-learning: each robot has a table, and corrects it at each decision by the reward in its percept."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Any, TypeVar

import numpy as np

from teamsight.core.component import Flag, Index, NonNegative, Probability
from teamsight.core.elementary import exp, modulo
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Floats, PolicyState
from teamsight.policies.online.lattice_walk import EVERY, Moves, lattice_move


@inlined
def largest(values: Any) -> Any:
    """Return the largest of some values."""
    best = values[0]
    for a in range(1, values.shape[0]):
        best = max(best, values[a])
    return best


@inlined
def chosen_action(values: Any, temperature: float, fraction: float, allowed: int) -> int:
    """Return an action with a probability proportional to exp(value / temperature).

    Parameters
    ----------
    values : ndarray, shape (actions,), float64
        The values of the actions.
    temperature : float
        Above 0; or 0 for an action of the largest value, each of equals with the same probability.
    fraction : float
        A uniform number in (0, 1), which chooses.
    allowed : int
        The actions to choose from, as bits; at least one. −1 for all.
    """
    best = -np.inf
    for a in range(values.shape[0]):
        if allowed >> a & 1:
            best = max(best, values[a])
    total = 0.0
    for a in range(values.shape[0]):
        if allowed >> a & 1:
            total += _weight(values[a] - best, temperature)
    rest = fraction * total
    last = 0
    for a in range(values.shape[0]):
        weight = _weight(values[a] - best, temperature) if allowed >> a & 1 else 0.0
        if weight > 0.0:
            last = a
            if rest < weight:
                return a
            rest -= weight
    # Only rounding leads here.
    return last


@inlined
def _weight(below: float, temperature: float) -> float:
    if temperature > 0.0:
        return exp(below / temperature)
    return 1.0 if below == 0.0 else 0.0


_RATE, _DISCOUNT, _TEMPERATURE, _VALUES_ENDS, _AVERAGE_EVERY, _IS_ONE = range(6)
#: In a kernel of rows, the parameters of the rows begin here.
ROW_PARAMETERS = 6
#: In a kernel of rows, the uniform numbers that it may use begin here, behind the one that chooses the action.
ROW_NOISE = 1

# The integers of a robot: the row and the action of its last decision. The row is −1 where a trial begins, and −2
# before the first decision of all.
_ROW, _ACTION = range(2)
_NEW = -2

L = TypeVar("L", bound="OnlineQ")


@inlined
def _learn(i: int, now: int, percept: Any, arrays: Any) -> None:
    """Correct the value of the last decision of robot `i` by what followed."""
    parameters = arrays.parameters
    tables = arrays.state.floats
    row = arrays.state.ints[i, 0, _ROW]
    taken = arrays.state.ints[i, 0, _ACTION]
    ahead = 0.0
    if not percept.ended[i] or parameters[_VALUES_ENDS] > 0.0:
        ahead = largest(tables[i, now])
    goal = percept.reward[i] + parameters[_DISCOUNT] * ahead
    corrected = tables[i, row, taken] + parameters[_RATE] * (goal - tables[i, row, taken])
    if parameters[_IS_ONE] > 0.0:
        for j in range(tables.shape[0]):
            tables[j, row, taken] = corrected
    else:
        tables[i, row, taken] = corrected


@inlined
def _average(tables: Any) -> None:
    """Set every value of every robot to the mean over the robots."""
    robots = tables.shape[0]
    for row in range(tables.shape[1]):
        for a in range(tables.shape[2]):
            total = 0.0
            for j in range(robots):
                total += tables[j, row, a]
            for j in range(robots):
                tables[j, row, a] = total / robots


@inlined
def _share(tables: Any, last: Any) -> None:
    """Give robots that have just joined the table that all others use."""
    used = -1
    for i in range(tables.shape[0]):
        if last[i, 0, _ROW] != _NEW:
            used = i
            break
    for i in range(tables.shape[0]):
        if used >= 0 and last[i, 0, _ROW] == _NEW:
            for row in range(tables.shape[1]):
                for a in range(tables.shape[2]):
                    tables[i, row, a] = tables[used, row, a]


@inlined
def _all_moves(i: int, percept: Any, parameters: Any) -> int:
    return EVERY


def online_q(row_of: Callable[..., int], moves_of: Callable[..., int] = _all_moves) -> Callable[..., None]:
    """Return the kernel of an online Q-learner.

    Parameters
    ----------
    row_of : kernel
        ``row_of(i, percept, parameters, noise)`` returns the row of the table that stands for what robot `i`
        perceives. Its own parameters begin at `ROW_PARAMETERS`, its random numbers at row `ROW_NOISE`.
    moves_of : kernel
        ``moves_of(i, percept, parameters)`` returns the moves from which robot `i` chooses, as bits (`EVERY`).
    """

    @inlined
    def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
        parameters = arrays.parameters
        tables = arrays.state.floats
        last = arrays.state.ints
        every = parameters[_AVERAGE_EVERY]
        if every > 0.0 and percept.time[0] > 0.0 and modulo(percept.time[0], every) == 0.0:
            _average(tables)
        if parameters[_IS_ONE] > 0.0:
            _share(tables, last)
        for i in range(percept.heading.shape[0]):
            now = row_of(i, percept, parameters, noise)
            if last[i, 0, _ROW] >= 0 and parameters[_RATE] > 0.0:
                _learn(i, now, percept, arrays)
            allowed = moves_of(i, percept, parameters)
            number = chosen_action(tables[i, now], parameters[_TEMPERATURE], noise[0, i], allowed)
            # What follows the end of a trial is not the result of an action.
            last[i, 0, _ROW] = -1 if percept.ended[i] else now
            last[i, 0, _ACTION] = number
            lattice_move(number, i, percept, action)

    return _decide


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class OnlineQ(CompiledPolicy):
    """One-step Q-learning with a table for each robot, on a lattice: the base class of online learners.

    At each decision Q(s, a) ← Q(s, a) + α [r + γ max Q(s′, ·) − Q(s, a)], where s and a are what the robot perceived
    and did at its last decision, and r and s′ what it perceives now. It then takes action a with a probability
    proportional to exp(Q(s′, a) / T). A decision at the end of a trial is not learned from.

    A subclass defines `rows`, `row_parameters` and `kernel`, which `online_q` makes from a kernel that returns the row
    of a percept.

    Parameters
    ----------
    learning_rate : float, default 0.8
        Learning rate α, in [0, 1]; 0 keeps the tables as they are. Tan writes β.
    discount : float, default 0.9
        Discount factor γ, in [0, 1].
    temperature : float, default 0.4
        Temperature T of the choice; 0 takes an action of the largest value, each of equals with the same probability.
    moves : {4, 5}, default 4
        Moves to the north, east, south and west; 5 to stay in place too.
    values_ends : bool, default False
        Whether s′ counts by its value when it ends a trial, like any other; by default it counts 0.
    average_every : int, default 0
        Steps after which all robots replace their tables by the mean of all; 0 for never.
    one_table : bool, default False
        Whether all robots use one table, which each of them corrects.
    tables : ndarray, shape (rows, actions) or (robots, rows, actions), optional
        The first tables; by default all values are 0.

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits, or the tables have another shape or values that are not finite.

    Notes
    -----
    *Source:* Tan (1993), §3: the constants and the choice of actions; §6.2: averaging, and one table for all.
    *Departs:* with `average_every`, robots average before they decide.
    """

    learning_rate: Probability = 0.8
    discount: Probability = 0.9
    temperature: NonNegative = 0.4
    moves: Moves = 4
    values_ends: Flag = False
    average_every: Index = 0
    one_table: Flag = False
    tables: Floats | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tables is not None:
            tables = np.array(self.tables, float)
            if tables.ndim not in (2, 3) or tables.shape[-2:] != (self.rows, self.moves):
                raise ValueError(
                    f"tables: have the shape {tables.shape}; must be (robots, {self.rows}, {self.moves}), or one table "
                    "for all robots"
                )
            if not np.isfinite(tables).all():
                raise ValueError("tables: have values that are not finite; all must be, as learners leave them")
            if self.one_table and tables.ndim == 3:
                if (tables != tables[:1]).any():
                    raise ValueError(
                        f"tables: those of {len(tables)} robots differ, and one_table=True; give one table, such as "
                        "tables.mean(axis=0)"
                    )
                tables = tables[0].copy()
            tables.flags.writeable = False
            object.__setattr__(self, "tables", tables)

    @property
    @abstractmethod
    def rows(self) -> int:
        """The number of rows of a table."""

    @property
    def row_parameters(self) -> tuple[float, ...]:
        """The constants that the kernel of rows reads; none by default."""
        return ()

    @property
    def entries(self) -> int:
        """The number of values in the table of one robot."""
        return self.rows * self.moves

    @property
    def parameters(self) -> tuple[float, ...]:
        numbers = (self.learning_rate, self.discount, self.temperature)
        return (
            *numbers, float(self.values_ends), float(self.average_every), float(self.one_table), *self.row_parameters,
        )  # fmt: skip

    @property
    def is_sound(self) -> bool:
        return True  # It makes lattice moves only.

    @property
    def decides_together(self) -> bool:  # type: ignore[override]
        """Whether robots share what they learn, and so the kernel needs the tables of all."""
        return self.one_table or self.average_every > 0

    def start(self, size: int) -> PolicyState:
        if self.tables is not None and self.tables.ndim == 3 and len(self.tables) != size:
            raise ValueError(
                f"tables: are of {len(self.tables)} robots, and the group has {size}; give one table for all, of the "
                f"shape ({self.rows}, {self.moves})"
            )
        floats = np.zeros((size, self.rows, self.moves))
        if self.tables is not None:
            floats[:] = self.tables
        ints = np.zeros((size, 1, 2), np.int64)
        ints[:, 0, _ROW] = _NEW
        return PolicyState(floats, ints)

    def frozen(self: L, tables: Floats, temperature: float = 0.0) -> L:
        """Return the policy of some tables, which learns no more: greedy, or with the temperature of its choice.

        Parameters
        ----------
        tables : ndarray, shape (robots, rows, actions), float64
            The tables, such as ``world.hunters.policy_state.floats``.
        temperature : float, default 0
            The temperature.
        """
        if self.one_table and np.ndim(tables) == 3:
            tables = tables[0]
        return replace(
            self, tables=tables, learning_rate=0.0, temperature=temperature, average_every=0, one_table=False
        )

    def __repr__(self) -> str:
        shown = {name: value for name, value in vars(self).items() if name != "tables"}
        if self.tables is not None:
            shown["tables"] = blake2b(self.tables.tobytes(), digest_size=4).hexdigest()
        return f"{type(self).__name__}({', '.join(f'{name}={value}' for name, value in shown.items())})"
