"""The features of the evolved policy: what a robot derives from its percept and state, in units of the sensing range.

A robot's state is one table of `ROWS` rows with `FIELDS` numbers: a row for each target track (the track, then features
of the target), a row for the robot itself, and a row in which the inputs of a network are assembled.
"""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.evolved.layout import CONTEXT, OWN_OFFSET, OWN_SLOPE
from teamsight.policies.handmade.target_tracks import AGE, RELAYED, STEP_X, STEP_Y, X, Y

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
def is_seen(ints: Any, slot: int) -> bool:
    """Return whether the robot itself sees the target of a track now."""
    return bool(ints[slot, AGE] == 0) & bool(ints[slot, RELAYED] == 0)


@inlined
def write_targets(i: int, count: int, percept: Any, state: Any, constants: Any) -> tuple[int, float]:
    """Write the features of each track; return how many targets are seen, and how many of them are its own."""
    floats = state.floats[i]
    per_reach = 1.0 / percept.sensing_range[i]
    seen = 0
    mine = 0.0
    for slot in range(count):
        x = floats[slot, X] * per_reach
        y = floats[slot, Y] * per_reach
        distance = math.sqrt(x * x + y * y)
        floats[slot, DISTANCE] = distance
        _write_rivals(i, slot, x, y, percept, floats, state.ints[i], count)
        lead = floats[slot, RIVAL_DISTANCE] - distance
        edge = lead * constants[OWN_SLOPE] + constants[OWN_OFFSET]
        own = 0.5 + 0.5 * edge / (1.0 + abs(edge))
        floats[slot, OWN] = own
        if is_seen(state.ints[i], slot):
            seen += 1
            mine += own
    for slot in range(count):
        floats[slot, COMPANY] = _company(slot, count, floats, per_reach)
    return seen, mine


@inlined
def _write_rivals(i: int, slot: int, x: float, y: float, percept: Any, floats: Any, ints: Any, count: int) -> None:
    """Write the distance and load of the teammate nearest to a target, and the number of teammates in range."""
    teammates = percept.teammates
    per_reach = 1.0 / percept.sensing_range[i]
    nearest = NO_RIVAL
    rival = -1
    rivals = 0
    for k in range(teammates.start[i], teammates.start[i + 1]):
        way_x = x - teammates.offset[k, 0] * per_reach
        way_y = y - teammates.offset[k, 1] * per_reach
        distance = math.sqrt(way_x * way_x + way_y * way_y)
        rivals += distance < 1.0
        if distance < nearest:
            nearest = distance
            rival = k
    floats[slot, RIVAL_DISTANCE] = nearest
    floats[slot, RIVALS] = rivals
    floats[slot, RIVAL_LOAD] = load(rival, percept, floats, ints, count, per_reach) if rival >= 0 else 0.0


@inlined
def load(teammate: int, percept: Any, floats: Any, ints: Any, count: int, per_reach: float) -> float:
    """Return how many of the targets in the robot's sight are in range of a teammate."""
    x = percept.teammates.offset[teammate, 0]
    y = percept.teammates.offset[teammate, 1]
    found = 0
    for slot in range(count):
        way_x = (floats[slot, X] - x) * per_reach
        way_y = (floats[slot, Y] - y) * per_reach
        found += is_seen(ints, slot) & (way_x * way_x + way_y * way_y < 1.0)
    return float(found)


@inlined
def _company(slot: int, count: int, floats: Any, per_reach: float) -> float:
    """Return how many of its other targets the robot could keep in range together with this one."""
    company = 0.0
    for other in range(count):
        if other != slot:
            way_x = (floats[slot, X] - floats[other, X]) * per_reach
            way_y = (floats[slot, Y] - floats[other, Y]) * per_reach
            company += floats[other, OWN] * max(1.0 - 0.5 * math.sqrt(way_x * way_x + way_y * way_y), 0.0)
    return company


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
def put_target(slot: int, floats: Any, ints: Any, per_reach: float) -> None:
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
