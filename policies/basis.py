"""Basis behaviours: robots that choose among a few behaviours by a few conditions, and learn which suits which."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Annotated, Any, Self

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, Count, NonNegative, Positive, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.actions import go, turned_by
from teamsight.policies.channels import column_of
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Floats, PolicyState
from teamsight.policies.online.online_q import chosen_action, largest
from teamsight.policies.schemas import avoid_teammates, home_offset

#: The behaviours in the order of the columns of a table.
BEHAVIOURS = ("wandering", "dispersion", "resting", "homing")
WANDERING, DISPERSION, RESTING, HOMING = range(4)


@inlined
def behave(number: int, i: int, percept: Any, wandering: Any, noise: Any, action: Any) -> None:
    """Write the action of robot `i` in a behaviour.

    Parameters
    ----------
    number : int
        The behaviour.
    i : int
        The robot.
    percept : Percept
        What it perceives.
    wandering : ndarray, shape (3,), float64
        The probability of a turn, the largest turn to either side [half turns], and the distance from teammates that
        is safe [length].
    noise : ndarray, shape (2, n), float64
        Uniform numbers.
    action : Action
        Written.
    """
    x = percept.heading[i, 0]
    y = percept.heading[i, 1]
    distance = percept.speed[i]
    if number == WANDERING:
        if noise[0, i] < wandering[0]:
            x, y = turned_by(x, y, wandering[1] * (noise[1, i] - 0.5))
        apart_x, apart_y = avoid_teammates(i, percept, wandering[2])
        if apart_x != 0.0 or apart_y != 0.0:
            x, y = apart_x, apart_y
    elif number == DISPERSION:
        apart_x, apart_y = avoid_teammates(i, percept, percept.awareness_range[i])
        if apart_x != 0.0 or apart_y != 0.0:
            x, y = apart_x, apart_y
        else:
            distance = 0.0
    elif number == RESTING:
        distance = 0.0
    else:
        # At full speed also at home, so that a homing robot never stands still.
        home_x, home_y = home_offset(i, percept)
        if home_x != 0.0 or home_y != 0.0:
            x, y = home_x, home_y
    go(action, i, x, y, distance)


#: How the intruders that are near enter the row.
INTRUDERS = ("bit", "count", "ring")
BIT, COUNT, RING = range(3)

_TIE = 1e-6


@inlined
def nearest_teammate(i: int, percept: Any, reach: float) -> float:
    """Return the distance of the nearest teammate that robot `i` perceives within reach; the reach for none."""
    seen = percept.teammates
    nearest = reach
    for k in range(seen.start[i], seen.start[i + 1]):
        nearest = min(nearest, seen.distance[k])
    return nearest


@inlined
def _sector(x: float, y: float, heading: Any, sectors: Any) -> int:
    """Return the sector of an offset, anticlockwise from straight ahead: the first whose centre is nearest."""
    ahead = x * heading[0] + y * heading[1]
    left = y * heading[0] - x * heading[1]
    best = 0
    most = sectors[0, 0] * ahead + sectors[0, 1] * left
    for s in range(1, sectors.shape[0]):
        along = sectors[s, 0] * ahead + sectors[s, 1] * left
        # A robot that flees has the other straight behind, where odd numbers of sectors meet: rounding decides nothing.
        if along > most + _TIE * (abs(ahead) + abs(left)):
            best = s
            most = along
    return best


@inlined
def crowd(i: int, percept: Any, kind: int, most: int, reach: float, sectors: Any) -> int:
    """Return the number that stands for the teammates within reach of robot `i`; 0 for none.

    Parameters
    ----------
    i : int
        The robot.
    percept : Percept
        What it perceives.
    kind : int
        `BIT`, `COUNT` (of at most `most`), or `RING`: a bit for each of `most` sectors.
    most : int
        δ.
    reach : float
        Distance within which a teammate is an intruder [length].
    sectors : ndarray, shape (most, 2)
        For `RING`, the centres of the sectors as unit vectors, relative to the heading.
    """
    seen = percept.teammates
    found = 0
    for k in range(seen.start[i], seen.start[i + 1]):
        if seen.distance[k] < reach:
            if kind == RING:
                found |= 1 << _sector(seen.offset[k, 0], seen.offset[k, 1], percept.heading[i], sectors)
            else:
                found = min(found + 1, most)
    return found


@inlined
def is_set(column: Any, percept: Any, i: int) -> int:
    """Return 1 if a column of robot `i` is above 0, and 0 otherwise, also where it has none."""
    return 1 if column_of(column, percept.identity[i]) > 0.0 else 0


# The parameters of all that learns; see `BasisBehaviours.parameters`.
(IS_DELAYED, EVENT_WEIGHT, INTRUDER_WEIGHT, HOMING_WEIGHT, PROGRESS, PUNISHMENT, RATE, DISCOUNT, EXPLORATION, PATIENCE,
 TIMEOUT, INTRUDER_RANGE, KIND, MOST, CODES, TURN_PROBABILITY, TURN_RANGE, SAFE_RANGE) = range(18)  # fmt: skip

# The integers of a robot: its behaviour, -1 for none yet; the row in which it began; its steps so far; those without
# progress at a stretch; whether it had a puck.
BEHAVIOUR, ROW, STEPS, STUCK, HAD_PUCK = range(5)
# Behind the rows of the table are three slots of a robot. The first: reinforcement of the present behaviour, the
# discount of the next step, the last distances of the nearest intruder and, squared, of home. Then five counts.
TOTAL, WEIGHT, NEAR, HOME = range(4)
SLOTS = 3


@inlined
def counts_of(i: int, percept: Any) -> tuple[float, float, float, float, float]:
    """Return how often robot `i` has grabbed, dropped at home, dropped away, woken at home and woken away."""
    me = percept.identity[i]
    columns = percept.columns
    return (
        column_of(columns.grabbed, me), column_of(columns.dropped_home, me), column_of(columns.dropped_away, me),
        column_of(columns.woken_home, me), column_of(columns.woken_away, me),
    )  # fmt: skip


@inlined
def events(i: int, percept: Any, own: Any, punishment: float) -> tuple[float, float]:
    """Return the reinforcement E by the events since the last step, and how many there were; keep the counts."""
    grabbed, dropped_home, dropped_away, woken_home, woken_away = counts_of(i, percept)
    good = (grabbed - own[1, 0]) + (dropped_home - own[1, 1]) + (woken_home - own[1, 3])
    bad = (dropped_away - own[1, 2]) + (woken_away - own[2, 0])
    own[1, 0] = grabbed
    own[1, 1] = dropped_home
    own[1, 2] = dropped_away
    own[1, 3] = woken_home
    own[2, 0] = woken_away
    return good - punishment * bad, good + bad


@inlined
def progress(i: int, percept: Any, own: Any, ints: Any, has_puck: int, parameters: Any) -> tuple[float, float]:
    """Return the estimators I and H of the last step: 1 for progress, −1 for none, 0 where they do not apply.

    I applies if an intruder was near: it is 1 if the nearest is farther now. H applies if the robot had a puck and has
    it still: it is 1 if home is nearer now.
    """
    near = nearest_teammate(i, percept, parameters[INTRUDER_RANGE])
    home_x, home_y = home_offset(i, percept)
    home = home_x * home_x + home_y * home_y
    avoided = 0.0
    homed = 0.0
    if own[0, NEAR] < parameters[INTRUDER_RANGE]:
        avoided = 1.0 if near > own[0, NEAR] else -1.0
    if has_puck == 1 and ints[HAD_PUCK] == 1:
        homed = 1.0 if home < own[0, HOME] else -1.0
    own[0, NEAR] = near
    own[0, HOME] = home
    ints[HAD_PUCK] = has_puck
    return avoided, homed


@inlined
def reinforce(i: int, percept: Any, own: Any, ints: Any, has_puck: int, parameters: Any) -> bool:
    """Add what the last step was worth to the present behaviour; return whether an event or no progress ends it."""
    event, number = events(i, percept, own, parameters[PUNISHMENT])
    avoided, homed = progress(i, percept, own, ints, has_puck, parameters)
    estimated = parameters[INTRUDER_WEIGHT] * avoided + parameters[HOMING_WEIGHT] * homed
    gained = parameters[EVENT_WEIGHT] * event + parameters[PROGRESS] * estimated
    if parameters[IS_DELAYED] > 0.0:
        gained = percept.reward[i]
    own[0, TOTAL] += own[0, WEIGHT] * gained
    own[0, WEIGHT] *= parameters[DISCOUNT]
    ints[STEPS] += 1
    ints[STUCK] = ints[STUCK] + 1 if estimated < 0.0 else 0
    return bool(number > 0.0 or ints[STUCK] >= parameters[PATIENCE])


@inlined
def learn(table: Any, own: Any, ints: Any, now: int, parameters: Any) -> None:
    """Correct the value of the behaviour that ends: add its reinforcement, or make a step of Q-learning."""
    row, taken = ints[ROW], ints[BEHAVIOUR]
    if parameters[IS_DELAYED] > 0.0:
        goal = own[0, TOTAL] + own[0, WEIGHT] * largest(table[now])
        table[row, taken] += parameters[RATE] * (goal - table[row, taken])
    else:
        table[row, taken] += own[0, TOTAL]


# A row of the conditions is 8 · puck + 4 · home + 2 · night + intruder.
_PUCK, _HOME, _NIGHT, _INTRUDER = 8, 4, 2, 1


def _answer(row: int) -> int:
    """Return the behaviour for a row: the first of these rules that fits."""
    if row & _NIGHT:
        return RESTING if row & _HOME else HOMING
    if row & _PUCK and not row & _HOME:
        return HOMING
    return DISPERSION if row & _INTRUDER else WANDERING


#: The behaviour of each of the 16 rows: night → homing, at home resting; puck → homing; intruder → dispersion; else
#: wandering. Rows with a puck at home do not occur, because it is dropped at once.
CORRECT: tuple[int, ...] = tuple(map(_answer, range(16)))

#: The rows whose answer is clear, which are scored: (puck, home, night, intruder). Not clear are rows in which an
#: intruder is near a robot that should do something else too (carry, go home, rest), and the one at home by day with
#: nobody near, where wandering and dispersion both may leave.
CLEAR_ROWS: tuple[int, ...] = (
    0,                              # nothing: wandering
    _INTRUDER,                      # dispersion
    _NIGHT,                         # homing
    _PUCK,                          # homing
    _PUCK | _NIGHT,                 # homing
    _HOME | _INTRUDER,              # dispersion
    _HOME | _NIGHT,                 # resting
)  # fmt: skip


def correct_table(codes: int) -> Floats:
    """Return the values of the correct policy, 1 for the correct behaviour, shape (8 · codes, 4).

    Parameters
    ----------
    codes : int
        Into how many numbers the intruders that are near are coded; 0 is for none.
    """
    table = np.zeros((8 * codes, 4))
    for row in range(8 * codes):
        table[row, CORRECT[2 * (row // codes) + (1 if row % codes else 0)]] = 1.0
    return table


def share_correct(tables: Floats, rows: tuple[int, ...] = CLEAR_ROWS) -> float:
    """Return the share of rows that are learned right, over all robots.

    A row is learned right if the value of its correct behaviour is above those of the three others.

    Parameters
    ----------
    tables : ndarray, shape (robots, 8 · codes, 4), float64
        The tables of robots. Where intruders are counted or in sectors, a row of the 16 with an intruder stands for
        several, each of which counts by its share.
    rows : tuple of int
        Rows of the 16; by default those whose answer is clear.
    """
    tables = np.asarray(tables)
    codes = tables.shape[1] // 8
    found = []
    for row in rows:
        which = [0] if not row & _INTRUDER else list(range(1, codes))
        found.append(np.mean([_is_right(tables[:, (row // 2) * codes + code], CORRECT[row]) for code in which]))
    return float(np.mean(found))


def _is_right(values: Floats, answer: int) -> npt.NDArray[np.bool_]:
    others = np.delete(values, answer, axis=1)
    return np.asarray(values[:, answer] > others.max(axis=1))


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
    return chosen_action(values, 0.0, fraction, -1)


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
    progress : float, default 0.1
        The size of I and H in a step.
    punishment : float, default 1
        The size of bad events.
    learning_rate : float, default 0.1
        Learning rate α of the scheme "delayed", in [0, 1].
    discount : float, default 0.99
        Discount factor γ of the scheme "delayed" for each step, in [0, 1].
    exploration : float, default 0.1
        The probability of a random behaviour.
    patience : int, default 5
        Steps without progress after which a behaviour ends.
    timeout : int, default 50
        Steps after which a behaviour ends at the latest.
    intruder_range : float, default 3
        Distance within which a perceived teammate is an intruder [length].
    intruders : {"bit", "count", "ring"}, default "bit"
        What the table knows of intruders: whether there is one, how many up to `delta`, or in which of `delta` sectors.
    delta : int, default 1
        δ of counts and sectors; a bit has 1.
    turn_probability : float, default 0.1
        Probability per step with which a wandering robot turns.
    turn_range : float, default π/2
        Its largest turn to either side [rad].
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

    scheme: Annotated[str, Allowed(choices=SCHEMES)] = "progress"
    weights: tuple[float, float, float] | None = None
    progress: NonNegative = 0.1
    punishment: NonNegative = 1.0
    learning_rate: Probability = 0.1
    discount: Probability = 0.99
    exploration: Probability = 0.1
    patience: Count = 5
    timeout: Count = 50
    intruder_range: Positive = 3.0
    intruders: Annotated[str, Allowed(choices=INTRUDERS)] = "bit"
    delta: Count = 1
    turn_probability: Probability = 0.1
    turn_range: Annotated[float, Allowed(least=0, most=math.pi)] = 0.5 * math.pi
    safe_range: Positive = 1.0
    tables: Floats | None = None

    channels = ("home",)
    columns = (
        "puck", "at_home", "night", "grabbed", "dropped_home", "dropped_away", "woken_home", "woken_away",
    )  # fmt: skip
    draws = 4
    kernel = _decide

    def __post_init__(self) -> None:
        super().__post_init__()
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
