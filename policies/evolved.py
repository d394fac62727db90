"""The evolved policy: observe targets by forces whose laws were found by evolution."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.core.angles import direction
from teamsight.core.elementary import exp
from teamsight.core.kernel import inlined, lowest_bit, ones
from teamsight.policies.constants import ConstantsPolicy, ends
from teamsight.policies.handmade.target_tracks import (
    AGE,
    STEP_X,
    STEP_Y,
    X,
    Y,
    no_target_tracks,
    update_target_tracks,
)
from teamsight.policies.interface import PolicyState

#: Features of a robot's whole situation.
CONTEXT = 7
#: Further features of a target, and of a teammate.
TARGET_FEATURES, TEAMMATE_FEATURES = 8, 2
TARGET_NEURONS, TEAMMATE_NEURONS = 8, 5
#: Knots of the force laws, a fifth of the range apart.
TARGET_KNOTS, TEAMMATE_KNOTS = 8, 6
#: Forces from memory: forward, away from the recent and the old trail, away from remembered teammates, to the middle.
DRIVES = 5

TARGET_INPUTS = CONTEXT + TARGET_FEATURES
TEAMMATE_INPUTS = CONTEXT + TEAMMATE_FEATURES

#: The shapes of the parts of the vector by name, in order; a neuron is its bias followed by its weights.
BLOCKS = {
    "scalars": (6,),
    "target_law": (TARGET_KNOTS,),
    "teammate_law": (TEAMMATE_KNOTS,),
    "drives": (DRIVES, 1 + CONTEXT),
    "target_hidden": (TARGET_NEURONS, 1 + TARGET_INPUTS),
    "target_out": (2, 1 + TARGET_NEURONS),
    "teammate_hidden": (TEAMMATE_NEURONS, 1 + TEAMMATE_INPUTS),
    "teammate_out": (1, 1 + TEAMMATE_NEURONS),
}
TURN, GAIN, LEAD, OWN_SLOPE, OWN_OFFSET, DECAY = range(6)
# Where the other parts begin.
TARGET_LAW, TEAMMATE_LAW, DRIVE, TARGET_HIDDEN, TARGET_OUT, TEAMMATE_HIDDEN, TEAMMATE_OUT, SIZE = ends(BLOCKS)


_HIDDEN_SPREAD = 0.7


#: Parts of the policy whose output can be set to 0 to measure their effect.
SILENCED = ("target network", "teammate network", "both networks", "memory of area and trail")


def silenced(constants: npt.NDArray[np.float64], part: str) -> npt.NDArray[np.float64]:
    """Return the constants with the outputs of a part set to 0."""
    changed = constants.copy()
    if part in ("target network", "both networks"):
        changed[TARGET_OUT:TEAMMATE_HIDDEN] = 0.0
    if part in ("teammate network", "both networks"):
        changed[TEAMMATE_OUT:SIZE] = 0.0
    if part == "memory of area and trail":
        # All drives except the first, forward.
        changed[DRIVE + 1 + CONTEXT : TARGET_HIDDEN] = 0.0
    return changed


def beginning(seed: int) -> npt.NDArray[np.float64]:
    """Return the initial constants: A-CMOMMT's forces, moving straight when idle, and networks without effect.

    Parameters
    ----------
    seed : int
        Seed of the hidden neurons, whose output weights are all 0.

    Returns
    -------
    ndarray, shape (SIZE,), float64
    """
    constants = np.zeros(SIZE)
    constants[[TURN, GAIN, LEAD, OWN_SLOPE, OWN_OFFSET, DECAY]] = 0.22, 1.0, 0.0, 20.0, 0.0, 0.3
    constants[TARGET_LAW : TARGET_LAW + TARGET_KNOTS] = -0.8, 0.2, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0
    constants[TEAMMATE_LAW : TEAMMATE_LAW + TEAMMATE_KNOTS] = -1.0, -1.0, -1.0, -0.5, 0.0, 0.0
    # Forward, unless the robot has targets of its own.
    constants[DRIVE], constants[DRIVE + 2] = 1.0, -1.5
    rng = np.random.default_rng(seed)
    for first, last in ((TARGET_HIDDEN, TARGET_OUT), (TEAMMATE_HIDDEN, TEAMMATE_OUT)):
        constants[first:last] = rng.normal(0.0, _HIDDEN_SPREAD, last - first)
    return constants


TRACKS = 16
STATE, FEATURES = TRACKS, TRACKS + 1
ROWS, FIELDS = TRACKS + 2, 16

# They follow the fields of the target track.
DISTANCE, RIVAL_DISTANCE, RIVAL_LOAD, RIVALS, COMPANY, OWN = range(4, 10)
# Fields of the row for the robot itself.
FRESH_X, FRESH_Y, OLD_X, OLD_Y, MET_X, MET_Y, LEFT, RIGHT, BOTTOM, TOP, SEEN_LATELY, TEAMMATES_LATELY, IDLE = range(13)
# The context: the first inputs of each network.
SEEN, MINE, TEAMMATES, OFTEN_SEEN, OFTEN_TEAMMATES, IDLENESS, EXTENT = range(7)

#: Distance from a target beyond which a teammate does not count as a rival.
NO_RIVAL = 1.5

_FRESH, _OLD, _MET, _LATELY = 0.9, 0.985, 0.95, 0.03


@inlined
def few(count: float) -> float:
    """Return a count mapped to [0, 1): 0 for none, 1/2 for two."""
    return count / (count + 2.0)


@inlined
def write_targets(i: int, used: Any, sensed: Any, percept: Any, floats: Any, constants: Any) -> float:
    """Write the features of each track; return how many of the sensed targets are the robot's own."""
    per_reach = 1.0 / percept.sensing_range[i]
    mine = 0.0
    slots = used
    while slots != 0:
        slot, slots = lowest_bit(slots)
        x = floats[slot, X] * per_reach
        y = floats[slot, Y] * per_reach
        distance = math.sqrt(x * x + y * y)
        floats[slot, DISTANCE] = distance
        nearest, rivals, taken = find_rivals(i, x, y, percept, floats, sensed, NO_RIVAL)
        floats[slot, RIVAL_DISTANCE] = nearest
        floats[slot, RIVALS] = rivals
        floats[slot, RIVAL_LOAD] = taken
        lead = nearest - distance
        edge = lead * constants[OWN_SLOPE] + constants[OWN_OFFSET]
        own = 0.5 + 0.5 * edge / (1.0 + abs(edge))
        floats[slot, OWN] = own
        if sensed >> slot & np.uint64(1) != 0:
            mine += own
    slots = used
    while slots != 0:
        slot, slots = lowest_bit(slots)
        floats[slot, COMPANY] = company(slot, used, OWN, floats, per_reach)
    return mine


@inlined
def find_rivals(
    i: int, x: float, y: float, percept: Any, floats: Any, tracks: Any, none: float
) -> tuple[float, float, float]:
    """Return the distance of the teammate nearest to a target, the number of teammates in range of it, and its load.

    `none` is the distance beyond which there is none; `tracks` is a word with a bit for each track that may be a load.
    """
    teammates = percept.teammates
    per_reach = 1.0 / percept.sensing_range[i]
    nearest = none
    rival = -1
    rivals = 0.0
    for k in range(teammates.start[i], teammates.start[i + 1]):
        way_x = x - teammates.offset[k, 0] * per_reach
        way_y = y - teammates.offset[k, 1] * per_reach
        distance = math.sqrt(way_x * way_x + way_y * way_y)
        rivals += distance < 1.0
        if distance < nearest:
            nearest = distance
            rival = k
    return nearest, rivals, load(rival, percept, floats, tracks, per_reach) if rival >= 0 else 0.0


@inlined
def load(teammate: int, percept: Any, floats: Any, tracks: Any, per_reach: float) -> float:
    """Return how many of these tracks of the robot are in range of a teammate."""
    x = percept.teammates.offset[teammate, 0]
    y = percept.teammates.offset[teammate, 1]
    found = 0
    slots = tracks
    while slots != 0:
        slot, slots = lowest_bit(slots)
        way_x = (floats[slot, X] - x) * per_reach
        way_y = (floats[slot, Y] - y) * per_reach
        found += way_x * way_x + way_y * way_y < 1.0
    return float(found)


@inlined
def company(slot: Any, tracks: Any, own: int, floats: Any, per_reach: float) -> float:
    """Return how many of its other targets the robot could keep in range together with this one.

    `own` is the field of a track that says how far it is the robot's own.
    """
    found = 0.0
    others = tracks & ~(np.uint64(1) << slot)
    while others != 0:
        other, others = lowest_bit(others)
        way_x = (floats[slot, X] - floats[other, X]) * per_reach
        way_y = (floats[slot, Y] - floats[other, Y]) * per_reach
        found += floats[other, own] * max(1.0 - 0.5 * math.sqrt(way_x * way_x + way_y * way_y), 0.0)
    return found


@inlined
def update_self(i: int, seen: int, percept: Any, floats: Any) -> None:
    """Update the row for the robot: its trail, teammates met, the known ground, and what it saw recently."""
    state = floats[STATE]
    per_reach = 1.0 / percept.sensing_range[i]
    moved_x = percept.moved[i, 0] * per_reach
    moved_y = percept.moved[i, 1] * per_reach
    teammates = percept.teammates.start[i + 1] - percept.teammates.start[i]
    state[IDLE] = 0.0 if seen > 0 else state[IDLE] + 1.0
    state[SEEN_LATELY] += _LATELY * (few(seen) - state[SEEN_LATELY])
    state[TEAMMATES_LATELY] += _LATELY * (few(teammates) - state[TEAMMATES_LATELY])
    state[FRESH_X] = _FRESH * (state[FRESH_X] - moved_x)
    state[FRESH_Y] = _FRESH * (state[FRESH_Y] - moved_y)
    state[OLD_X] = _OLD * (state[OLD_X] - moved_x)
    state[OLD_Y] = _OLD * (state[OLD_Y] - moved_y)
    state[LEFT] = min(state[LEFT] - moved_x, 0.0)
    state[RIGHT] = max(state[RIGHT] - moved_x, 0.0)
    state[BOTTOM] = min(state[BOTTOM] - moved_y, 0.0)
    state[TOP] = max(state[TOP] - moved_y, 0.0)
    _extend_ground(state, percept.targets, percept.targets.start[i], percept.targets.start[i + 1], per_reach)
    _extend_ground(state, percept.teammates, percept.teammates.start[i], percept.teammates.start[i + 1], per_reach)
    _update_met(i, percept, state)


@inlined
def _extend_ground(state: Any, seen: Any, first: int, last: int, per_reach: float) -> None:
    """Extend the known ground to all visible bodies."""
    for k in range(first, last):
        x = seen.offset[k, 0] * per_reach
        y = seen.offset[k, 1] * per_reach
        state[LEFT] = min(state[LEFT], x)
        state[RIGHT] = max(state[RIGHT], x)
        state[BOTTOM] = min(state[BOTTOM], y)
        state[TOP] = max(state[TOP], y)


@inlined
def _update_met(i: int, percept: Any, state: Any) -> None:
    """Update the average direction away from teammates."""
    teammates = percept.teammates
    x = 0.0
    y = 0.0
    for k in range(teammates.start[i], teammates.start[i + 1]):
        share = 1.0 / max(teammates.distance[k], 1e-9) - 1.0 / percept.awareness_range[i]
        x -= share * teammates.offset[k, 0]
        y -= share * teammates.offset[k, 1]
    state[MET_X] = _MET * state[MET_X] + (1.0 - _MET) * x
    state[MET_Y] = _MET * state[MET_Y] + (1.0 - _MET) * y


@inlined
def put_context(seen: int, mine: float, teammates: int, floats: Any) -> None:
    """Write the features of the whole situation, each between 0 and about 1."""
    state = floats[STATE]
    context = floats[FEATURES]
    extent = 0.5 * max(state[RIGHT] - state[LEFT], state[TOP] - state[BOTTOM])
    context[SEEN] = few(seen)
    context[MINE] = few(mine)
    context[TEAMMATES] = few(teammates)
    context[OFTEN_SEEN] = state[SEEN_LATELY]
    context[OFTEN_TEAMMATES] = state[TEAMMATES_LATELY]
    context[IDLENESS] = state[IDLE] / (state[IDLE] + 20.0)
    context[EXTENT] = extent / (extent + 3.0)


@inlined
def put_target(slot: Any, floats: Any, ints: Any, per_reach: float) -> None:
    """Write the features of a target track."""
    features = floats[FEATURES]
    distance = floats[slot, DISTANCE]
    lead = floats[slot, RIVAL_DISTANCE] - distance
    away = (floats[slot, X] * floats[slot, STEP_X] + floats[slot, Y] * floats[slot, STEP_Y]) * per_reach * per_reach
    age = float(ints[slot, AGE])
    features[CONTEXT] = 2.0 * distance - 1.0
    features[CONTEXT + 1] = floats[slot, RIVAL_DISTANCE] / 0.75 - 1.0
    features[CONTEXT + 2] = min(max(3.0 * lead, -1.5), 1.5)
    features[CONTEXT + 3] = few(floats[slot, RIVALS])
    features[CONTEXT + 4] = few(floats[slot, COMPANY])
    features[CONTEXT + 5] = 10.0 * away / max(distance, 1e-9)
    features[CONTEXT + 6] = age / (age + 5.0)
    features[CONTEXT + 7] = few(floats[slot, RIVAL_LOAD])


_FARTHEST = 1.6
_OLDEST = 30.0


@inlined
def _law(constants: Any, first: int, knots: int, distance: float) -> float:
    """Return a force that is linear between knots a fifth of the range apart, and constant beyond the last."""
    place = min(max(5.0 * distance, 0.0), knots - 1.0)
    knot = min(int(place), knots - 2)
    share = place - knot
    force: float = constants[first + knot] * (1.0 - share) + constants[first + knot + 1] * share
    return force


@inlined
def _sum(constants: Any, first: int, features: Any, count: int) -> float:
    total: float = constants[first]
    for j in range(count):
        total += constants[first + 1 + j] * features[j]
    return total


@inlined
def _neuron(constants: Any, first: int, features: Any, count: int) -> float:
    total = _sum(constants, first, features, count)
    return total / (1.0 + abs(total))


@inlined
def _pull(i: int, used: Any, percept: Any, arrays: Any) -> tuple[float, float]:
    """Return the sum of the forces of all target tracks."""
    constants = arrays.parameters
    floats = arrays.state.floats[i]
    ints = arrays.state.ints[i]
    per_reach = 1.0 / percept.sensing_range[i]
    force_x = 0.0
    force_y = 0.0
    while used != 0:
        slot, used = lowest_bit(used)
        put_target(slot, floats, ints, per_reach)
        pull = constants[TARGET_OUT]
        along = constants[TARGET_OUT + 1 + TARGET_NEURONS]
        for j in range(TARGET_NEURONS):
            first = TARGET_HIDDEN + j * (1 + TARGET_INPUTS)
            neuron = _neuron(constants, first, floats[FEATURES], TARGET_INPUTS)
            pull += neuron * constants[TARGET_OUT + 1 + j]
            along += neuron * constants[TARGET_OUT + 2 + TARGET_NEURONS + j]
        pull += _law(constants, TARGET_LAW, TARGET_KNOTS, floats[slot, DISTANCE]) * floats[slot, OWN]
        exists = exp(-ints[slot, AGE] * constants[DECAY] * constants[DECAY])
        step_x = floats[slot, STEP_X] * per_reach
        step_y = floats[slot, STEP_Y] * per_reach
        way_x = floats[slot, X] * per_reach + constants[LEAD] * step_x
        way_y = floats[slot, Y] * per_reach + constants[LEAD] * step_y
        pull /= max(math.sqrt(way_x * way_x + way_y * way_y), 1e-9)
        force_x += exists * (pull * way_x + 10.0 * along * step_x)
        force_y += exists * (pull * way_y + 10.0 * along * step_y)
    return force_x, force_y


@inlined
def _push(i: int, sensed: Any, percept: Any, arrays: Any) -> tuple[float, float]:
    """Return the sum of the forces of all perceived teammates."""
    constants = arrays.parameters
    teammates = percept.teammates
    floats = arrays.state.floats[i]
    features = floats[FEATURES]
    per_reach = 1.0 / percept.sensing_range[i]
    force_x = 0.0
    force_y = 0.0
    for k in range(teammates.start[i], teammates.start[i + 1]):
        distance = teammates.distance[k] / percept.awareness_range[i]
        features[CONTEXT] = 2.0 * distance - 1.0
        features[CONTEXT + 1] = few(load(k, percept, floats, sensed, per_reach))
        force = constants[TEAMMATE_OUT] + _law(constants, TEAMMATE_LAW, TEAMMATE_KNOTS, distance)
        for j in range(TEAMMATE_NEURONS):
            first = TEAMMATE_HIDDEN + j * (1 + TEAMMATE_INPUTS)
            force += _neuron(constants, first, features, TEAMMATE_INPUTS) * constants[TEAMMATE_OUT + 1 + j]
        force /= max(teammates.distance[k], 1e-9)
        force_x += force * teammates.offset[k, 0]
        force_y += force * teammates.offset[k, 1]
    return force_x, force_y


@inlined
def _drive(i: int, percept: Any, arrays: Any) -> tuple[float, float]:
    """Return the forces from memory: forward, off the trail, off teammates met, to the middle of the ground."""
    constants = arrays.parameters
    floats = arrays.state.floats[i]
    state = floats[STATE]
    context = floats[FEATURES]
    forward = _sum(constants, DRIVE, context, CONTEXT)
    fresh = _sum(constants, DRIVE + 1 + CONTEXT, context, CONTEXT)
    old = 0.2 * _sum(constants, DRIVE + 2 * (1 + CONTEXT), context, CONTEXT)
    met = 3.0 * _sum(constants, DRIVE + 3 * (1 + CONTEXT), context, CONTEXT)
    middle = _sum(constants, DRIVE + 4 * (1 + CONTEXT), context, CONTEXT)
    middle_x = 0.5 * (state[LEFT] + state[RIGHT])
    middle_y = 0.5 * (state[BOTTOM] + state[TOP])
    middle /= 1.0 + math.sqrt(middle_x * middle_x + middle_y * middle_y)
    force_x = forward * percept.heading[i, 0] + fresh * state[FRESH_X] + old * state[OLD_X]
    force_y = forward * percept.heading[i, 1] + fresh * state[FRESH_Y] + old * state[OLD_Y]
    return (
        force_x + met * state[MET_X] + middle * middle_x,
        force_y + met * state[MET_Y] + middle * middle_y,
    )


@inlined
def decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Write the action of each robot: along the sum of its forces, with a speed proportional to its strength."""
    constants = arrays.parameters
    teammates = percept.teammates.start
    for i in range(percept.heading.shape[0]):
        floats = arrays.state.floats[i]
        farthest = _FARTHEST * percept.sensing_range[i]
        used, sensed = update_target_tracks(i, percept, arrays.state, farthest, _OLDEST)
        mine = write_targets(i, used, sensed, percept, floats, constants)
        seen = ones(sensed)
        update_self(i, seen, percept, floats)
        put_context(seen, mine, teammates[i + 1] - teammates[i], floats)
        x, y = _pull(i, used, percept, arrays)
        push_x, push_y = _push(i, sensed, percept, arrays)
        drive_x, drive_y = _drive(i, percept, arrays)
        x += push_x + drive_x
        y += push_y + drive_y
        if noise[1, i] < constants[TURN] * constants[TURN] * (1.0 - floats[FEATURES, MINE]):
            turn_x, turn_y = direction(noise[0, i])
            x += turn_x
            y += turn_y
        length = math.sqrt(x * x + y * y)
        shrink = 1.0 / max(length, 1e-9)
        action.heading[i, 0] = x * shrink if length > 1e-9 else 0.0
        action.heading[i, 1] = y * shrink if length > 1e-9 else 0.0
        action.distance[i] = min(length * abs(constants[GAIN]), 1.0) * percept.speed[i]


_MADE = {"command": str, "trials": int, "robot_steps": int, "version": str}


@dataclass(frozen=True, repr=False)
class Evolved(ConstantsPolicy):
    """Observe targets by evolved forces, with memories of targets, teammates, the own trail and the ground.

    Each target and each teammate exerts a force. A piecewise linear law and a small network compute its strength from
    its distance, the distance of teammates from it, whether it moves away, how many other targets are near it, how
    crowded the place was recently, and the size of the known ground. Five further forces come from the memories. The
    policy was evolved under `RingAwareness(16)` and runs under every degree that shows teammates. Without teammates it
    would observe less than a random walk, and is refused.

    Parameters
    ----------
    constants : sequence of float, optional
        The `SIZE` constants of the policy, in the order of its `BLOCKS`; by default those shipped.

    Raises
    ------
    ValueError
        If there are not `SIZE` of them, or one is not finite.

    Notes
    -----
    *Source:* none; the evolution starts with Parker's forces. Made by ``teamsight evolve train``; see
    docs/evolved.md. A robot handles at most 16 targets, sensed or remembered. It reads odometry (``percept.moved``)
    and a compass, the heading in the world's frame.
    """

    kernel = decide
    draws = 2
    needs = ("teammates",)
    blocks = BLOCKS
    file = Path(__file__).parent / "data" / "evolved.json"
    cure = "make it again with `teamsight evolve train`"
    spreads: ClassVar[Mapping[str, float]] = {"target_hidden": 2.0, "teammate_hidden": 2.0}

    def start(self, size: int) -> PolicyState:
        return no_target_tracks(size, TRACKS)._replace(floats=np.zeros((size, ROWS, FIELDS)))

    @classmethod
    def beginning(cls, seed: int) -> npt.NDArray[np.float64]:
        return beginning(seed)


def made(path: str | os.PathLike[str] = Evolved.file) -> dict[str, Any]:
    """Return how the constants in a file were made: command, trials, robot_steps and version.

    Raises
    ------
    ValueError
        If the file does not say.
    """
    found = json.loads(Path(path).read_text(encoding="utf-8")).get("made")
    if not isinstance(found, dict) or any(type(found.get(name)) is not kind for name, kind in _MADE.items()):
        raise ValueError(f"{path}: does not say how the constants were made; {Evolved.cure}")
    return found
