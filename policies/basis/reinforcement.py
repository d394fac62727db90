"""Reinforcement of behaviours: events, progress estimators, and what a table learns from them."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.basis.conditions import nearest_teammate
from teamsight.policies.columns import column_of
from teamsight.policies.online.boltzmann import largest
from teamsight.policies.schemas.vectors import home_offset

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
