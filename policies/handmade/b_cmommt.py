"""B-CMOMMT: robots follow targets, help teammates whose targets are about to escape, or explore."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.core.component import Allowed, NonNegative, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.handmade.forces import (
    BEHAVIOURS,
    TURN_PROBABILITY,
    check_ascending,
    idle_step,
    repel,
    repulsion_corners,
    rivals,
)
from teamsight.policies.interface import Integers, PolicyState

WEIGHTS = {"nearest": 0.0, "shared": 1.0, "none": 2.0}

# What a robot does, the integer field MODE of its state.
EXPLORES, FOLLOWS, HELPS = range(3)
# The fields: what it does, the number of requests that it receives now, and the most so far.
MODE, REQUESTS, MOST_REQUESTS = range(3)

_IDLE, _TURN, _WEIGHTS, _ESCAPE, _ANSWER, _REPULSION = range(6)


@inlined
def _weight(k: int, percept: Any, i: int, rule: float) -> float:
    """Return the weight of target `k` of the list, which robot `i` senses: its share in observing it."""
    targets = percept.targets
    if rule == 2.0:
        return 1.0
    if rule == 0.0:
        square = targets.distance[k] * targets.distance[k]
        return 0.0 if rivals(targets.offset[k, 0], targets.offset[k, 1], square, percept, i) > 0 else 1.0
    robots = 1.0
    for other in range(percept.relayed.start[i], percept.relayed.start[i + 1]):
        robots += percept.relayed.identity[other] == targets.identity[k]
    return 1.0 / robots


@inlined
def _is_among(identity: Any, wanted: int, first: int, last: int) -> bool:
    for k in range(first, last):  # noqa: SIM110 (kernels have no generators)
        if identity[k] == wanted:
            return True
    return False


@inlined
def _is_request(k: int, percept: Any, i: int, escape: float) -> bool:
    """Whether entry `k` of the relayed targets asks robot `i` for help, as the first of its target."""
    relayed = percept.relayed
    targets = percept.targets
    near = escape * percept.sensing_range[i]
    if rivals(relayed.offset[k, 0], relayed.offset[k, 1], near * near, percept, i) > 0:
        return False
    wanted = relayed.identity[k]
    if _is_among(targets.identity, wanted, targets.start[i], targets.start[i + 1]):
        return False
    return not _is_among(relayed.identity, wanted, relayed.start[i], k)


@inlined
def _best_request(percept: Any, i: int, escape: float, ints: Any) -> int:
    """Return the entry of the nearest request, or −1; count the requests."""
    relayed = percept.relayed
    best = -1
    requests = 0
    for k in range(relayed.start[i], relayed.start[i + 1]):
        if _is_request(k, percept, i, escape):
            requests += 1
            if best < 0 or relayed.distance[k] < relayed.distance[best]:
                best = k
    ints[i, 0, REQUESTS] = requests
    ints[i, 0, MOST_REQUESTS] = max(ints[i, 0, MOST_REQUESTS], requests)
    return best


@inlined
def _explore(percept: Any, i: int, parameters: Any, noise: Any, action: Any) -> None:
    """Move away from teammates that are near; idle if there are none."""
    teammates = percept.teammates
    per_reach = 1.0 / percept.sensing_range[i]
    x = 0.0
    y = 0.0
    for k in range(teammates.start[i], teammates.start[i + 1]):
        distance = teammates.distance[k]
        force = repel(distance * per_reach, parameters[_REPULSION:]) / max(distance, 1e-300)
        x += force * teammates.offset[k, 0]
        y += force * teammates.offset[k, 1]
    length = math.sqrt(x * x + y * y)
    if length > 1e-9:
        _go(i, x, y, min(length, 1.0) * percept.speed[i], action)
    else:
        idle_step(parameters[_IDLE], parameters[_TURN], i, percept, noise, action)


@inlined
def _go(i: int, x: float, y: float, distance: float, action: Any) -> None:
    length = math.sqrt(x * x + y * y)
    shrink = 1.0 / length if length > 0.0 else 0.0
    action.heading[i, 0] = x * shrink
    action.heading[i, 1] = y * shrink
    action.distance[i] = distance


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    ints = arrays.state.ints
    targets = percept.targets
    for i in range(percept.heading.shape[0]):
        total = 0.0
        x = 0.0
        y = 0.0
        for k in range(targets.start[i], targets.start[i + 1]):
            weight = _weight(k, percept, i, parameters[_WEIGHTS])
            total += weight
            x += weight * targets.offset[k, 0]
            y += weight * targets.offset[k, 1]
        best = _best_request(percept, i, parameters[_ESCAPE], ints)
        if best >= 0 and total < parameters[_ANSWER]:
            ints[i, 0, MODE] = HELPS
            _go(i, percept.relayed.offset[best, 0], percept.relayed.offset[best, 1], percept.speed[i], action)
        elif total > 0.0:
            ints[i, 0, MODE] = FOLLOWS
            x /= total
            y /= total
            _go(i, x, y, math.sqrt(x * x + y * y), action)
        else:
            ints[i, 0, MODE] = EXPLORES
            _explore(percept, i, parameters, noise, action)


@dataclass(frozen=True)
class BCmommt(CompiledPolicy):
    """Follow the centre of the own targets, help a teammate whose target escapes, or explore.

    A target that teammates relay is a request for help if the robot does not sense it itself, and no teammate that it
    perceives is within `escape` times the sensing range of it. A robot whose sensed targets weigh less than `answer`
    in all goes to the nearest request at full speed. Otherwise it goes to the weighted centre of its targets; without
    any, away from teammates, or it is idle.

    Parameters
    ----------
    idle : {"redraw", "wander", "stay"}
        Behaviour of a robot that explores and is near no teammate: turn to a new direction each step, wander, or stay.
    turn_probability : float
        Probability per step with which a robot that wanders turns, in [0, 1].
    weights : {"nearest", "shared", "none"}
        Weight of a sensed target. "nearest": 0 if a perceived teammate is strictly nearer to it, otherwise 1.
        "shared": 1 over the number of robots that are known to sense it. "none": always 1.
    escape : float
        Distance from all that sense it, in sensing ranges, from which on a target is about to escape; in [0, 1].
    answer : float
        Total weight of the sensed targets from which on a robot does not help; at least 0, and 0 for robots that never
        help.
    dr1, dr2 : float
        Force of a teammate on a robot that explores, as in `ACmommt`; both 0 for none.

    Raises
    ------
    ValueError, TypeError
        If an option is unknown, or a constant is outside its limits.

    Notes
    -----
    It needs o(N) awareness, whose range is the range of communication. Of all requests it uses one: of Θ(N) reports,
    an input of Θ(1) with δ = 1. `most_requests` returns how many a robot has received at once.

    *Source:* A. Kolling and S. Carpin, "Multirobot cooperation for surveillance of multiple moving targets – a new
    behavioral approach" (ICRA 2006): robots exchange what they sense, request help when targets are escaping, and
    support the request. *Departs:* we know no predicate of escape, no weights and no ranges of theirs. A request is not
    a message of its own: the receiver infers it from the targets that teammates report and where they are, so its own
    perception decides. The best request is the nearest. That a robot explores by keeping away from teammates is ours.
    """

    idle: Annotated[str, Allowed(choices=BEHAVIOURS)] = "redraw"
    turn_probability: Probability = TURN_PROBABILITY
    weights: Annotated[str, Allowed(choices=WEIGHTS)] = "nearest"
    escape: Probability = 0.8
    answer: NonNegative = 1.0
    dr1: NonNegative = 0.481
    dr2: NonNegative = 0.769

    kernel = _decide
    needs = ("relayed",)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ascending(dr1=self.dr1, dr2=self.dr2)

    @property
    def draws(self) -> int:  # type: ignore[override]
        return BEHAVIOURS[self.idle].draws

    @property
    def parameters(self) -> tuple[float, ...]:
        return (
            BEHAVIOURS[self.idle].number, self.turn_probability, WEIGHTS[self.weights], self.escape, self.answer,
            *repulsion_corners(self.dr1, self.dr2),
        )  # fmt: skip

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 0, 0)), np.zeros((size, 1, 3), np.int64))


def most_requests(state: PolicyState) -> Integers:
    """Return the largest number of requests for help that each robot has received at once, shape (n,).

    Parameters
    ----------
    state : PolicyState
        The state of robots under `BCmommt`, such as ``model.robots.policy_state``.
    """
    return state.ints[:, 0, MOST_REQUESTS].copy()


def modes(state: PolicyState) -> Integers:
    """Return what each robot does since its last decision, shape (n,): `EXPLORES`, `FOLLOWS` or `HELPS`.

    Parameters
    ----------
    state : PolicyState
        The state of robots under `BCmommt`.
    """
    return state.ints[:, 0, MODE].copy()
