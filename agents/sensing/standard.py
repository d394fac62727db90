"""The kernel of `Sensor`: field of view, occlusion, missed detections, noise and false detections."""

from __future__ import annotations

import math
from typing import Any

from teamsight.agents.sensing.noise import NOBODY, normal, uniform, words_of
from teamsight.core.angles import direction
from teamsight.core.kernel import inlined, kernel
from teamsight.world.sight import is_blocked

PER_RADIAN = 1.0 / (2.0 * math.pi)

#: The least distance of a noisy reading [range]: an agent that seems to be at the same place would have no bearing.
NEAREST = 1e-6

#: The parameters of the kernel: the cosine of half the field of view (−2 if that is a full turn), the field of view
#: [turns], standard deviations of distance [length] and bearing [turns], probabilities, and whether sight is blocked.
COSINE, WIDTH, RANGE_NOISE, BEARING_NOISE, MISSED, FALSE_POSITIVES, OCCLUDED = range(7)


@inlined
def _rotated(x: float, y: float, turns: float) -> tuple[float, float]:
    """Return (x, y) turned anticlockwise by any number of turns."""
    cosine, sine = direction(turns - math.floor(turns))
    return cosine * x - sine * y, sine * x + cosine * y


@inlined
def _put(sensed: Any, edge: int, index: int, x: float, y: float, distance: float) -> None:
    sensed.identity[edge] = index
    sensed.offset[edge, 0] = x
    sensed.offset[edge, 1] = y
    sensed.distance[edge] = distance


@inlined
def _put_noisy(view: Any, i: int, k: int, words: Any, parameters: Any, sensed: Any, edge: int) -> None:
    """Write what observer `i` measures of entry `k` of the agents in range."""
    seen = view.in_range
    x = seen.offset[k, 0]
    y = seen.offset[k, 1]
    distance = seen.distance[k]
    if parameters[RANGE_NOISE] > 0.0:
        least = NEAREST * view.reach[i]
        if distance < least:
            x = view.heading[i, 0]
            y = view.heading[i, 1]
            scale = 1.0
        else:
            scale = 1.0 / distance
        distance += parameters[RANGE_NOISE] * normal(words[0])
        distance = min(max(distance, least), view.reach[i])
        x *= distance * scale
        y *= distance * scale
    if parameters[BEARING_NOISE] > 0.0:
        x, y = _rotated(x, y, parameters[BEARING_NOISE] * normal(words[1]))
    _put(sensed, edge, seen.identity[k], x, y, distance)


@inlined
def _candidate(view: Any, i: int, first: int, edge: int, sensed: Any, word: Any) -> int:
    """Return a random agent that is not the observer and not among those that it senses; −1 if there is none."""
    myself = view.own + i if view.own >= 0 else -1
    count = view.everyone.shape[0] - (edge - first) - (myself >= 0)
    if count <= 0:
        return -1
    index = int(uniform(word) * count)
    # Skip those that are excluded, in ascending order; the observer is one of them.
    for k in range(first, edge):
        if 0 <= myself < sensed.identity[k]:
            index += myself <= index
            myself = -1
        index += sensed.identity[k] <= index
    return index + (0 <= myself <= index)


@kernel
def _imagine(view: Any, i: int, first: int, edge: int, parameters: Any, sensed: Any) -> int:
    """Write the false detection of observer `i`, if it has one; return the next entry."""
    words = words_of(view, i, NOBODY)
    if uniform(words[0]) >= parameters[FALSE_POSITIVES]:
        return edge
    index = _candidate(view, i, first, edge, sensed, words[1])
    if index < 0:
        return edge
    at = edge
    while at > first and sensed.identity[at - 1] > index:
        x = sensed.offset[at - 1, 0]
        y = sensed.offset[at - 1, 1]
        _put(sensed, at, sensed.identity[at - 1], x, y, sensed.distance[at - 1])
        at -= 1
    # Uniform over the area in view.
    distance = view.reach[i] * math.sqrt(uniform(words[2]))
    turns = (uniform(words[3]) - 0.5) * parameters[WIDTH]
    x, y = _rotated(view.heading[i, 0], view.heading[i, 1], turns)
    _put(sensed, at, ~index, distance * x, distance * y, distance)
    return edge + 1


@kernel
def sense(view: Any, parameters: Any, sensed: Any) -> int:
    """Write what a `Sensor` senses; see there."""
    seen = view.in_range
    size = view.heading.shape[0]
    is_false = parameters[FALSE_POSITIVES] > 0.0
    most = seen.start[size] + (size if is_false else 0)
    if most > sensed.distance.shape[0]:
        return int(most)
    is_blind = view.sight.segments.shape[0] + view.sight.discs.shape[0] > 0 and parameters[OCCLUDED] > 0.0
    is_random = parameters[RANGE_NOISE] > 0.0 or parameters[BEARING_NOISE] > 0.0 or parameters[MISSED] > 0.0
    edge = 0
    for i in range(size):
        first = edge
        sensed.start[i] = first
        ahead_x = view.heading[i, 0]
        ahead_y = view.heading[i, 1]
        for k in range(seen.start[i], seen.start[i + 1]):
            x = seen.offset[k, 0]
            y = seen.offset[k, 1]
            if x * ahead_x + y * ahead_y < seen.distance[k] * parameters[COSINE]:
                continue
            if is_blind and is_blocked(view.position[i, 0], view.position[i, 1], x, y, view.sight):
                continue
            if not is_random:
                _put(sensed, edge, seen.identity[k], x, y, seen.distance[k])
                edge += 1
                continue
            words = words_of(view, i, view.everyone[seen.identity[k]])
            if uniform(words[2]) >= parameters[MISSED]:
                _put_noisy(view, i, k, words, parameters, sensed, edge)
                edge += 1
        if is_false:
            edge = _imagine(view, i, first, edge, parameters, sensed)
    sensed.start[size] = edge
    return edge
