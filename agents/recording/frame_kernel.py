"""The compiled part of a frame recorder: copy what the page draws after each step, in few bytes.

A step of thirty bodies takes less than two microseconds, and recording may take a tenth of that. Most of it goes into
memory that is used for the first time; so there are two bytes for a coordinate, and one for an index, if that is
enough. Loops go by eights, since compilers make of a loop of thirty one that goes by 32 or one by one. All kernels but
the entries are `inlined`: passing arrays to functions that are not cost two thirds of the time.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Packed, Record, equal_eight, inlined, put_eight_bytes, put_eight_parts

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Shorts = npt.NDArray[np.int16]
Bytes = npt.NDArray[np.uint8]

#: Numbers are recorded minus this: two bytes with a sign are made faster.
MIDDLE = 32_768
#: What stands for 1 in an offset, and for the half turn from −1 to 1 in a direction.
UNIT = 32_767.0
#: How many more bytes than needed may be written after a frame.
SLACK = 8
_LANES = 8


class BodyArrays(NamedTuple):
    """The record of a group of n bodies.

    Attributes
    ----------
    position, heading : ndarray, shape (2n,), float64
        The arrays of the group [length], flat: x and y of a body follow each other.
    active : ndarray, shape (n,), bool
        Whether each is active.
    """

    position: Annotated[Floats, "coordinates"]
    heading: Annotated[Floats, "coordinates"]
    active: Annotated[npt.NDArray[np.bool_], "bodies"]


class LinkArrays(NamedTuple):
    """The record of one relation, of which the links are copied.

    Attributes
    ----------
    start, indices : ndarray, shape (n + 1,) and (k,), int64
        Who is shown to each observer, by the index among the observed.
    offset : ndarray, shape (k, 2) or (0, 2), float64
        Where they appear to be [length]; empty if that is not copied.
    in_range : ndarray, shape (n + 1,) or (0,), int64
        As `start`, for the teammates in range; empty unless others are shown.
    factor : float
        What an offset is multiplied with.
    is_wide : bool
        Whether counts and indices take two bytes: all low ones, then all high ones.
    most : int
        How many links a frame holds; of more it holds where the lists end, and no link.
    """

    start: Annotated[Integers, "n + 1"]
    indices: Annotated[Integers, ".k"]
    offset: Annotated[Floats, ".offsets", 2]
    in_range: Annotated[Integers, ".in_range"]
    factor: float
    is_wide: bool
    most: int


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
    low, factor : ndarray, shape (2,), float64
        The lower corner of the box around the arena [length], and the number of parts in a unit of length.
    state : ndarray, shape (3,), int64
        The number of frames in these arrays, that of the frames before them, and how often frames were written.
    ticks, begins : ndarray, shape (frames,) and (frames + 1,), int64
        The tick of each frame, and where its bytes begin.
    fixed : ndarray, shape (frames, width), int16
        The positions of all bodies, then their directions.
    stream : ndarray, shape (room,), uint8
        For each frame a bit for each body that is observed; a byte for each, whether it is active, if any can be
        inactive; and for each relation where the links of its observers end, and the links.
    most : int
        The number of bytes that one frame writes at most, with `SLACK`.
    is_conditional : bool
        Whether any body can be inactive.
    """

    moment: Annotated[Integers, 1]
    every: int
    groups: list[Packed[BodyArrays]]
    links: list[Packed[LinkArrays]]
    met: Annotated[Integers, "bodies"]
    low: Annotated[Floats, 2]
    factor: Annotated[Floats, 2]
    state: Annotated[Integers, 3]
    ticks: Annotated[Integers, "frames"]
    begins: Annotated[Integers, "frames + 1"]
    fixed: Annotated[Shorts, "frames", "width"]
    stream: Annotated[Bytes, "room"]
    most: int
    is_conditional: bool


FRAMES = Record(FrameArrays)
frames_at = FRAMES.at


@inlined
def _put_parts(values: Any, low: Any, factor: Any, row: Any, at: int) -> None:
    """Write the parts of all values, eight at a time; the last eight may overlap with those before."""
    size = values.shape[0]
    if size >= _LANES:
        for first in range(0, size, _LANES):
            begin = min(first, size - _LANES)
            put_eight_parts(values, begin, low, factor, row, at + begin)
    else:
        for i in range(size):
            # Rounding may have carried a body beyond the box, but by far less than half a part.
            row[at + i] = np.int16(np.int32((values[i] - low[i % 2]) * factor[i % 2] + 0.5) - MIDDLE)


@inlined
def _put_bytes(values: Any, first: int, size: int, is_wide: int, stream: Any, at: int) -> int:
    """Write the low bytes of some numbers, then the high ones if they are wanted; return where the next bytes begin."""
    k = 0
    if size >= _LANES:
        # The last eight may overlap with those before.
        for k in range(0, size, _LANES):
            begin = min(k, size - _LANES)
            put_eight_bytes(values, first + begin, stream, at + begin)
    elif first + _LANES <= values.shape[0]:
        # More than wanted is written: the next bytes replace it.
        put_eight_bytes(values, first, stream, at)
    else:
        for k in range(size):
            stream[at + k] = np.uint8(values[first + k])
    at += size
    if is_wide == 0:
        return at
    for i in range(size):
        stream[at + i] = np.uint8(values[first + i] >> 8)
    return at + size


@inlined
def _copy_bodies(frames: Any, row: Any, at: int) -> int:
    """Copy positions, directions, and who is observed and active; return where the next bytes begin."""
    bodies = frames.met.shape[0]
    at += (bodies + _LANES - 1) // _LANES
    low, factor = (frames.low[0], frames.low[1]), (frames.factor[0], frames.factor[1])
    first = 0
    for g in range(frames.groups.shape[0]):
        group = bodies_at(frames.groups[g])
        _put_parts(group.position, low, factor, row, first)
        _put_parts(group.heading, (-1.0, -1.0), (UNIT, UNIT), row, 2 * bodies + first)
        first += group.position.shape[0]
        if frames.is_conditional != 0:
            for i in range(group.active.shape[0]):
                frames.stream[at + i] = group.active[i]
            at += group.active.shape[0]
    return at


@inlined
def _copy_observed(met: Any, tick: int, stream: Any, at: int) -> None:
    """Set a bit for each body that is observed."""
    # A step stamps who is observed with its tick, a search between steps with −1 − tick.
    stamp = tick if tick > 0 else -1
    bodies = met.shape[0]
    if bodies >= _LANES:
        for first in range(0, bodies, _LANES):
            begin = min(first, bodies - _LANES)
            stream[at] = equal_eight(met, begin, stamp, -1 - tick) >> np.uint64(first - begin)
            at += 1
    elif bodies > 0:
        bits = 0
        for i in range(bodies):
            bits |= (met[i] == stamp or met[i] == -1 - tick) << i
        stream[at] = bits


@inlined
def _copy_links(links: Any, stream: Any, at: int) -> int:
    """Copy the links of a relation; return where the next bytes begin."""
    observers = links.start.shape[0] - 1
    size = links.start[observers]
    at = _put_bytes(links.start, 1, observers, links.is_wide, stream, at)
    at = _put_bytes(links.in_range, 1, max(links.in_range.shape[0] - 1, 0), links.is_wide, stream, at)
    if size > links.most:
        return at
    at = _put_bytes(links.indices, 0, size, links.is_wide, stream, at)
    if links.offset.shape[0] > 0:
        for axis in range(2):
            for k in range(size):
                part = np.int32(min(max(np.rint(links.offset[k, axis] * links.factor), -UNIT), UNIT))
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
    at = _copy_bodies(frames, frames.fixed[number], at)
    for r in range(frames.links.shape[0]):
        at = _copy_links(links_at(frames.links[r]), frames.stream, at)
    _copy_observed(frames.met, tick, frames.stream, frames.begins[number])
    frames.ticks[number] = tick
    number += 1
    frames.begins[number] = at
    state[0] = number
    state[2] += 1
    # Whether there is room for the next one.
    return 1 if number == frames.ticks.shape[0] or at + frames.most > frames.stream.shape[0] else 0


def _skip(address: int) -> int:
    return 0


RECORD_FRAME, NO_FRAME = Entry(_record), Entry(_skip)
