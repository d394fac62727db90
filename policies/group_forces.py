"""Forces of targets that depend on which teammate holds them: a policy with few constants, made to be learned."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from teamsight.core.elementary import exp
from teamsight.core.kernel import inlined, lowest_bit
from teamsight.policies.constants import ConstantsPolicy, ends
from teamsight.policies.evolved import company, few, find_rivals
from teamsight.policies.handmade.target_tracks import (
    AGE,
    IDENTITY,
    STEP_X,
    STEP_Y,
    USED,
    X,
    Y,
    update_target_tracks,
)
from teamsight.policies.interface import PolicyState

#: The constants, by name with their shape, in their order. Distances are in sensing ranges, those of teammates in
#: awareness ranges.
#:
#: - law: force of a target of the robot's own at the distances 0, 0.4, 0.6, 0.8, 0.9 and 1
#: - margin, bias, held: a target is the robot's own if it is nearer than the nearest teammate, by a soft edge of this
#:   width, with this advance, and with this further advance if it was the robot's own before
#: - company, rivals, away: relative growth of the force with the own targets near it, with the teammates in range of
#:   it, and with its speed away from the robot
#: - lead, decay: steps by which the direction leads a target; how fast a lost target is forgotten (its square root)
#: - idle_taken, busy_taken: force of targets of others on a robot without and with targets of its own: constant, by
#:   the distance of the nearest teammate from it, and (idle) by the targets in range of that teammate
#: - idle_teammate, busy_teammate: force of teammates, on idle robots at the distances 0, 1/2 and 1
#: - idle_forward, busy_forward: force along the heading
BLOCKS = {
    "law": (6,), "margin": (1,), "bias": (1,), "held": (1,), "company": (1,), "rivals": (1,), "away": (1,),
    "lead": (1,), "decay": (1,), "idle_taken": (3,), "busy_taken": (2,), "idle_teammate": (3,), "busy_teammate": (1,),
    "idle_forward": (1,), "busy_forward": (1,),
}  # fmt: skip
*_ENDS, SIZE = ends(BLOCKS)
_LAW = 0
(
    _MARGIN, _BIAS, _HELD, _COMPANY, _RIVALS, _AWAY, _LEAD, DECAY, _IDLE_TAKEN, _BUSY_TAKEN, _IDLE_TEAMMATE,
    _BUSY_TEAMMATE, _IDLE_FORWARD, _BUSY_FORWARD,
) = _ENDS  # fmt: skip

#: The constants before any learning: those of the team by hand with f = d², nearly: only own targets exert a force, and
#: a robot without one goes straight on.
BY_HAND = {
    "law": [0.0, 0.16, 0.36, 0.64, 0.81, 1.0], "margin": [0.0], "bias": [0.0], "held": [0.0], "company": [0.0],
    "rivals": [0.0], "away": [0.0], "lead": [0.0], "decay": [1.0], "idle_taken": [0.0] * 3, "busy_taken": [0.0] * 2,
    "idle_teammate": [0.0] * 3, "busy_teammate": [0.0], "idle_forward": [0.01], "busy_forward": [0.0],
}  # fmt: skip

#: The standard deviation of each constant at the start of a search, by name.
SPREADS = dict.fromkeys(BLOCKS, 0.1) | {
    "margin": 0.05, "bias": 0.05, "held": 0.05, "company": 0.3, "rivals": 0.3, "away": 0.3, "lead": 1.0, "decay": 0.3,
    "idle_forward": 0.05, "busy_forward": 0.05,
}  # fmt: skip

TRACKS = 24
# Fields of a track after its position and step.
HELD, WEIGHT, OWN, RIVAL, RIVALS, LOAD = range(4, 10)
FIELDS = 10
# The identity of the target of which HELD was written, after the integer fields of a track.
HELD_OF = 4
# Distance from a target beyond which no teammate is its rival, and that of targets without any [sensing ranges].
_NO_RIVAL = 2.0
_NARROWEST = 1e-3
FARTHEST, OLDEST = 1.6, 30.0
# A lost target that counts for less is left out.
_LEAST_WEIGHT = 0.05
# Weaker forces are rounding.
_LEAST_FORCE = 1e-6


@inlined
def weigh(used: Any, floats: Any, ints: Any, decay: float) -> Any:
    """Write by how much each track counts; return a word with a bit for each that counts at all."""
    kept = np.uint64(0)
    while used != 0:
        slot, used = lowest_bit(used)
        age = float(ints[slot, AGE])
        weight = exp(-age * decay * decay) if age > 0.0 else 1.0
        floats[slot, WEIGHT] = weight
        if weight >= _LEAST_WEIGHT:
            kept |= np.uint64(1) << slot
    return kept


@inlined
def share(i: int, kept: Any, before: Any, fade: float, constants: Any, percept: Any, state: Any) -> float:
    """Write of each track its rivals and how far it is the robot's own; return the sum of the latter.

    `before` is a word with a bit for each track that was in use at the last decision. A rival that is perceived no
    longer is taken to be farther from the target by `fade` than at the last decision.
    """
    floats = state.floats[i]
    ints = state.ints[i]
    per_range = 1.0 / percept.sensing_range[i]
    mine = 0.0
    slots = kept
    while slots != 0:
        slot, slots = lowest_bit(slots)
        x = floats[slot, X] * per_range
        y = floats[slot, Y] * per_range
        nearest, rivals, load = find_rivals(i, x, y, percept, floats, kept, _NO_RIVAL)
        is_old = before >> slot & np.uint64(1) != 0 and ints[slot, HELD_OF] == ints[slot, IDENTITY]
        if is_old:
            nearest = min(nearest, floats[slot, RIVAL] + fade)
        floats[slot, RIVAL] = nearest
        floats[slot, RIVALS] = rivals
        floats[slot, LOAD] = load
        held = floats[slot, HELD] if is_old else 0.5
        lead = nearest - math.sqrt(x * x + y * y) + constants[_BIAS] + constants[_HELD] * (held - 0.5)
        held = min(max(0.5 + lead / max(abs(constants[_MARGIN]), _NARROWEST), 0.0), 1.0)
        floats[slot, HELD] = held
        ints[slot, HELD_OF] = ints[slot, IDENTITY]
        floats[slot, OWN] = held * floats[slot, WEIGHT]
        mine += floats[slot, OWN]
    return mine


@inlined
def _law(constants: Any, distance: float) -> float:
    """Return the force of an own target: linear between the knots 0, 0.4, 0.6, 0.8, 0.9 and 1, constant beyond."""
    if distance < 0.4:
        at = 2.5 * distance
    elif distance < 0.8:
        at = 1.0 + 5.0 * (distance - 0.4)
    else:
        at = min(3.0 + 10.0 * (distance - 0.8), 5.0)
    knot = min(int(at), 4)
    force: float = constants[_LAW + knot] + (at - knot) * (constants[_LAW + knot + 1] - constants[_LAW + knot])
    return force


@inlined
def pull(idle: float, kept: Any, constants: Any, floats: Any, per_range: float) -> tuple[float, float]:
    """Return the sum of the forces of all tracks."""
    force_x = 0.0
    force_y = 0.0
    slots = kept
    while slots != 0:
        slot, slots = lowest_bit(slots)
        x = floats[slot, X] * per_range
        y = floats[slot, Y] * per_range
        step_x = floats[slot, STEP_X] * per_range
        step_y = floats[slot, STEP_Y] * per_range
        distance = math.sqrt(x * x + y * y)
        per_distance = 1.0 / max(distance, 1e-9)
        own = floats[slot, OWN]
        pull = own * _law(constants, distance)
        pull *= 1.0 + constants[_COMPANY] * few(company(slot, kept, OWN, floats, per_range))
        pull *= 1.0 + constants[_RIVALS] * few(floats[slot, RIVALS])
        pull *= 1.0 + constants[_AWAY] * 10.0 * (x * step_x + y * step_y) * per_distance
        alone = constants[_IDLE_TAKEN] + constants[_IDLE_TAKEN + 1] * floats[slot, RIVAL]
        alone += constants[_IDLE_TAKEN + 2] * few(floats[slot, LOAD])
        taken = idle * alone
        taken += (1.0 - idle) * (constants[_BUSY_TAKEN] + constants[_BUSY_TAKEN + 1] * floats[slot, RIVAL])
        pull = (pull + (floats[slot, WEIGHT] - own) * taken) * per_distance
        force_x += pull * (x + constants[_LEAD] * step_x)
        force_y += pull * (y + constants[_LEAD] * step_y)
    return force_x, force_y


@inlined
def push(i: int, idle: float, constants: Any, percept: Any) -> tuple[float, float]:
    """Return the sum of the forces of all perceived teammates, and of that along the heading."""
    teammates = percept.teammates
    forward = idle * constants[_IDLE_FORWARD] + (1.0 - idle) * constants[_BUSY_FORWARD]
    force_x = forward * percept.heading[i, 0]
    force_y = forward * percept.heading[i, 1]
    for k in range(teammates.start[i], teammates.start[i + 1]):
        at = 2.0 * min(teammates.distance[k] / percept.awareness_range[i], 1.0)
        knot = min(int(at), 1)
        low = constants[_IDLE_TEAMMATE + knot]
        force = idle * (low + (at - knot) * (constants[_IDLE_TEAMMATE + knot + 1] - low))
        force += (1.0 - idle) * constants[_BUSY_TEAMMATE]
        force /= max(teammates.distance[k], 1e-9)
        force_x += force * teammates.offset[k, 0]
        force_y += force * teammates.offset[k, 1]
    return force_x, force_y


@inlined
def go_along(i: int, x: float, y: float, percept: Any, action: Any) -> None:
    """Make a full step of a robot along a force; straight on without any."""
    length = math.sqrt(x * x + y * y)
    is_force = length > _LEAST_FORCE
    shrink = 1.0 / length if is_force else 0.0
    action.heading[i, 0] = x * shrink if is_force else percept.heading[i, 0]
    action.heading[i, 1] = y * shrink if is_force else percept.heading[i, 1]
    action.distance[i] = percept.speed[i]


@inlined
def decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Make a full step of each robot along the sum of its forces; straight on without any."""
    constants = arrays.parameters
    for i in range(percept.heading.shape[0]):
        floats = arrays.state.floats[i]
        per_range = 1.0 / percept.sensing_range[i]
        before = np.uint64(arrays.state.ints[i, 0, USED])
        used, _ = update_target_tracks(i, percept, arrays.state, FARTHEST * percept.sensing_range[i], OLDEST)
        kept = weigh(used, floats, arrays.state.ints[i], constants[DECAY])
        idle = max(1.0 - share(i, kept, before, math.inf, constants, percept, arrays.state), 0.0)
        x, y = pull(idle, kept, constants, floats, per_range)
        push_x, push_y = push(i, idle, constants, percept)
        x += push_x
        y += push_y
        go_along(i, x, y, percept, action)


@dataclass(frozen=True, repr=False)
class GroupForces(ConstantsPolicy):
    """Make full steps along the forces of own targets, of those that teammates hold, and of teammates.

    A target is the robot's own if no perceived teammate is nearer to it, by a soft edge. How strong each force is, and
    how it depends on the group of targets that the nearest teammate has in range, are `SIZE` constants, few enough to
    be found in an imagined world; see `teamsight.analysis.learning.imagination`.

    Parameters
    ----------
    constants : sequence of float, optional
        The `SIZE` constants, in the order of `BLOCKS`; by default those shipped.

    Raises
    ------
    ValueError
        If there are not `SIZE` of them, or one is not finite.

    Notes
    -----
    *Source:* none; the start, `BY_HAND`, is the team by hand of docs/learning-results.md. It reads odometry
    (``percept.moved``) and the identities of the targets that a robot senses itself, of which it remembers at most 24.
    """

    kernel = decide
    needs = ("teammates",)
    blocks = BLOCKS
    file = Path(__file__).parent / "data" / "group_forces.json"
    cure = "make it again with `teamsight learn imagine`"
    spreads = SPREADS

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, TRACKS, FIELDS)), np.zeros((size, TRACKS, HELD_OF + 1), np.int64))
