"""Braitenberg vehicles: readings of two eyes, cues, behaviours, recovery from stagnation, and their fixed priority."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.core.component import Allowed, Count, Flag, Positive, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.actions import go, turned_by
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState

# The eyes look this far to either side of the heading: cosine and sine of 45°.
_EYE = 0.7071067811865476
# Robots are sensed ahead: cosine of the half angle, 60°.
_AHEAD = 0.5


@inlined
def eyes(i: int, percept: Any, x: float, y: float, length: float) -> tuple[float, float]:
    """Return the left and right readings of a light at an offset: 1 straight before the eye, 0 behind it."""
    if length <= 0.0:
        return 0.5, 0.5
    ahead = (percept.heading[i, 0] * x + percept.heading[i, 1] * y) / length
    left = (percept.heading[i, 0] * y - percept.heading[i, 1] * x) / length
    return 0.5 + 0.5 * _EYE * (ahead + left), 0.5 + 0.5 * _EYE * (ahead - left)


@inlined
def nearest(i: int, seen: Any) -> tuple[float, float, float]:
    """Return the distance and the offset of the nearest agent of a neighbour list; an infinite distance without any."""
    distance = math.inf
    x = 0.0
    y = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        if seen.distance[k] < distance:
            distance = seen.distance[k]
            x = seen.offset[k, 0]
            y = seen.offset[k, 1]
    return distance, x, y


@inlined
def is_ahead(i: int, percept: Any, x: float, y: float, length: float) -> bool:
    """Return whether an offset of this length is at most 60° from the heading of robot `i`."""
    return percept.heading[i, 0] * x + percept.heading[i, 1] * y >= _AHEAD * length  # type: ignore[no-any-return]


@inlined
def obstacle(i: int, percept: Any, sphere: float) -> tuple[float, float]:
    """Return how near obstacles ahead are, left and right of the heading: in [0, 1], 0 beyond the sphere."""
    seen = percept.channels.obstacles
    left = 0.0
    right = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        x = seen.offset[k, 0]
        y = seen.offset[k, 1]
        if seen.distance[k] >= sphere or not is_ahead(i, percept, x, y, seen.distance[k]):
            continue
        near = 1.0 - seen.distance[k] / sphere
        if percept.heading[i, 0] * y - percept.heading[i, 1] * x >= 0.0:
            left = max(left, near)
        else:
            right = max(right, near)
    return left, right


#: The cues, in the order of their bits.
CUES = (
    "obstacle left", "obstacle right", "obstacle near left", "obstacle near right", "box", "box left", "box touched",
    "teammate", "teammate left", "teammate ahead", "teammate ahead in slow range", "teammate ahead near",
)  # fmt: skip
#: The parameters that all kernels here have.
OBSTACLE_RANGE, SLOW_RANGE, AGILITY, SWERVE, PATIENCE, CONTACT = range(6)

# The readings from which obstacles are near, and the share of the slow range within which a teammate is near.
_NEAR = 0.2
_NEAR_SHARE = 0.5


@inlined
def _bit(number: int, is_set: bool) -> int:
    return (1 << number) if is_set else 0


@inlined
def has(cues: int, number: int) -> bool:
    """Return whether a cue is set."""
    return (cues >> number) & 1 == 1


@inlined
def _is_left(i: int, percept: Any, x: float, y: float) -> bool:
    return percept.heading[i, 0] * y - percept.heading[i, 1] * x >= 0.0  # type: ignore[no-any-return]


@inlined
def cues_of(i: int, percept: Any, parameters: Any) -> int:
    """Return the cues of robot `i`, one bit for each of `CUES`.

    Of teammates only the nearest that its degree of awareness shows counts.
    """
    left, right = obstacle(i, percept, parameters[OBSTACLE_RANGE])
    cues = _bit(0, left > 0.0) + _bit(1, right > 0.0) + _bit(2, left > _NEAR) + _bit(3, right > _NEAR)
    distance, x, y = nearest(i, percept.targets)
    if distance < math.inf:
        cues += _bit(4, True) + _bit(5, _is_left(i, percept, x, y)) + _bit(6, distance <= parameters[CONTACT])
    distance, x, y = nearest(i, percept.teammates)
    if distance < math.inf:
        cues += _bit(7, True) + _bit(8, _is_left(i, percept, x, y))
        if is_ahead(i, percept, x, y, distance):
            slow = parameters[SLOW_RANGE]
            cues += _bit(9, True) + _bit(10, distance <= slow) + _bit(11, distance <= _NEAR_SHARE * slow)
    return cues


#: The behaviours, in the order of the fixed priority; a robot's behaviour is an index into them.
BEHAVIOURS = ("avoid", "goal", "slow", "follow", "find")
AVOID, GOAL, SLOW, FOLLOW, FIND = range(5)

# How strongly avoidance brakes a wheel, and how much more the left one turns, so that robots do not stop face to face.
_BRAKE = 4.0
_BIAS = 0.2


@inlined
def _roll(i: int, percept: Any, action: Any, left: float, right: float, agility: float) -> None:
    """Write the action of robot `i` for the speeds of its wheels, cut to [−1, 1].

    Their mean is the distance as a share of the speed; half their difference, times the agility [turns], the rotation.
    """
    left = min(max(left, -1.0), 1.0)
    right = min(max(right, -1.0), 1.0)
    x, y = turned_by(percept.heading[i, 0], percept.heading[i, 1], 0.5 * agility * (right - left))
    action.heading[i, 0] = x
    action.heading[i, 1] = y
    action.distance[i] = percept.speed[i] * max(0.5 * (left + right), 0.0)


@inlined
def _wheels(behaviour: int, i: int, percept: Any, parameters: Any, random: float) -> tuple[float, float]:
    """Return the speeds of the left and the right wheel of robot `i` in a behaviour; `random` is uniform."""
    swerve = parameters[SWERVE]
    left = 1.0 - swerve * random
    right = 1.0 - swerve * (1.0 - random)
    if behaviour == AVOID:
        # Each side brakes the wheel of the other, so the robot turns away.
        near_left, near_right = obstacle(i, percept, parameters[OBSTACLE_RANGE])
        left = 1.0 + _BIAS - _BRAKE * near_right
        right = 1.0 - _BRAKE * near_left
    elif behaviour == SLOW:
        left *= 0.5
        right *= 0.5
    elif behaviour != FIND:
        # Each eye drives the wheel of the other side, so the robot turns to the light.
        distance, x, y = nearest(i, percept.targets) if behaviour == GOAL else nearest(i, percept.teammates)
        right, left = eyes(i, percept, x, y, distance)
    return left, right


@inlined
def behave(behaviour: int, i: int, percept: Any, parameters: Any, random: float, action: Any) -> None:
    """Write the action of robot `i` in a behaviour."""
    left, right = _wheels(behaviour, i, percept, parameters, random)
    _roll(i, percept, action, left, right, parameters[AGILITY])


#: The whole numbers that a robot keeps: steps of stagnation, steps of recovery that are left, recoveries since the box
#: last moved, and the behaviour and the cues of its last decision. While it recovers, the behaviour is −1.
STUCK, LEFT, RECOVERIES, BEHAVIOUR, LAST_CUES = range(5)

# The numbers that it keeps: the turn of its recovery [turns], and the offset of the box at its last decision, (0, 0) if
# it did not sense it.
_TURN, _LAST_X, _LAST_Y = range(3)
# A box that moves by less than this share of the robot's speed between two decisions does not move.
_STILL = 0.02
# The largest turn of a push to either side, and the turn of a robot that goes round the box [turns].
_REALIGN = 0.125
_REPOSITION = 0.25


@inlined
def _begin(i: int, state: Any, patience: float, random: float) -> None:
    """Begin a recovery: the first turns the push by a random angle, the next goes round to a random side, and so on."""
    state.ints[i, 0, STUCK] = 0
    state.ints[i, 0, RECOVERIES] += 1
    state.ints[i, 0, LEFT] = int(patience)
    if state.ints[i, 0, RECOVERIES] % 2 == 1:
        state.floats[i, 0, _TURN] = _REALIGN * (2.0 * random - 1.0)
    else:
        state.floats[i, 0, _TURN] = _REPOSITION if random < 0.5 else -_REPOSITION


@inlined
def _shift(i: int, percept: Any, state: Any, x: float, y: float) -> float:
    """Return how far the box has moved since the last decision, by odometry; 0 if it was not sensed then."""
    last_x = state.floats[i, 0, _LAST_X]
    last_y = state.floats[i, 0, _LAST_Y]
    state.floats[i, 0, _LAST_X] = x
    state.floats[i, 0, _LAST_Y] = y
    if last_x == 0.0 and last_y == 0.0:
        return 0.0
    dx = x + percept.moved[i, 0] - last_x
    dy = y + percept.moved[i, 1] - last_y
    return math.sqrt(dx * dx + dy * dy)


@inlined
def _is_due(i: int, state: Any, touches: bool, moves: bool, patience: float) -> bool:
    """Count the steps in which robot `i` pushes in vain, and return whether a recovery is due."""
    if moves:
        state.ints[i, 0, RECOVERIES] = 0
    if moves or not touches:
        state.ints[i, 0, STUCK] = 0
        return False
    state.ints[i, 0, STUCK] += 1
    return state.ints[i, 0, STUCK] >= patience  # type: ignore[no-any-return]


@inlined
def recovers(i: int, percept: Any, arrays: Any, random: float, action: Any) -> bool:
    """Write the action of robot `i` if it recovers from stagnation, and return whether it does."""
    state, patience = arrays.state, arrays.parameters[PATIENCE]
    distance, x, y = nearest(i, percept.targets)
    if patience <= 0.0 or distance == math.inf or distance == 0.0:
        state.floats[i, 0, _LAST_X] = 0.0
        state.floats[i, 0, _LAST_Y] = 0.0
        return False
    moves = _shift(i, percept, state, x, y) > _STILL * percept.speed[i]
    if state.ints[i, 0, LEFT] == 0:
        if not _is_due(i, state, distance <= arrays.parameters[CONTACT], moves, patience):
            return False
        _begin(i, state, patience, random)
    state.ints[i, 0, LEFT] -= 1
    state.ints[i, 0, BEHAVIOUR] = -1
    x, y = turned_by(x / distance, y / distance, state.floats[i, 0, _TURN])
    go(action, i, x, y, percept.speed[i])
    return True


# The numbers and the whole numbers that a robot keeps; see `recovers`.
_NUMBERS, _COUNTERS = 3, 5


@dataclass(frozen=True)
class Vehicle(CompiledPolicy):
    """The base class of policies with the behaviours avoid, goal, slow, follow and find.

    Each behaviour is a Braitenberg vehicle: a left and a right reading drive a left and a right wheel. The mean of the
    wheels is the distance of the step, as a share of the speed; half their difference, times `agility`, is the
    rotation. An arbiter selects the behaviour by twelve cues, thresholded readings.

    Parameters
    ----------
    obstacle_range : float
        Distance within which robots ahead are obstacles [length].
    slow_range : float
        Distance within which the nearest perceived teammate slows a robot down [length].
    agility : float
        The rotation of one wheel at full speed against the other at full speed backwards [turns], at most 1/2.
    swerve : float
        How much a robot without a goal swerves: the largest difference of its wheels, in [0, 1].
    recovery : bool
        Whether a robot that pushes in vain turns its push, and then goes to another side of the box. It notices by
        odometry whether the box moves.
    patience : int
        Steps of stagnation after which it recovers, and steps that a recovery takes.
    contact : float
        Distance from the centre of the box within which it touches the box [length].

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits.
    """

    obstacle_range: Positive = 1.5
    slow_range: Positive = 3.0
    agility: Annotated[float, Allowed(above=0, most=0.5)] = 0.25
    swerve: Probability = 0.5
    recovery: Flag = True
    patience: Count = 20
    contact: Positive = 2.6

    channels = ("obstacles",)
    draws = 1

    @property
    def parameters(self) -> tuple[float, ...]:
        patience = float(self.patience) if self.recovery else 0.0
        return self.obstacle_range, self.slow_range, self.agility, self.swerve, patience, self.contact

    def start(self, size: int) -> PolicyState:
        """Return the state of robots that do not recover; see `recovers`."""
        return PolicyState(np.zeros((size, 1, _NUMBERS)), np.zeros((size, 1, _COUNTERS), np.int64))


@inlined
def by_priority(cues: int) -> int:
    """Return the first behaviour whose condition holds."""
    if has(cues, 0) or has(cues, 1):
        return AVOID
    if has(cues, 4):
        return GOAL
    if has(cues, 10):
        return SLOW
    return FOLLOW if has(cues, 9) else FIND


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    kept = arrays.state.ints
    for i in range(percept.heading.shape[0]):
        if recovers(i, percept, arrays, noise[0, i], action):
            continue
        kept[i, 0, LAST_CUES] = cues_of(i, percept, arrays.parameters)
        kept[i, 0, BEHAVIOUR] = by_priority(kept[i, 0, LAST_CUES])
        behave(kept[i, 0, BEHAVIOUR], i, percept, arrays.parameters, noise[0, i], action)


@dataclass(frozen=True)
class FixedPriority(Vehicle):
    """The behaviour of the highest priority whose condition holds: avoid, goal, slow, follow, find.

    *Avoid* acts if a robot is ahead within `obstacle_range`; *goal* if the box is sensed, and goes to it; *slow* if the
    nearest perceived teammate is ahead within `slow_range`; *follow* if it is ahead anywhere, and goes to it; *find*
    wanders.

    Parameters
    ----------
    obstacle_range, slow_range, agility, swerve, recovery, patience, contact
        As for `Vehicle`.

    Notes
    -----
    *Source:* C. R. Kube and H. Zhang, "Collective robotics: from social insects to robots" (Adaptive Behavior 2(2),
    1994), as Touzet (2000, §9) reports it; the order is recalled, not verified. *Departs:* sensors, wires and ranges
    are ours. Walls reflect, so there is no need to avoid them. Recovery comes before all behaviours.
    """

    kernel = _decide
