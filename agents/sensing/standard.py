"""The kernel of `Sensor`: field of view, occlusion, missed detections, noise and false detections.

The agents in range are processed in chunks: select those in view, draw their noise in SIMD lanes, write what is sensed.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from teamsight.agents.sensing.false_detections import close_rows
from teamsight.agents.sensing.interface import Floats, Integers, Words
from teamsight.agents.sensing.noise import normals, rotation, uniform
from teamsight.agents.sensing.parameters import (
    BEARING_NOISE,
    COSINE,
    FALSE_POSITIVES,
    MISSED,
    NEAREST,
    OCCLUDED,
    RANGE_NOISE,
)
from teamsight.agents.sensing.writing import put
from teamsight.core.kernel import inlined, kernel, scratch
from teamsight.world.noise import philox
from teamsight.world.sight import is_blocked

#: The number of agents in range that are processed at once.
CHUNK = 64


class Chunk(NamedTuple):
    """The selected entries of a chunk of the agents in range, and their noise.

    Attributes
    ----------
    entry, row : ndarray, shape (CHUNK,), int64
        The entry of `View.in_range`, and its observer.
    member, identity : ndarray, shape (CHUNK,), uint64
        What selects the noise.
    away, turn, chance : ndarray, shape (CHUNK,), float64
        Two normal numbers, for distance and bearing, and a uniform one.
    cosine, sine : ndarray, shape (CHUNK,), float64
        Of the error of the bearing.
    """

    entry: Integers
    row: Integers
    member: Words
    identity: Words
    away: Floats
    turn: Floats
    chance: Floats
    cosine: Floats
    sine: Floats


@inlined
def _select(view: Any, parameters: Any, span: tuple[int, int, int], chunk: Any) -> tuple[int, int]:
    """Select the entries in view from the first to the last of the span, and note what their noise depends on.

    The span's third number is the observer of the first entry. Returns the number of entries selected, and the observer
    of the last entry.
    """
    seen = view.in_range
    is_blind = view.sight.segments.shape[0] + view.sight.discs.shape[0] > 0 and parameters[OCCLUDED] > 0.0
    # Unsigned here and below: numba would check each signed index for a negative value.
    count = np.uint64(0)
    i = np.uint64(span[2])
    for k in range(np.uint64(span[0]), np.uint64(span[1])):
        while k >= np.uint64(seen.start[i + np.uint64(1)]):
            i += np.uint64(1)
        x = seen.offset[k, 0]
        y = seen.offset[k, 1]
        ahead = x * view.heading[i, 0] + y * view.heading[i, 1]
        is_seen = ahead >= seen.distance[k] * parameters[COSINE]
        if is_blind and is_seen:
            is_seen = not is_blocked(view.position[i, 0], view.position[i, 1], x, y, view.sight)
        # Written in any case, since a branch would be mispredicted.
        chunk.entry[count] = k
        chunk.row[count] = i
        chunk.member[count] = np.uint64(view.member[i])
        chunk.identity[count] = np.uint64(view.everyone[np.uint64(seen.identity[k])])
        count += np.uint64(is_seen)
    found: Any = np.int64(count)
    last: Any = np.int64(i)
    return found, last


@inlined
def _draw(view: Any, parameters: Any, count: int, chunk: Any) -> None:
    """Draw the noise of the selected entries."""
    tick = np.uint64(view.tick[0])
    stream = np.uint64(view.stream)
    k0 = view.key[0] ^ view.salt[0]
    k1 = view.key[1] ^ view.salt[1]
    lanes = np.uint64((count + 7) & ~7)
    for c in range(np.uint64(count), lanes):
        chunk.member[c] = np.uint64(0)
        chunk.identity[c] = np.uint64(0)
    for c in range(lanes):
        first, second, third, _ = philox(tick, chunk.member[c], chunk.identity[c], stream, k0, k1)
        chunk.member[c] = first
        chunk.identity[c] = second
        chunk.chance[c] = uniform(third)
    if parameters[RANGE_NOISE] > 0.0 or parameters[BEARING_NOISE] > 0.0:
        for c in range(lanes):
            chunk.away[c], chunk.turn[c] = normals(chunk.member[c], chunk.identity[c])
    if parameters[BEARING_NOISE] > 0.0:
        for c in range(lanes):
            chunk.cosine[c], chunk.sine[c] = rotation(parameters[BEARING_NOISE] * chunk.turn[c])


@inlined
def _put_noisy(view: Any, parameters: Any, c: int, chunk: Any, sensed: Any, edge: Any) -> None:
    """Write what an observer measures of the selected entry `c`."""
    seen = view.in_range
    k = np.uint64(chunk.entry[c])
    i = np.uint64(chunk.row[c])
    x = seen.offset[k, 0]
    y = seen.offset[k, 1]
    distance = seen.distance[k]
    if parameters[RANGE_NOISE] > 0.0:
        least = NEAREST * view.reach[i]
        scale = 1.0 / distance
        if distance <= least:
            x = view.heading[i, 0]
            y = view.heading[i, 1]
            scale = 1.0
        distance = min(max(distance + parameters[RANGE_NOISE] * chunk.away[c], least), view.reach[i] * view.farthest)
        x *= distance * scale
        y *= distance * scale
    if parameters[BEARING_NOISE] > 0.0:
        x, y = chunk.cosine[c] * x - chunk.sine[c] * y, chunk.sine[c] * x + chunk.cosine[c] * y
    put(sensed, edge, seen.identity[k], x, y, distance)


@inlined
def _append(view: Any, parameters: Any, c: Any, chunk: Any, sensed: Any, edge: Any) -> Any:
    """Write the selected entry `c`, unless it is missed; return the next entry."""
    if parameters[RANGE_NOISE] > 0.0 or parameters[BEARING_NOISE] > 0.0:
        _put_noisy(view, parameters, c, chunk, sensed, edge)
    else:
        seen = view.in_range
        k = np.uint64(chunk.entry[c])
        put(sensed, edge, seen.identity[k], seen.offset[k, 0], seen.offset[k, 1], seen.distance[k])
    # Missed ones are written too, and overwritten by the next, since a branch would be mispredicted.
    return edge + (np.uint64(chunk.chance[c] >= parameters[MISSED]) if parameters[MISSED] > 0.0 else np.uint64(1))


@inlined
def _fill_starts(start: Any) -> None:
    """Write where the entries of each observer begin; so far only those that follow an observer with entries do."""
    end = 0
    for i in range(np.uint64(1), np.uint64(start.shape[0])):
        end = max(end, start[i])
        start[i] = end


@kernel
def sense(view: Any, parameters: Any, sensed: Any) -> int:
    """Write what a `Sensor` senses; see there."""
    size = view.heading.shape[0]
    total = view.in_range.start[size]
    is_false = parameters[FALSE_POSITIVES] > 0.0
    most = total + (size if is_false else 0)
    if most > sensed.distance.shape[0]:
        return int(most)
    chunk = Chunk(
        scratch(CHUNK, np.int64), scratch(CHUNK, np.int64), scratch(CHUNK, np.uint64), scratch(CHUNK, np.uint64),
        scratch(CHUNK, np.float64), scratch(CHUNK, np.float64), scratch(CHUNK, np.float64),
        scratch(CHUNK, np.float64), scratch(CHUNK, np.float64),
    )  # fmt: skip
    chance = scratch(CHUNK, np.float64)
    is_random = parameters[RANGE_NOISE] > 0.0 or parameters[BEARING_NOISE] > 0.0 or parameters[MISSED] > 0.0
    last = 0
    here = 0
    edge = np.uint64(0)
    for i in range(np.uint64(size + 1)):
        sensed.start[i] = 0
    for first in range(0, total, CHUNK):
        count, last = _select(view, parameters, (first, min(first + CHUNK, total), last), chunk)
        if is_random:
            _draw(view, parameters, count, chunk)
        for c in range(np.uint64(count)):
            row = chunk.row[c]
            if is_false and here < row:
                edge = np.uint64(close_rows(view, parameters, here, row, np.int64(edge), sensed, chance))
                here = row
            edge = _append(view, parameters, c, chunk, sensed, edge)
            sensed.start[np.uint64(row) + np.uint64(1)] = edge
    if is_false:
        return int(close_rows(view, parameters, here, size, np.int64(edge), sensed, chance))
    _fill_starts(sensed.start)
    return int(sensed.start[size])
