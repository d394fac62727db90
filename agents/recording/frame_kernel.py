"""The compiled part of a frame recorder: copy what the page draws after each step, in few bytes.

Recording is so fast that most of its time would go into memory that is used for the first time; so there are two bytes
for a coordinate, and one for a flag, a count or an index, if that is enough.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Packed, Record, kernel

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Shorts = npt.NDArray[np.int16]
Bytes = npt.NDArray[np.uint8]

#: What stands for 1 in a direction.
UNIT = 32_767.0
#: Signed numbers are converted faster, so parts of the box are recorded minus this.
MIDDLE = 32_768
_PRESENT, _ACTIVE, _OBSERVED = 1, 3, 4


class BodyArrays(NamedTuple):
    """The record of a group of n bodies; x and y of a body follow each other.

    Attributes
    ----------
    position, heading : ndarray, shape (2n,), float64
        The arrays of the group [length], flat.
    low, factor : ndarray, shape (2n,), float64
        The lower corner of the box around the arena [length], and the number of parts in a unit of length; n times.
    active : ndarray, shape (n,) or (0,), bool
        Whether each is active; empty if all are.
    """

    position: Annotated[Floats, "coordinates"]
    heading: Annotated[Floats, "coordinates"]
    low: Annotated[Floats, "coordinates"]
    factor: Annotated[Floats, "coordinates"]
    active: Annotated[npt.NDArray[np.bool_], "conditions"]


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
    is_wide : bool
        Whether counts and indices take two bytes: all low ones, then all high ones.
    """

    start: Annotated[Integers, "n + 1"]
    index: Annotated[Integers, ".k"]
    offset: Annotated[Floats, ".offsets", 2]
    in_range: Annotated[Integers, ".in_range"]
    factor: float
    is_wide: bool


BODIES, LINKS = Record(BodyArrays), Record(LinkArrays)
bodies_at, links_at = BODIES.at, LINKS.at


class FrameArrays(NamedTuple):
    """The record of a frame recorder.

    Attributes
    ----------
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    every : int
        Ticks from one frame to the next.
    groups : list of Packed of BodyArrays
        All groups.
    links : list of Packed of LinkArrays
        All relations.
    met : ndarray, shape (bodies,), int64
        When each body was last observed, as in `RelationArrays`; 0 if nothing counts.
    state : ndarray, shape (3,), int64
        The number of frames in these arrays, that of the frames before them, and how often frames were written.
    ticks, begins : ndarray, shape (frames,) and (frames + 1,), int64
        The tick of each frame, and where its bytes begin.
    fixed : ndarray, shape (frames, width), int16
        The positions of all bodies, then their directions.
    stream : ndarray, shape (room,), uint8
        For each frame the flags of all bodies, and for each relation the numbers of links of its observers, and links.
    most : int
        The number of bytes that one frame needs at most.
    """

    moment: Annotated[Integers, 1]
    every: int
    groups: list[Packed[BodyArrays]]
    links: list[Packed[LinkArrays]]
    met: Annotated[Integers, "bodies"]
    state: Annotated[Integers, 3]
    ticks: Annotated[Integers, "frames"]
    begins: Annotated[Integers, "frames + 1"]
    fixed: Annotated[Shorts, "frames", "width"]
    stream: Annotated[Bytes, "room"]
    most: int


FRAMES = Record(FrameArrays)
frames_at = FRAMES.at


@kernel
def _copy_places(groups: Any, row: Any, bodies: int) -> None:
    """Copy positions as parts of the box, and directions."""
    at = 0
    for g in range(groups.shape[0]):
        group = bodies_at(groups[g])
        position, heading, low, factor = group.position, group.heading, group.low, group.factor
        # Unsigned, because numba would check signed indices for negative values.
        first, second = np.uint64(at), np.uint64(2 * bodies + at)
        for i in range(np.uint64(position.shape[0])):
            # Rounding may have carried a body beyond the box, but by far less than half a part.
            row[first + i] = np.int16(np.int32((position[i] - low[i]) * factor[i] + 0.5) - MIDDLE)
        for i in range(np.uint64(position.shape[0])):
            row[second + i] = np.int16(np.int32((heading[i] + 1.0) * UNIT + 0.5) - 32_767)
        at += position.shape[0]


@kernel
def _copy_flags(groups: Any, met: Any, tick: int, stream: Any, at: int) -> None:
    """Copy who is active, and who is observed: stamped with this tick by a step, or with −1 − tick between steps."""
    stamp = tick if tick > 0 else -1
    for i in range(np.uint64(met.shape[0])):
        is_observed = (met[i] == stamp) | (met[i] == -1 - tick)
        stream[np.uint64(at) + i] = np.uint8(_ACTIVE + _OBSERVED * is_observed)
    for g in range(groups.shape[0]):
        group = bodies_at(groups[g])
        for i in range(group.active.shape[0]):
            if not group.active[i]:
                stream[at + i] = _PRESENT
        at += group.position.shape[0] // 2


@kernel
def _copy_counts(start: Any, is_wide: int, stream: Any, at: int) -> int:
    """Copy the numbers of links of observers; return where the next bytes begin."""
    size = max(start.shape[0] - 1, 0)
    for i in range(np.uint64(size)):
        stream[np.uint64(at) + i] = np.uint8(start[i + np.uint64(1)] - start[i])
    if is_wide != 0:
        at += size
        for i in range(np.uint64(size)):
            stream[np.uint64(at) + i] = np.uint8((start[i + np.uint64(1)] - start[i]) >> 8)
    return at + size  # type: ignore[no-any-return]


@kernel
def _copy_links(links: Any, stream: Any, at: int) -> int:
    """Copy the links of a relation; return where the next bytes begin."""
    size = links.start[links.start.shape[0] - 1]
    index, offset = links.index, links.offset
    for k in range(np.uint64(size)):
        stream[np.uint64(at) + k] = np.uint8(index[k])
    at += size
    if links.is_wide != 0:
        for k in range(np.uint64(size)):
            stream[np.uint64(at) + k] = np.uint8(index[k] >> 8)
        at += size
    if offset.shape[0] > 0:
        for axis in range(2):
            for k in range(size):
                part = np.int32(min(max(np.rint(offset[k, axis] * links.factor), -UNIT), UNIT))
                stream[at + k] = np.uint8(part)
                stream[at + size + k] = np.uint8(part >> 8)
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
    at = frames.begins[number]
    if number == frames.ticks.shape[0] or at + frames.most > frames.stream.shape[0]:
        return 1
    bodies = frames.met.shape[0]
    _copy_places(frames.groups, frames.fixed[number], bodies)
    _copy_flags(frames.groups, frames.met, tick, frames.stream, at)
    at += bodies
    for r in range(frames.links.shape[0]):
        links = links_at(frames.links[r])
        at = _copy_counts(links.start, links.is_wide, frames.stream, at)
        at = _copy_counts(links.in_range, links.is_wide, frames.stream, at)
        at = _copy_links(links, frames.stream, at)
    frames.ticks[number] = tick
    number += 1
    frames.begins[number] = at
    state[0] = number
    state[2] += 1
    # Whether there is room for the next one.
    return 1 if number == frames.ticks.shape[0] or at + frames.most > frames.stream.shape[0] else 0


RECORD_FRAME = Entry(_record)
