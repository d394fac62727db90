"""The compiled part of a frame recorder: copy what the page draws after each step, in few bytes."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.records import GroupArrays, group_at
from teamsight.core.kernel import Entry, Packed, Record, kernel
from teamsight.world.motion import move_at

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Words = npt.NDArray[np.uint16]

#: The rows of a frame that each body has: position (x and y side by side, two rows), direction (two rows), flags.
ROWS_A_BODY = 5
#: What stands for 1 in a direction.
UNIT = 32_767.0
_ACTIVE, _OBSERVED = 3, 4


class LinkArrays(NamedTuple):
    """The record of one relation, of which the links are copied.

    Attributes
    ----------
    start, index : ndarray, shape (n + 1,) and (k,), int64
        Who is shown to each observer, by the index among the observed.
    offset : ndarray, shape (k, 2) or (0, 2), float64
        Where they appear to be [length]; empty if that is not copied.
    in_range : ndarray, shape (n + 1,) or (0,), int64
        As `start`, for the teammates in range; empty unless others are shown.
    factor : float
        What an offset is multiplied with.
    """

    start: Annotated[Integers, "n + 1"]
    index: Annotated[Integers, ".k"]
    offset: Annotated[Floats, ".offsets", 2]
    in_range: Annotated[Integers, ".in_range"]
    factor: float


LINKS = Record(LinkArrays)
links_at = LINKS.at


class FrameArrays(NamedTuple):
    """The record of a frame recorder.

    Attributes
    ----------
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    every : int
        Ticks from one frame to the next.
    groups : list of Packed of GroupArrays
        All groups.
    links : list of Packed of LinkArrays
        All relations whose links are copied.
    met : ndarray, shape (bodies,), int64
        When each body was last observed, as in `RelationArrays`; 0 if nothing counts.
    low, factor : ndarray, shape (2,), float64
        The lower corner of the box around the arena [length], and the number of parts in a unit of length.
    state : ndarray, shape (3,), int64
        The number of frames in these arrays, that of the frames before them, and how often frames were written.
    ticks, begins : ndarray, shape (frames,) and (frames + 1,), int64
        The tick of each frame, and where its words begin.
    fixed : ndarray, shape (frames, width), uint16
        Positions, directions and flags of all bodies, then the numbers of links of all observers.
    words : ndarray, shape (room,), uint16
        The links of all frames.
    most : int
        The number of words that one frame needs at most.
    """

    moment: Annotated[Integers, 1]
    every: int
    groups: list[Packed[GroupArrays]]
    links: list[Packed[LinkArrays]]
    met: Annotated[Integers, "bodies"]
    low: Annotated[Floats, 2]
    factor: Annotated[Floats, 2]
    state: Annotated[Integers, 3]
    ticks: Annotated[Integers, "frames"]
    begins: Annotated[Integers, "frames + 1"]
    fixed: Annotated[Words, "frames", "width"]
    words: Annotated[Words, "room"]
    most: int


FRAMES = Record(FrameArrays)
frames_at = FRAMES.at


@kernel
def _copy_bodies(groups: Any, low: Any, factor: Any, row: Any, bodies: int) -> None:
    """Copy positions as parts of the box, and directions; mark all that are active."""
    low_x, low_y, factor_x, factor_y = low[0], low[1], factor[0], factor[1]
    at = 0
    for g in range(groups.shape[0]):
        move = move_at(group_at(groups[g]).move)
        position, heading = move.position, move.heading
        size = position.shape[0]
        for i in range(np.uint64(size)):
            # Rounding may have carried a body beyond the box by less than a part.
            x = min(max((position[i, 0] - low_x) * factor_x + 0.5, 0.0), 65535.0)
            y = min(max((position[i, 1] - low_y) * factor_y + 0.5, 0.0), 65535.0)
            row[np.uint64(2 * at) + 2 * i] = np.uint16(np.int32(x))
            row[np.uint64(2 * at + 1) + 2 * i] = np.uint16(np.int32(y))
        first = 2 * (bodies + at)
        for i in range(np.uint64(size)):
            row[np.uint64(first) + 2 * i] = np.uint16(np.int32(np.rint(heading[i, 0] * UNIT)))
            row[np.uint64(first + 1) + 2 * i] = np.uint16(np.int32(np.rint(heading[i, 1] * UNIT)))
        first = 4 * bodies + at
        for i in range(size):
            row[first + i] = _ACTIVE
        for i in range(move.active.shape[0]):
            if not move.active[i]:
                row[first + i] = 1
        at += size


@kernel
def _mark_observed(met: Any, tick: int, row: Any, bodies: int) -> None:
    """Mark the bodies that are observed: stamped with this tick by a step, or with −1 − tick between steps."""
    stamp = tick if tick > 0 else -1
    for i in range(np.uint64(met.shape[0])):
        is_observed = (met[i] == stamp) | (met[i] == -1 - tick)
        row[np.uint64(4 * bodies) + i] |= np.uint16(_OBSERVED * is_observed)


@kernel
def _copy_counts(start: Any, row: Any, at: int) -> int:
    """Copy the numbers of links of observers; return where the next begin."""
    size = start.shape[0] - 1
    for i in range(np.uint64(max(size, 0))):
        row[np.uint64(at) + i] = np.uint16(start[i + 1] - start[i])
    return at + max(size, 0)  # type: ignore[no-any-return]


@kernel
def _copy_links(links: Any, words: Any, at: int) -> int:
    """Copy the links of a relation; return where the next begin."""
    size = links.start[links.start.shape[0] - 1]
    index, offset, factor = links.index, links.offset, links.factor
    for k in range(np.uint64(size)):
        words[np.uint64(at) + k] = np.uint16(index[k])
    at += size
    if offset.shape[0] > 0:
        for k in range(np.uint64(size)):
            for axis in range(2):
                part = min(max(np.rint(offset[k, axis] * factor), -32767.0), 32767.0)
                words[np.uint64(at) + 2 * k + np.uint64(axis)] = np.uint16(np.int32(part))
        at += 2 * size
    return at


def _record(address: int) -> int:
    frames = frames_at(address)
    state, tick = frames.state, frames.moment[0]
    number = state[0]
    if number > 0 and frames.ticks[number - 1] == tick:
        # The world has changed between two steps.
        number -= 1
    elif number + state[1] > 0 and frames.every > 1 and tick % frames.every != 0:
        return 0
    word = frames.begins[number]
    if number == frames.ticks.shape[0] or word + frames.most > frames.words.shape[0]:
        return 1
    row = frames.fixed[number]
    bodies = frames.met.shape[0]
    _copy_bodies(frames.groups, frames.low, frames.factor, row, bodies)
    _mark_observed(frames.met, tick, row, bodies)
    at = ROWS_A_BODY * bodies
    for r in range(frames.links.shape[0]):
        links = links_at(frames.links[r])
        at = _copy_counts(links.start, row, at)
        at = _copy_counts(links.in_range, row, at)
        word = _copy_links(links, frames.words, word)
    frames.ticks[number] = tick
    number += 1
    frames.begins[number] = word
    state[0] = number
    state[2] += 1
    # Whether there is room for the next one.
    return 1 if number == frames.ticks.shape[0] or word + frames.most > frames.words.shape[0] else 0


RECORD_FRAME = Entry(_record)
