"""Robots that choose among four behaviours by four conditions, and learn which suits which."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.basis.behaviours import BEHAVIOURS, behave
from teamsight.policies.basis.conditions import INTRUDERS, RING, crowd, is_set
from teamsight.policies.basis.correct import correct_table
from teamsight.policies.basis.reinforcement import (
    BEHAVIOUR,
    CODES,
    EXPLORATION,
    INTRUDER_RANGE,
    KIND,
    MOST,
    ROW,
    SLOTS,
    STEPS,
    STUCK,
    TIMEOUT,
    TOTAL,
    TURN_PROBABILITY,
    WEIGHT,
    learn,
    reinforce,
)
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Floats, PolicyState
from teamsight.policies.online.boltzmann import chosen_action

#: The schemes of reinforcement, with their weights of events, of avoided intruders and of homing. "delayed" has the
#: delivered puck instead, and "none" learns nothing.
SCHEMES = {
    "none": (0.0, 0.0, 0.0), "delayed": (0.0, 0.0, 0.0), "events": (1.0, 0.0, 0.0), "progress": (0.5, 0.25, 0.25),
}  # fmt: skip
#: The largest δ of counts, and of sectors, each of which doubles the table.
MOST_COUNTED, MOST_SECTORS = 64, 8


@inlined
def _row_of(i: int, percept: Any, arrays: Any, has_puck: int) -> int:
    parameters = arrays.parameters
    home = is_set(percept.columns.at_home, percept, i)
    night = is_set(percept.columns.night, percept, i)
    reach = parameters[INTRUDER_RANGE]
    code = crowd(i, percept, int(parameters[KIND]), int(parameters[MOST]), reach, arrays.table)
    return ((has_puck * 2 + home) * 2 + night) * int(parameters[CODES]) + code


@inlined
def _chosen(values: Any, exploration: float, explores: float, fraction: float) -> int:
    """Return a random behaviour with the probability of exploration, otherwise one of the largest value."""
    if explores < exploration:
        return int(fraction * values.shape[0])
    return chosen_action(values, 0.0, fraction)


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    rows = arrays.state.floats.shape[1] - SLOTS
    for i in range(percept.heading.shape[0]):
        table, ints = arrays.state.floats[i, :rows], arrays.state.ints[i, 0]
        own = arrays.state.floats[i, rows:]
        has_puck = is_set(percept.columns.puck, percept, i)
        now = _row_of(i, percept, arrays, has_puck)
        is_over = reinforce(i, percept, own, ints, has_puck, parameters)
        if ints[BEHAVIOUR] < 0 or is_over or now != ints[ROW] or ints[STEPS] >= parameters[TIMEOUT]:
            if ints[BEHAVIOUR] >= 0:
                learn(table, own, ints, now, parameters)
            ints[BEHAVIOUR] = _chosen(table[now], parameters[EXPLORATION], noise[0, i], noise[1, i])
            ints[ROW] = now
            ints[STEPS] = 0
            ints[STUCK] = 0
            own[0, TOTAL] = 0.0
            own[0, WEIGHT] = 1.0
        behave(ints[BEHAVIOUR], i, percept, parameters[TURN_PROBABILITY:], noise[2:], action)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class BasisBehaviours(CompiledPolicy):
    """Wander, disperse, rest or go home: a table says which by whether the robot has a puck, is at home, whether it is
    night, and whether teammates are near; and it is learned from reinforcement.

    A behaviour goes on until its conditions change, an event happens, an estimator reports no progress for `patience`
    steps, or for `timeout` steps. Then its value A(c, b) grows by the sum of its reinforcement over these steps, which
    is not discounted, and the robot takes the behaviour of the largest value, or a random one with the probability
    `exploration`. The reinforcement of a step is u·E + v·I + w·H:

    - E is 1 for a puck grabbed, a puck dropped at home, and waking at home; −`punishment` for a puck dropped away from
      home, and waking away from home;
    - I applies where an intruder was near: `progress` if the nearest one is farther now, otherwise −`progress`;
    - H applies where the robot had a puck and has it still: `progress` if home is nearer now, otherwise −`progress`.

    With "delayed", 1 for each delivered puck is all reinforcement, and the value is that of Q-learning over behaviours,
    discounted for each of their steps.

    Parameters
    ----------
    scheme : {"none", "delayed", "events", "progress"}, default "progress"
        What reinforces: nothing, the delivered puck, events, or events and progress estimators.
    weights : tuple of float, optional
        u, v and w, with the sum 1, in place of those of "progress": 1/2, 1/4, 1/4. With "events", u is 1.
    progress, punishment : float, default 0.1, 1
        The size of I and H in a step, and that of bad events.
    learning_rate, discount : float, default 0.1, 0.99
        α and γ, the latter for each step, of the scheme "delayed".
    exploration : float, default 0.1
        The probability of a random behaviour.
    patience, timeout : int, default 5, 50
        Steps without progress, and steps at most, after which a behaviour ends.
    intruder_range : float, default 3
        Distance within which a perceived teammate is an intruder [length].
    intruders : {"bit", "count", "ring"}, default "bit"
        What the table knows of intruders: whether there is one, how many up to `delta`, or in which of `delta` sectors.
    delta : int, default 1
        δ of counts and sectors; a bit has 1.
    turn_probability, turn_range : float, default 0.1, π/2
        Of wandering, for a step: the probability of a turn, and the largest one [rad].
    safe_range : float, default 1
        Distance within which a wandering robot turns away from teammates [length].
    tables : ndarray, shape (rows, 4) or (robots, rows, 4), optional
        The first values; by default all are 0.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or the tables have another shape or values that are not
        finite.

    Notes
    -----
    *Source:* Mataric (1994, 1997) for the behaviours, the conditions, A(c, b), the events and the estimators.
    *Departs:* all numbers are ours; hers are not known to us. Each robot learns for itself.
    """

    scheme: str = "progress"
    weights: tuple[float, float, float] | None = None
    progress: float = 0.1
    punishment: float = 1.0
    learning_rate: float = 0.1
    discount: float = 0.99
    exploration: float = 0.1
    patience: int = 5
    timeout: int = 50
    intruder_range: float = 3.0
    intruders: str = "bit"
    delta: int = 1
    turn_probability: float = 0.1
    turn_range: float = 0.5 * math.pi
    safe_range: float = 1.0
    tables: Floats | None = None

    channels = ("home",)
    columns = (
        "puck", "at_home", "night", "grabbed", "dropped_home", "dropped_away", "woken_home", "woken_away",
    )  # fmt: skip
    draws = 4
    kernel = _decide

    def __post_init__(self) -> None:
        checks.choice("scheme", self.scheme, SCHEMES)
        checks.choice("intruders", self.intruders, INTRUDERS)
        for name in ("progress", "punishment"):
            checks.number(name, getattr(self, name), least=0)
        for name in ("learning_rate", "discount", "exploration", "turn_probability"):
            checks.number(name, getattr(self, name), least=0, most=1)
        checks.count("patience", self.patience)
        checks.count("timeout", self.timeout)
        for name in ("intruder_range", "safe_range"):
            checks.number(name, getattr(self, name), above=0)
        checks.number("turn_range", self.turn_range, least=0, most=math.pi)
        checks.count("delta", self.delta, most=self._most_delta)
        self._check_weights()
        if self.tables is not None:
            self._keep_tables()

    @property
    def _most_delta(self) -> int:
        return {"bit": 1, "count": MOST_COUNTED, "ring": MOST_SECTORS}[self.intruders]

    def _check_weights(self) -> None:
        if self.weights is None:
            return
        if self.scheme != "progress":
            raise ValueError(f"weights: belong to scheme='progress', and it is {self.scheme!r}; leave them out")
        shown = checks.shown(self.weights)
        if not isinstance(self.weights, tuple) or len(self.weights) != 3:
            raise TypeError(f"weights={shown}: must be a tuple of u, v and w, such as (0.5, 0.25, 0.25)")
        for name, weight in zip("uvw", self.weights, strict=True):
            checks.number(name, weight, least=0, most=1)
        if abs(sum(self.weights) - 1.0) > 1e-9:
            raise ValueError(f"weights={shown}: have the sum {sum(self.weights):g}; must be 1")

    def _keep_tables(self) -> None:
        tables = np.array(self.tables, float)
        if tables.ndim not in (2, 3) or tables.shape[-2:] != (self.rows, len(BEHAVIOURS)):
            raise ValueError(
                f"tables: have the shape {tables.shape}; must be (robots, {self.rows}, {len(BEHAVIOURS)}), or one "
                "table for all robots"
            )
        if not np.isfinite(tables).all():
            raise ValueError("tables: have values that are not finite; all must be, as learners leave them")
        tables.flags.writeable = False
        object.__setattr__(self, "tables", tables)

    @property
    def codes(self) -> int:
        """Into how many numbers intruders are coded."""
        return 2**self.delta if self.intruders == "ring" else self.delta + 1

    @property
    def rows(self) -> int:
        """The number of rows of a table: 16 with a bit."""
        return 8 * self.codes

    @property
    def parameters(self) -> tuple[float, ...]:
        u, v, w = self.weights or SCHEMES[self.scheme]
        delayed = self.scheme == "delayed"
        numbers = (
            delayed, u, v, w, self.progress, self.punishment, self.learning_rate, self.discount if delayed else 1.0,
            self.exploration, self.patience, self.timeout, self.intruder_range, INTRUDERS.index(self.intruders),
            self.delta, self.codes, self.turn_probability, self.turn_range / math.pi, self.safe_range,
        )  # fmt: skip
        return tuple(map(float, numbers))

    @property
    def table(self) -> npt.NDArray[np.float32]:
        """The centres of the sectors, shape (δ, 2); empty without sectors."""
        if self.intruders != INTRUDERS[RING]:
            return np.zeros((0, 2), np.float32)
        turn = 2.0 * np.pi * np.arange(self.delta) / self.delta
        return np.stack([np.cos(turn), np.sin(turn)], axis=-1).astype(np.float32)

    def start(self, size: int) -> PolicyState:
        """Return the state of robots before their first behaviour."""
        if self.tables is not None and self.tables.ndim == 3 and len(self.tables) != size:
            raise ValueError(
                f"tables: are of {len(self.tables)} robots, and the group has {size}; give one table for all, of the "
                f"shape ({self.rows}, {len(BEHAVIOURS)})"
            )
        floats = np.zeros((size, self.rows + SLOTS, len(BEHAVIOURS)))
        if self.tables is not None:
            floats[:, : self.rows] = self.tables
        # Nobody is near before the first step.
        floats[:, self.rows, 2] = self.intruder_range
        ints = np.zeros((size, 1, 5), np.int64)
        ints[:, 0, BEHAVIOUR] = -1
        return PolicyState(floats, ints)

    def values(self, state: PolicyState) -> Floats:
        """Return the tables of robots in their state, shape (robots, rows, 4)."""
        return np.array(state.floats[:, : self.rows])

    def frozen(self, tables: Floats) -> Self:
        """Return the policy that takes the behaviour of the largest value, and learns no more.

        Parameters
        ----------
        tables : ndarray, shape (robots, rows, 4) or (rows, 4), float64
            The values, such as ``policy.values(world.robots.policy_state)``.
        """
        return replace(self, tables=tables, scheme="none", weights=None, exploration=0.0)

    @classmethod
    def correct(cls, **options: Any) -> Self:
        """Return the policy made by hand, which learns nothing; see `teamsight.policies.basis.CORRECT`."""
        made = cls(scheme="none", exploration=0.0, **options)
        return replace(made, tables=correct_table(made.codes))

    def __repr__(self) -> str:
        shown = {name: value for name, value in vars(self).items() if name != "tables"}
        if self.tables is not None:
            shown["tables"] = blake2b(self.tables.tobytes(), digest_size=4).hexdigest()
        return f"{type(self).__name__}({', '.join(f'{name}={value}' for name, value in shown.items())})"
