"""Senses: what a robot with the learned rule makes of its percept and its memory, in sensing ranges.

A robot's memory is one table, `ROWS` rows of `FIELDS` numbers: a row for each target it tracks (its track, then what
it feels of the target), a row for the state of the robot itself, and a row in which the features of one thing are put
together for a network.
"""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.evolved.layout import CONTEXT, OWN_OFFSET, OWN_SLOPE
from teamsight.policies.handmade.target_tracks import AGE, REPORTED, STEP_X, STEP_Y, X, Y

TRACKS = 16
STATE, FEATURES = TRACKS, TRACKS + 1
ROWS, FIELDS = TRACKS + 2, 16

# A track's own fields come first.
DISTANCE, RIVAL_DISTANCE, RIVAL_LOAD, RIVALS, COMPANY, OWN = range(4, 10)
# The state.
FRESH_X, FRESH_Y, OLD_X, OLD_Y, MET_X, MET_Y, LEFT, RIGHT, BOTTOM, TOP, SEEN_LATELY, MATES_LATELY, IDLE = range(13)
# The context, the first of the features.
SEEN, MINE, MATES, OFTEN_SEEN, OFTEN_MATES, IDLENESS, EXTENT = range(7)

#: A teammate farther from a target than this is none.
NO_RIVAL = 1.5

_FRESH, _OLD, _MET, _LATELY = 0.9, 0.985, 0.95, 0.03


@inlined
def few(count: float) -> float:
    """Return 0 for none, 1/2 for two, and up to 1 for many."""
    return count / (count + 2.0)


@inlined
def is_seen(whole: Any, slot: int) -> bool:
    """Return whether a track is that of a target which the robot sees now itself."""
    return bool(whole[slot, AGE] == 0) & bool(whole[slot, REPORTED] == 0)


@inlined
def feel_targets(i: int, count: int, percept: Any, memory: Any, constants: Any) -> tuple[int, float]:
    """Write what the robot feels of each track; return how many targets it sees, and how many of them are its own."""
    real = memory.floats[i]
    per_reach = 1.0 / percept.sensing_range[i]
    seen = 0
    mine = 0.0
    for slot in range(count):
        x = real[slot, X] * per_reach
        y = real[slot, Y] * per_reach
        distance = math.sqrt(x * x + y * y)
        real[slot, DISTANCE] = distance
        _feel_rivals(i, slot, x, y, percept, real, memory.ints[i], count)
        lead = real[slot, RIVAL_DISTANCE] - distance
        edge = lead * constants[OWN_SLOPE] + constants[OWN_OFFSET]
        own = 0.5 + 0.5 * edge / (1.0 + abs(edge))
        real[slot, OWN] = own
        if is_seen(memory.ints[i], slot):
            seen += 1
            mine += own
    for slot in range(count):
        real[slot, COMPANY] = _company(slot, count, real, per_reach)
    return seen, mine


@inlined
def _feel_rivals(i: int, slot: int, x: float, y: float, percept: Any, real: Any, whole: Any, count: int) -> None:
    """Write how far the nearest teammate is from a target, how many targets it has, and how many teammates have it."""
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
    real[slot, RIVAL_DISTANCE] = nearest
    real[slot, RIVALS] = rivals
    real[slot, RIVAL_LOAD] = load(rival, percept, real, whole, count, per_reach) if rival >= 0 else 0.0


@inlined
def load(mate: int, percept: Any, real: Any, whole: Any, count: int, per_reach: float) -> float:
    """Return how many of the targets that the robot sees a teammate has in range."""
    x = percept.teammates.offset[mate, 0]
    y = percept.teammates.offset[mate, 1]
    found = 0
    for slot in range(count):
        way_x = (real[slot, X] - x) * per_reach
        way_y = (real[slot, Y] - y) * per_reach
        found += is_seen(whole, slot) & (way_x * way_x + way_y * way_y < 1.0)
    return float(found)


@inlined
def _company(slot: int, count: int, real: Any, per_reach: float) -> float:
    """Return how many other targets of its own the robot could hold together with this one."""
    company = 0.0
    for other in range(count):
        if other != slot:
            way_x = (real[slot, X] - real[other, X]) * per_reach
            way_y = (real[slot, Y] - real[other, Y]) * per_reach
            company += real[other, OWN] * max(1.0 - 0.5 * math.sqrt(way_x * way_x + way_y * way_y), 0.0)
    return company


@inlined
def remember(i: int, seen: int, percept: Any, real: Any) -> None:
    """Bring the state of the robot up to date: its trail, the teammates met, the ground known, what it saw lately."""
    state = real[STATE]
    per_reach = 1.0 / percept.sensing_range[i]
    moved_x = percept.moved[i, 0] * per_reach
    moved_y = percept.moved[i, 1] * per_reach
    teammates = percept.teammates.start[i + 1] - percept.teammates.start[i]
    state[IDLE] = 0.0 if seen > 0 else state[IDLE] + 1.0
    state[SEEN_LATELY] += _LATELY * (few(seen) - state[SEEN_LATELY])
    state[MATES_LATELY] += _LATELY * (few(teammates) - state[MATES_LATELY])
    state[FRESH_X] = _FRESH * (state[FRESH_X] - moved_x)
    state[FRESH_Y] = _FRESH * (state[FRESH_Y] - moved_y)
    state[OLD_X] = _OLD * (state[OLD_X] - moved_x)
    state[OLD_Y] = _OLD * (state[OLD_Y] - moved_y)
    state[LEFT] = min(state[LEFT] - moved_x, 0.0)
    state[RIGHT] = max(state[RIGHT] - moved_x, 0.0)
    state[BOTTOM] = min(state[BOTTOM] - moved_y, 0.0)
    state[TOP] = max(state[TOP] - moved_y, 0.0)
    _see_ground(state, percept.targets, percept.targets.start[i], percept.targets.start[i + 1], per_reach)
    _see_ground(state, percept.teammates, percept.teammates.start[i], percept.teammates.start[i + 1], per_reach)
    _meet(i, percept, state)


@inlined
def _see_ground(state: Any, seen: Any, first: int, last: int, per_reach: float) -> None:
    """Widen the ground known: where there is a body, there is ground."""
    for k in range(first, last):
        x = seen.offset[k, 0] * per_reach
        y = seen.offset[k, 1] * per_reach
        state[LEFT] = min(state[LEFT], x)
        state[RIGHT] = max(state[RIGHT], x)
        state[BOTTOM] = min(state[BOTTOM], y)
        state[TOP] = max(state[TOP], y)


@inlined
def _meet(i: int, percept: Any, state: Any) -> None:
    """Remember the way off the teammates met."""
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
def put_context(seen: int, mine: float, teammates: int, real: Any) -> None:
    """Write what the robot feels as a whole, each between 0 and about 1."""
    state = real[STATE]
    context = real[FEATURES]
    extent = 0.5 * max(state[RIGHT] - state[LEFT], state[TOP] - state[BOTTOM])
    context[SEEN] = few(seen)
    context[MINE] = few(mine)
    context[MATES] = few(teammates)
    context[OFTEN_SEEN] = state[SEEN_LATELY]
    context[OFTEN_MATES] = state[MATES_LATELY]
    context[IDLENESS] = state[IDLE] / (state[IDLE] + 20.0)
    context[EXTENT] = extent / (extent + 3.0)


@inlined
def put_target(slot: int, real: Any, whole: Any, per_reach: float) -> None:
    """Write what the robot feels of a track."""
    features = real[FEATURES]
    distance = real[slot, DISTANCE]
    lead = real[slot, RIVAL_DISTANCE] - distance
    away = (real[slot, X] * real[slot, STEP_X] + real[slot, Y] * real[slot, STEP_Y]) * per_reach * per_reach
    age = float(whole[slot, AGE])
    features[CONTEXT] = 2.0 * distance - 1.0
    features[CONTEXT + 1] = real[slot, RIVAL_DISTANCE] / 0.75 - 1.0
    features[CONTEXT + 2] = min(max(3.0 * lead, -1.5), 1.5)
    features[CONTEXT + 3] = few(real[slot, RIVALS])
    features[CONTEXT + 4] = few(real[slot, COMPANY])
    features[CONTEXT + 5] = 10.0 * away / max(distance, 1e-9)
    features[CONTEXT + 6] = age / (age + 5.0)
    features[CONTEXT + 7] = few(real[slot, RIVAL_LOAD])
