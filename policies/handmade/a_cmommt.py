"""A-CMOMMT: Parker's cooperative policy, a sum of force vectors from targets and teammates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.core.component import Allowed, NonNegative, Positive, Probability
from teamsight.core.elementary import exp
from teamsight.core.kernel import inlined, lowest_bit
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.handmade.forces import (
    BEHAVIOURS,
    TURN_PROBABILITY,
    attract,
    attraction_corners,
    check_ascending,
    idle_step,
    repel,
    repulsion_corners,
    rivals,
)
from teamsight.policies.handmade.target_tracks import (
    AGE,
    RELAYED,
    USED,
    Slots,
    X,
    Y,
    no_target_tracks,
    update_target_tracks,
)
from teamsight.policies.interface import PolicyState

WEIGHTS = {"nearest": 0.0, "shared": 1.0, "per-teammate": 2.0, "none": 3.0}
SCALES = {"sensing": 0.0, "awareness": 1.0}
OCCASIONS = {"no-force": 0.0, "nothing-sensed": 1.0}

_IDLE, _WHEN, _WEIGHTS, _SHARED, _LOSS, _SCALE, _OWN, _RELAYED, _TURN, _GAIN = range(10)
_REPULSION = 10
_ATTRACTION = 13
_PREDICTIVE = _ATTRACTION + 3


@inlined
def _weight(x: float, y: float, percept: Any, i: int, parameters: Any) -> Any:
    """Return the weight of the target at (x, y): the assumed probability that no other robot monitors it."""
    rule = parameters[_WEIGHTS]
    if percept.teammates.start[i] == percept.teammates.start[i + 1] or rule == 3.0:
        return 1.0
    reach = percept.sensing_range[i]
    count = rivals(x, y, x * x + y * y if rule == 0.0 else reach * reach, percept, i)
    if rule == 0.0:
        return 0.0 if count > 0 else 1.0
    if count == 0:
        return 1.0
    if rule == 1.0:
        return parameters[_SHARED]
    return max(1.0 - parameters[_LOSS] * count, 0.0)


@inlined
def pull(
    x: float, y: float, distance: float, per_reach: float, percept: Any, i: int, parameters: Any
) -> tuple[float, float]:
    """Return the weighted force of a target at (x, y)."""
    force = attract(distance * per_reach, parameters[_ATTRACTION:])
    # Limits instead of branches, here and below. A target or teammate at the same place exerts no force.
    force *= _weight(x, y, percept, i, parameters) / max(distance, 1e-300)
    return force * x, force * y


@inlined
def push(per_reach: float, percept: Any, i: int, parameters: Any) -> tuple[float, float]:
    """Return the sum of the forces of all perceived teammates."""
    teammates = percept.teammates
    scale = per_reach if parameters[_SCALE] == 0.0 else 1.0 / percept.awareness_range[i]
    x = 0.0
    y = 0.0
    # Unsigned indices here and below: see `rivals`.
    for k in range(np.uint64(teammates.start[i]), np.uint64(teammates.start[i + 1])):
        distance = teammates.distance[k]
        force = repel(distance * scale, parameters[_REPULSION:])
        force /= max(distance, 1e-300)
        x += force * teammates.offset[k, 0]
        y += force * teammates.offset[k, 1]
    return x, y


@inlined
def lost_tracks(i: int, percept: Any, arrays: Any) -> Any:
    """Update the target tracks of robot `i`, if there can be any; return the slots of those that it does not sense."""
    ints = arrays.state.ints
    has_relayed = percept.relayed.start[i + 1] > percept.relayed.start[i]
    has_targets = percept.targets.start[i + 1] > percept.targets.start[i]
    if ints.shape[1] == 0 or not (has_targets or has_relayed or ints[i, 0, USED] != 0):
        return np.uint64(0)
    parameters = arrays.parameters
    oldest = 5.0 * max(parameters[_OWN], parameters[_RELAYED])
    # The largest distance of a relayed target.
    farthest = percept.awareness_range[i] + percept.sensing_range[i]
    if not has_relayed:
        farthest = parameters[_PREDICTIVE] * percept.sensing_range[i]
    used, sensed = update_target_tracks(i, percept, arrays.state, farthest, oldest)
    return used & ~sensed


@inlined
def expectation(i: int, slot: Any, per_reach: float, percept: Any, arrays: Any) -> tuple[float, float]:
    """Return the force of a target that is remembered but not sensed."""
    parameters = arrays.parameters
    state = arrays.state
    x = state.floats[i, slot, X]
    y = state.floats[i, slot, Y]
    decay = parameters[_RELAYED] if state.ints[i, slot, RELAYED] else parameters[_OWN]
    exists = exp(-state.ints[i, slot, AGE] / decay)
    pull_x, pull_y = pull(x, y, math.sqrt(x * x + y * y), per_reach, percept, i, parameters)
    return exists * pull_x, exists * pull_y


@inlined
def act(x: float, y: float, has_lost: bool, i: int, percept: Any, parameters: Any, noise: Any, action: Any) -> None:
    """Write the action of robot `i` on which the force (x, y) acts, and which may remember lost targets."""
    square = x * x + y * y
    if square > 1e-18:
        length = math.sqrt(square)
        shrink = 1.0 / length
        action.heading[i, 0] = x * shrink
        action.heading[i, 1] = y * shrink
        action.distance[i] = min(parameters[_GAIN] * length, 1.0) * percept.speed[i]
    elif parameters[_WHEN] == 0.0 or (
        not has_lost
        and percept.targets.start[i] == percept.targets.start[i + 1]
        and percept.teammates.start[i] == percept.teammates.start[i + 1]
    ):
        idle_step(parameters[_IDLE], parameters[_TURN], i, percept, noise, action)
    else:
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
        action.distance[i] = 0.0


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    targets = percept.targets
    for i in range(percept.heading.shape[0]):
        per_reach = 1.0 / percept.sensing_range[i]
        x, y = push(per_reach, percept, i, parameters)
        for k in range(np.uint64(targets.start[i]), np.uint64(targets.start[i + 1])):
            pull_x, pull_y = pull(
                targets.offset[k, 0], targets.offset[k, 1], targets.distance[k], per_reach, percept, i, parameters
            )
            x += pull_x
            y += pull_y
        # Summed apart, because sums depend on their order.
        lost_x = 0.0
        lost_y = 0.0
        lost = lost_tracks(i, percept, arrays)
        slots = lost
        while slots != 0:
            slot, slots = lowest_bit(slots)
            pull_x, pull_y = expectation(i, slot, per_reach, percept, arrays)
            lost_x += pull_x
            lost_y += pull_y
        act(x + lost_x, y + lost_y, lost != 0, i, percept, parameters, noise, action)


@dataclass(frozen=True)
class ACmommt(CompiledPolicy):
    """Follow targets to which no teammate is nearer, and keep away from teammates.

    A robot moves along the sum F of its forces, by min(`gain` · \\|F\\|, 1) times its speed. Distances are in units of
    the sensing range.

    Parameters
    ----------
    idle : {"redraw", "wander", "stay"}
        Behaviour of an idle robot: turn to a new direction each step, wander, or stay.
    idle_when : {"no-force", "nothing-sensed"}
        When a robot is idle: if no force acts on it, or if it senses nothing at all (it stays while forces cancel).
    weights : {"nearest", "shared", "per-teammate", "none"}
        Weight of a target. "nearest": 0 if a perceived teammate is strictly nearer to it. "shared": `shared_weight` if
        a teammate has it in range. "per-teammate": 1 minus `teammate_loss` for each teammate that has it in range.
        "none": always 1 (Parker's "Local").
    shared_weight : float
        Weight of a target that a teammate has in range, with "shared"; in [0, 1].
    teammate_loss : float
        Weight that a target loses for each teammate that has it in range, with "per-teammate"; in [0, 1].
    do1, do2, do3, predictive : float
        Force of a target: −1 at distance 0, 0 at do1, 1 from do2 to do3, 0 beyond predictive; linear in between.
    dr1, dr2 : float
        Force of a teammate (Fig. 9): −1 up to dr1, 0 beyond dr2; linear in between.
    repulsion_scale : {"sensing", "awareness"}
        The range whose multiples dr1 and dr2 are.
    decay : float
        τ in exp(−age/τ), the assumed probability that a target which was lost from sight still exists [steps].
    relayed_decay : float
        The same τ for a target that was relayed by a teammate [steps].
    target_tracks : int
        Number of targets that a robot remembers, at most 64; 0 for none.
    turn_probability : float
        Probability per step with which an idle robot that wanders turns, in [0, 1]; other idle behaviours do not use
        it. Targets turn with 0.05.
    gain : float
        Gain of the force: share of the speed for each unit of force; above 0.

    Raises
    ------
    ValueError, TypeError
        If an option is unknown, or a constant is outside its limits.

    Notes
    -----
    *Source:* §5 and §7, after L. E. Parker, "Cooperative motion control for multi-target observation" (IROS 1997).
    *Departs:* the paper gives no constants; these are the usual ones (400, 800, 2600, 3000; 1250, 2000; each over
    2600). It does not say how the length of F becomes a speed: with a gain of 1, one full force moves a robot at full
    speed. A remembered target is dropped when it is expected within the sensing range but not sensed. Without teammates
    in the percept all weights are 1.
    """

    idle: Annotated[str, Allowed(choices=BEHAVIOURS)] = "redraw"
    idle_when: Annotated[str, Allowed(choices=OCCASIONS)] = "no-force"
    weights: Annotated[str, Allowed(choices=WEIGHTS)] = "nearest"
    shared_weight: Probability = 0.25
    teammate_loss: Probability = 0.2
    do1: NonNegative = 0.154
    do2: NonNegative = 0.308
    do3: NonNegative = 1.0
    predictive: NonNegative = 1.154
    dr1: NonNegative = 0.481
    dr2: NonNegative = 0.769
    repulsion_scale: Annotated[str, Allowed(choices=SCALES)] = "sensing"
    decay: Positive = 10.0
    relayed_decay: Positive = 5.0
    target_tracks: Slots = 16
    turn_probability: Probability = TURN_PROBABILITY
    gain: Positive = 1.0

    kernel = _decide

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ascending(do1=self.do1, do2=self.do2, do3=self.do3, predictive=self.predictive)
        check_ascending(dr1=self.dr1, dr2=self.dr2)

    @property
    def draws(self) -> int:  # type: ignore[override]
        return BEHAVIOURS[self.idle].draws

    @property
    def parameters(self) -> tuple[float, ...]:
        return (
            BEHAVIOURS[self.idle].number, OCCASIONS[self.idle_when], WEIGHTS[self.weights], self.shared_weight,
            self.teammate_loss, SCALES[self.repulsion_scale], self.decay, self.relayed_decay,
            self.turn_probability, self.gain,
            *repulsion_corners(self.dr1, self.dr2),
            *attraction_corners(self.do1, self.do2, self.do3, self.predictive),
        )  # fmt: skip

    def start(self, size: int) -> PolicyState:
        return no_target_tracks(size, self.target_tracks)
