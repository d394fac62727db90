"""False detections: agents that are sensed where they are not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.agents.sensing.noise import NOBODY, uniform, words_of
from teamsight.agents.sensing.parameters import FALSE_POSITIVES, WIDTH
from teamsight.agents.sensing.writing import put
from teamsight.core.angles import direction
from teamsight.core.kernel import inlined, kernel
from teamsight.world.noise import philox


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


@inlined
def _turned(x: float, y: float, turns: float) -> tuple[float, float]:
    """Return a direction rotated by a number of full turns."""
    cosine, sine = direction(turns - math.floor(turns))
    return cosine * x - sine * y, sine * x + cosine * y


@inlined
def _perimeter_of(x: float, y: float) -> float:
    """Return how far along the sides of the square of half-width 1 a direction points: 0 to 8, from (1, −1) on."""
    wide = abs(x)
    high = abs(y)
    if wide >= high:
        return 1.0 + y / wide if x > 0.0 else 5.0 - y / wide
    return 3.0 - x / high if y > 0.0 else 7.0 + x / high


@inlined
def _on_square(heading_x: float, heading_y: float, width: float, share: float) -> tuple[float, float]:
    """Return the point of the sides of the square of half-width 1 at this share of the field of view.

    All sides are at the same distance from the centre. So equal lengths of them, seen from there, cover equal areas.
    """
    x, y = _turned(heading_x, heading_y, -0.5 * width)
    first = _perimeter_of(x, y)
    length = 8.0
    if width < 1.0:
        x, y = _turned(heading_x, heading_y, 0.5 * width)
        length = _perimeter_of(x, y) - first
        length = length + 8.0 if length < 0.0 else length
    at = first + share * length
    at = at - 8.0 if at >= 8.0 else at
    if at < 2.0:
        return 1.0, at - 1.0
    if at < 4.0:
        return 3.0 - at, 1.0
    return (-1.0, 5.0 - at) if at < 6.0 else (at - 7.0, -1.0)


@kernel
def _imagine(view: Any, i: int, first: int, edge: int, parameters: Any, sensed: Any) -> int:
    """Write a false detection of observer `i`, if it does not sense all others; return the next entry."""
    words = words_of(view, i, NOBODY)
    index = _candidate(view, i, first, edge, sensed, words[1])
    if index < 0:
        return edge
    at = edge
    while at > first and sensed.identity[at - 1] > index:
        x = sensed.offset[at - 1, 0]
        y = sensed.offset[at - 1, 1]
        put(sensed, at, sensed.identity[at - 1], x, y, sensed.distance[at - 1])
        at -= 1
    # Uniform over the area in view.
    away = view.reach[i] * math.sqrt(uniform(words[2]))
    if view.farthest > 1.0:
        x, y = _on_square(view.heading[i, 0], view.heading[i, 1], parameters[WIDTH], uniform(words[3]))
        put(sensed, at, ~index, away * x, away * y, away * math.sqrt(x * x + y * y))
    else:
        x, y = _turned(view.heading[i, 0], view.heading[i, 1], (uniform(words[3]) - 0.5) * parameters[WIDTH])
        put(sensed, at, ~index, away * x, away * y, away)
    return edge + 1


@inlined
def _draw(view: Any, first: int, chance: Any) -> None:
    """Draw for the observers from `first` on whether they have a false detection, as many as there is room for."""
    tick = np.uint64(view.tick[0])
    stream = np.uint64(view.stream)
    k0 = view.key[0] ^ view.salt[0]
    k1 = view.key[1] ^ view.salt[1]
    # In SIMD lanes, unlike the rest, which few observers need.
    for c in range(np.uint64(min(chance.shape[0], view.member.shape[0] - first))):
        member = np.uint64(view.member[np.uint64(first) + c])
        words = philox(tick, member, np.uint64(NOBODY), stream, k0, k1)
        chance[c] = uniform(words[0])


@inlined
def close_rows(view: Any, parameters: Any, here: int, until: int, edge: Any, sensed: Any, chance: Any) -> int:
    """End the entries of the observers from `here` to `until` − 1 with their false detections; return the next.

    `chance` is work space. All observers are closed once, in ascending order.
    """
    for i in range(here, until):
        at = i % chance.shape[0]
        if at == 0:
            _draw(view, i, chance)
        if chance[at] < parameters[FALSE_POSITIVES]:
            edge = _imagine(view, i, sensed.start[i], edge, parameters, sensed)
        sensed.start[i + 1] = edge
    return edge  # type: ignore[no-any-return]
