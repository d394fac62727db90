"""The decision of the evolved policy: a sum of forces whose strengths come from laws and small networks."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.angles import direction
from teamsight.core.kernel import inlined
from teamsight.policies.evolved import layout as at
from teamsight.policies.evolved import senses as of
from teamsight.policies.evolved.senses import few, load, put_context, put_target, update_self, write_targets
from teamsight.policies.handmade.target_tracks import AGE, STEP_X, STEP_Y, X, Y, update_target_tracks

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
def _pull(i: int, count: int, percept: Any, arrays: Any) -> tuple[float, float]:
    """Return the sum of the forces of all target tracks."""
    constants = arrays.parameters
    floats = arrays.state.floats[i]
    ints = arrays.state.ints[i]
    per_reach = 1.0 / percept.sensing_range[i]
    force_x = 0.0
    force_y = 0.0
    for slot in range(count):
        put_target(slot, floats, ints, per_reach)
        pull = constants[at.TARGET_OUT]
        along = constants[at.TARGET_OUT + 1 + at.TARGET_NEURONS]
        for j in range(at.TARGET_NEURONS):
            first = at.TARGET_HIDDEN + j * (1 + at.TARGET_INPUTS)
            neuron = _neuron(constants, first, floats[of.FEATURES], at.TARGET_INPUTS)
            pull += neuron * constants[at.TARGET_OUT + 1 + j]
            along += neuron * constants[at.TARGET_OUT + 2 + at.TARGET_NEURONS + j]
        pull += _law(constants, at.TARGET_LAW, at.TARGET_KNOTS, floats[slot, of.DISTANCE]) * floats[slot, of.OWN]
        exists = math.exp(-ints[slot, AGE] * constants[at.DECAY] * constants[at.DECAY])
        step_x = floats[slot, STEP_X] * per_reach
        step_y = floats[slot, STEP_Y] * per_reach
        way_x = floats[slot, X] * per_reach + constants[at.LEAD] * step_x
        way_y = floats[slot, Y] * per_reach + constants[at.LEAD] * step_y
        pull /= max(math.sqrt(way_x * way_x + way_y * way_y), 1e-9)
        force_x += exists * (pull * way_x + 10.0 * along * step_x)
        force_y += exists * (pull * way_y + 10.0 * along * step_y)
    return force_x, force_y


@inlined
def _push(i: int, count: int, percept: Any, arrays: Any) -> tuple[float, float]:
    """Return the sum of the forces of all perceived teammates."""
    constants = arrays.parameters
    teammates = percept.teammates
    floats = arrays.state.floats[i]
    features = floats[of.FEATURES]
    per_reach = 1.0 / percept.sensing_range[i]
    force_x = 0.0
    force_y = 0.0
    for k in range(teammates.start[i], teammates.start[i + 1]):
        distance = teammates.distance[k] / percept.awareness_range[i]
        features[at.CONTEXT] = 2.0 * distance - 1.0
        features[at.CONTEXT + 1] = few(load(k, percept, floats, arrays.state.ints[i], count, per_reach))
        force = constants[at.TEAMMATE_OUT] + _law(constants, at.TEAMMATE_LAW, at.TEAMMATE_KNOTS, distance)
        for j in range(at.TEAMMATE_NEURONS):
            first = at.TEAMMATE_HIDDEN + j * (1 + at.TEAMMATE_INPUTS)
            force += _neuron(constants, first, features, at.TEAMMATE_INPUTS) * constants[at.TEAMMATE_OUT + 1 + j]
        force /= max(teammates.distance[k], 1e-9)
        force_x += force * teammates.offset[k, 0]
        force_y += force * teammates.offset[k, 1]
    return force_x, force_y


@inlined
def _drive(i: int, percept: Any, arrays: Any) -> tuple[float, float]:
    """Return the forces from memory: forward, off the trail, off teammates met, to the middle of the ground."""
    constants = arrays.parameters
    floats = arrays.state.floats[i]
    state = floats[of.STATE]
    context = floats[of.FEATURES]
    forward = _sum(constants, at.DRIVE, context, at.CONTEXT)
    fresh = _sum(constants, at.DRIVE + 1 + at.CONTEXT, context, at.CONTEXT)
    old = 0.2 * _sum(constants, at.DRIVE + 2 * (1 + at.CONTEXT), context, at.CONTEXT)
    met = 3.0 * _sum(constants, at.DRIVE + 3 * (1 + at.CONTEXT), context, at.CONTEXT)
    middle = _sum(constants, at.DRIVE + 4 * (1 + at.CONTEXT), context, at.CONTEXT)
    middle_x = 0.5 * (state[of.LEFT] + state[of.RIGHT])
    middle_y = 0.5 * (state[of.BOTTOM] + state[of.TOP])
    middle /= 1.0 + math.sqrt(middle_x * middle_x + middle_y * middle_y)
    force_x = forward * percept.heading[i, 0] + fresh * state[of.FRESH_X] + old * state[of.OLD_X]
    force_y = forward * percept.heading[i, 1] + fresh * state[of.FRESH_Y] + old * state[of.OLD_Y]
    return (
        force_x + met * state[of.MET_X] + middle * middle_x,
        force_y + met * state[of.MET_Y] + middle * middle_y,
    )


@inlined
def decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Write the action of each robot: along the sum of its forces, with a speed proportional to its strength."""
    constants = arrays.parameters
    teammates = percept.teammates.start
    for i in range(percept.heading.shape[0]):
        floats = arrays.state.floats[i]
        count = update_target_tracks(i, percept, arrays.state, _FARTHEST * percept.sensing_range[i], _OLDEST)
        seen, mine = write_targets(i, count, percept, arrays.state, constants)
        update_self(i, seen, percept, floats)
        put_context(seen, mine, teammates[i + 1] - teammates[i], floats)
        x, y = _pull(i, count, percept, arrays)
        push_x, push_y = _push(i, count, percept, arrays)
        drive_x, drive_y = _drive(i, percept, arrays)
        x += push_x + drive_x
        y += push_y + drive_y
        if noise[1, i] < constants[at.TURN] * constants[at.TURN] * (1.0 - floats[of.FEATURES, of.MINE]):
            turn_x, turn_y = direction(noise[0, i])
            x += turn_x
            y += turn_y
        length = math.sqrt(x * x + y * y)
        shrink = 1.0 / max(length, 1e-9)
        action.heading[i, 0] = x * shrink if length > 1e-9 else 0.0
        action.heading[i, 1] = y * shrink if length > 1e-9 else 0.0
        action.distance[i] = min(length * abs(constants[at.GAIN]), 1.0) * percept.speed[i]
