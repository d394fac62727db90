"""Frames: what a recording keeps of the world at a tick, from the kernel to the chunk that is written."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Awareness
from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.drawing import obstacles, walls
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.records import Bound, Watcher
from teamsight.agents.engine.relation import Relation
from teamsight.agents.group import Group
from teamsight.agents.recording.history import divided
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.world_data import WorldData
from teamsight.core.card import COLOURS
from teamsight.core.checks import shown
from teamsight.core.kernel import Entry, Packed, Record, equal_eight, inlined, put_eight_bytes, put_eight_parts
from teamsight.core.version import __version__
from teamsight.policies.registry import label
from teamsight.view.scene import (
    ACTIVE,
    BLOCKED,
    MOST_OFFSET,
    MOST_PART,
    MOST_SLOTS,
    OBSERVED,
    PRESENT,
    TURN,
    Fact,
    Frame,
    Line,
    LinkList,
    Links,
    Scene,
    SceneGroup,
    Slot,
)
from teamsight.world.arena import Arena, shortest
from teamsight.world.limits import farthest_of

Bytes = npt.NDArray[np.uint8]

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Shorts = npt.NDArray[np.int16]

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
    active, blocked : ndarray, shape (n,), bool
        Whether each is active, and whether another body blocks its way.
    """

    position: Annotated[Floats, "coordinates"]
    heading: Annotated[Floats, "coordinates"]
    active: Annotated[npt.NDArray[np.bool_], "bodies"]
    blocked: Annotated[npt.NDArray[np.bool_], "bodies"]


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
        For each frame a bit for each body that is observed; a byte for each, 1 if it is active plus 2 if it is blocked,
        if they have states; and for each relation where the links of its observers end, and the links.
    most : int
        The number of bytes that one frame writes at most, with `SLACK`.
    has_states : bool
        Whether any body can be inactive or blocked.
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
    has_states: bool


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
        if frames.has_states != 0:
            for i in range(group.active.shape[0]):
                frames.stream[at + i] = group.active[i] + 2 * group.blocked[i]
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


# Of so many bodies, counts and indices fit in a byte.
_MOST_NARROW = 255


class LinkLayout(NamedTuple):
    """The links of one relation.

    Attributes
    ----------
    channel : str
        The channel.
    counts : bool
        Whether what is sensed in it counts.
    measured : bool
        Whether offsets are recorded.
    scale : float
        The offset for which 32,767 stands [length]; 0 if there are none.
    has_range : bool
        Whether the teammates in range are counted apart from those that are shown.
    most : int
        How many links a frame holds; of more it holds none.
    observers, observed : ndarray, shape (n,) and (m,), int64
        The indices of both among all bodies.
    """

    channel: str
    counts: bool
    measured: bool
    scale: float
    has_range: bool
    most: int
    observers: Integers
    observed: Integers

    @property
    def is_wide(self) -> bool:
        """Whether counts and indices take two bytes each."""
        return len(self.observed) > _MOST_NARROW


class Layout(NamedTuple):
    """Which words of a frame are whose.

    Attributes
    ----------
    slots : ndarray, shape (bodies,), int64
        The slot of each body.
    size : int
        The number of slots in frames of this layout.
    has_states : bool
        Whether any body can be inactive or blocked.
    links : tuple of LinkLayout
        The relations.
    """

    slots: Integers
    size: int
    has_states: bool
    links: tuple[LinkLayout, ...]


def _is_same(one: Any, other: Any) -> bool:
    """Whether two tuples of tuples and arrays are equal."""
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(_is_same, one, other))
    return np.array_equal(one, other)


def link_layouts(bound: Bound, arena: Arena, most: int) -> tuple[LinkLayout, ...]:
    """Return the layouts of all relations, of whose links a frame holds at most so many."""

    def bodies(groups: Sequence[Group]) -> Integers:
        rows = [np.arange(len(group)) + bound.first_body[group.number] for group in groups]
        return np.concatenate([np.zeros(0, np.int64), *rows])

    # All relations of a channel are one list in a frame, with offsets or without.
    measured = {relation.name for relation in bound.relations if _is_measured(_sensor(relation))}
    return tuple(
        LinkLayout(
            relation.name, relation.counts, relation.name in measured,
            _scale(relation, arena) if relation.name in measured else 0.0,
            relation.name == TEAMMATES and relation.detection is not None, most,
            bodies([relation.observers]), bodies(relation.observed),
        )
        for relation in bound.relations
    )  # fmt: skip


def link_arrays(relation: Relation, layout: LinkLayout) -> LinkArrays:
    """Return what the kernel copies of a relation: what its percepts show."""
    if layout.measured:
        shown = relation.room
        start, index, offset = shown.start, relation.place, shown.offset
    else:
        start, index = relation.true_lists
        offset = np.zeros((0, 2))
    in_range = relation.search.room.start if layout.has_range else np.zeros(0, np.int64)
    factor = UNIT / layout.scale if layout.scale else 0.0
    return LinkArrays(start, index, offset, in_range, factor, layout.is_wide, layout.most)


def most_bytes(arrays: LinkArrays) -> int:
    """Return how many bytes the links of a relation need at most."""
    observers = len(arrays.start) - 1 + max(len(arrays.in_range) - 1, 0)
    links = min(len(arrays.indices), arrays.most)
    return (observers + links) * (1 + arrays.is_wide) + 4 * links * (len(arrays.offset) > 0)


def _sensor(relation: Relation) -> Sensor | None:
    return relation.observers.channels[relation.name].sensor


def _is_measured(sensor: Sensor | None) -> bool:
    """Whether percepts may show agents elsewhere than they are."""
    if sensor is None:
        return False
    is_standard = type(sensor).sense is Sensor.sense and type(sensor).parameters is Sensor.parameters
    return not is_standard or any((sensor.range_noise, sensor.bearing_noise, sensor.false_positives, sensor.delay))


def _scale(relation: Relation, arena: Arena) -> float:
    """Return the largest offset that percepts can show [length]."""
    sensor = _sensor(relation) or Sensor()
    low, high = arena.bounds
    diagonal = float(np.hypot(*(high - low)))
    if type(sensor).sense is not Sensor.sense:
        return diagonal
    # Readings of the package's own sensors end at the range.
    reach = float(relation.observers.reach(relation.name).max(initial=0.0)) if sensor.range is None else sensor.range
    return min(reach * farthest_of(relation.observers.range_shape), diagonal) or diagonal


Words = npt.NDArray[np.uint16]

#: The numbers of each frame, by the names of the history's columns.
SERIES = ("observed", "mean_neighbours", "max_neighbours")
_FEWEST_FRAMES = 8
# The size of a whole number [bytes].
_WORD = 8


class Space(NamedTuple):
    """The box around an arena, shape (2,) and (2,), and its period [length]."""

    low: Floats
    size: Floats
    period: tuple[float, float]


class Chunk:
    """Recorded frames of one layout; `FrameArrays` describes the arrays.

    Parameters
    ----------
    layout : Layout
        The layout of its frames.
    most : int
        The number of bytes of its stream that a frame writes at most, with `SLACK`.
    room : int
        The size of the arrays [bytes], about.
    earlier : int
        The number of frames in earlier chunks.
    """

    def __init__(self, layout: Layout, most: int, room: int, earlier: int) -> None:
        self.layout, self.most = layout, most
        width = 4 * len(layout.slots)
        # Its positions and directions, its tick, and where its stream begins. Half of the memory is for the streams. It
        # is not filled with zeros: a page of it takes memory when something is written there.
        size = 2 * width + 2 * _WORD
        base = np.empty(max(2 * (size * _FEWEST_FRAMES + _WORD + most), room), np.uint8)
        frames = max((len(base) // 2 - _WORD) // size, _FEWEST_FRAMES)
        ends = np.cumsum([_WORD * frames, _WORD * (frames + 1), 2 * width * frames])
        self.ticks, self.begins = base[: ends[0]].view(np.int64), base[ends[0] : ends[1]].view(np.int64)
        self.fixed = base[ends[1] : ends[2]].view(np.int16).reshape(frames, width)
        self.stream = base[ends[2] :]
        self.begins[0] = 0
        self.state = np.array([0, earlier, 0])
        self._made: tuple[tuple[object, ...], list[Frame]] = ((), [])

    def __len__(self) -> int:
        return int(self.state[0])

    @property
    def is_full(self) -> bool:
        """Whether there is no room for one more frame."""
        return len(self) == len(self.ticks) or int(self.begins[len(self)]) + self.most > len(self.stream)

    def close(self) -> None:
        """Give back the room that is not used."""
        frames = len(self)
        self.fixed, self.ticks = self.fixed[:frames].copy(), self.ticks[:frames].copy()
        self.begins = self.begins[: frames + 1].copy()
        self.stream = self.stream[: self.begins[frames]].copy()

    def cut(self, tick: int) -> None:
        """Drop the frames from a tick on."""
        self.state[0] = np.searchsorted(self.ticks[: len(self)], tick)
        self.state[2] += 1

    def frames(self, lists: tuple[LinkList, ...], space: Space) -> list[Frame]:
        """Return the frames, with these lists of links."""
        key = (int(self.state[2]), lists)
        if self._made[0] != key:
            self._made = key, _Reading(self).frames(lists, space)
        return self._made[1]


class _Reading:
    """The arrays of the frames of a chunk."""

    def __init__(self, chunk: Chunk) -> None:
        self._layout, frames = chunk.layout, len(chunk)
        self._stream, self._ticks = chunk.stream, chunk.ticks[:frames]
        bodies = len(self._layout.slots)
        fixed = chunk.fixed[:frames].reshape(frames, 2, bodies, 2)
        # To add half of the range of 16 bits is to change the highest one.
        self._position, self._heading = fixed[:, 0].view(np.uint16) ^ np.uint16(MIDDLE), fixed[:, 1]
        self._at = chunk.begins[:frames]
        self._flags = self._flags_of(bodies)
        self._counts: list[Integers] = []
        self._omitted: list[Integers] = []
        self._in_range: list[Integers] = []
        self._links_at: list[Integers] = []
        for one in self._layout.links:
            ends = self._numbers(len(one.observers), is_wide=one.is_wide)
            counts = _counts_of(ends, is_wide=one.is_wide)
            if one.has_range:
                ends = self._numbers(len(one.observers), is_wide=one.is_wide)
            self._in_range.append(_counts_of(ends, is_wide=one.is_wide))
            self._links_at.append(self._at)
            sizes = counts.sum(axis=1)
            self._omitted.append(np.where(sizes > one.most, sizes, 0))
            self._counts.append(np.where(self._omitted[-1][:, None] > 0, 0, counts))
            bytes_a_link = 1 + one.is_wide + 4 * one.measured
            self._at = self._at + (sizes - self._omitted[-1]) * bytes_a_link

    def _numbers(self, size: int, *, is_wide: bool = False) -> Integers:
        """Return the next numbers of each frame, shape (frames, size)."""
        found: Integers = self._stream[self._at[:, None] + np.arange(size)].astype(np.int64)
        self._at = self._at + size
        if is_wide:
            found += self._stream[self._at[:, None] + np.arange(size)].astype(np.int64) << 8
            self._at = self._at + size
        return found

    def _flags_of(self, bodies: int) -> Words:
        """Return the flags of all bodies, shape (frames, bodies)."""
        bits = self._numbers(-(-bodies // 8)).astype(np.uint8)
        observed = np.unpackbits(bits, axis=1, bitorder="little")[:, :bodies].astype(np.uint16)
        states = np.ones_like(observed)
        if self._layout.has_states:
            states = self._numbers(bodies).astype(np.uint16)
        active, blocked = states & 1, states >> 1
        return np.asarray(PRESENT + ACTIVE * active + OBSERVED * observed + BLOCKED * blocked, np.uint16)

    def frames(self, lists: Sequence[LinkList], space: Space) -> list[Frame]:
        """Return the frames."""
        heading = self._heading + (MIDDLE - UNIT)
        angle = np.arctan2(heading[..., 1], heading[..., 0])
        turn = np.rint(angle * (TURN / (2 * np.pi))).astype(np.int64).astype(np.uint16)
        parts = (self._position[..., 0], self._position[..., 1], turn, self._flags)
        x, y, turns, flags = (self._by_slot(part) for part in parts)
        links = [self._links(one, space) for one in lists]
        series = self._series()
        return [
            Frame(float(tick), series[k], x[k], y[k], turns[k], flags[k], tuple(one[k] for one in links))
            for k, tick in enumerate(self._ticks.tolist())
        ]

    def _by_slot(self, values: Words) -> Words:
        """Return a column with one entry for each slot, 0 for bodies that are not there."""
        found = np.zeros((len(values), self._layout.size), np.uint16)
        found[:, self._layout.slots] = values
        return found

    def _series(self) -> npt.NDArray[np.float32]:
        """Return the numbers of each frame, shape (frames, 3); see `SERIES`."""
        is_active, links = (self._flags & ACTIVE) > 0, self._layout.links
        counted = np.unique(np.concatenate([np.zeros(0, np.int64), *(one.observed for one in links if one.counts)]))
        observed = ((self._flags[:, counted] & OBSERVED) > 0).sum(axis=1)
        robots, edges = np.zeros((2, len(self._ticks)), np.int64)
        largest = np.zeros(len(self._ticks), np.int64)
        for one, numbers in zip(links, self._in_range, strict=True):
            if one.channel == TEAMMATES:
                robots = robots + is_active[:, one.observers].sum(axis=1)
                edges = edges + numbers.sum(axis=1)
                largest = np.maximum(largest, numbers.max(axis=1, initial=0))
        shares = [divided(observed, is_active[:, counted].sum(axis=1)), divided(edges, robots), largest]
        return np.stack(shares, axis=1).astype(np.float32)

    def _links(self, wanted: LinkList, space: Space) -> list[Links]:
        """Return the links of one list in each frame."""
        numbers = [r for r, one in enumerate(self._layout.links) if one.channel == wanted.channel]
        parts = [self._part(r, wanted, space) for r in numbers]
        if not parts:
            nothing = np.zeros(0, np.uint16)
            offset = nothing.view(np.int16) if wanted.measured else None
            return [Links(nothing, nothing, offset, offset)] * len(self._ticks)
        frame, source, *others = (np.concatenate(column) for column in zip(*parts, strict=True))
        place = (frame.astype(np.int64) << 16) + source.astype(np.int64)
        if (np.diff(place) < 0).any():
            order = np.argsort(place, kind="stable")
            frame, source, others = frame[order], source[order], [column[order] for column in others]
        ends = np.searchsorted(frame, np.arange(len(self._ticks) + 1)).tolist()
        columns: dict[str, Any] = dict(zip(("target", "dx", "dy"), others, strict=False))
        omitted = sum((self._omitted[r] for r in numbers), np.zeros(len(self._ticks), np.int64)).tolist()
        return [
            Links(source[first:last], **{name: one[first:last] for name, one in columns.items()}, omitted=missing)
            for (first, last), missing in zip(pairwise(ends), omitted, strict=True)
        ]

    def _part(self, number: int, wanted: LinkList, space: Space) -> list[npt.NDArray[np.generic]]:
        """Return the links of one relation in all frames: frame, source, target and the offsets."""
        layout, counts = self._layout.links[number], self._counts[number]
        slots, sizes = self._layout.slots, counts.sum(axis=1)
        frame = np.repeat(np.arange(len(sizes)), sizes)
        row = np.repeat(np.tile(layout.observers, len(sizes)), counts.ravel())
        within = np.arange(len(frame)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        begin, size = self._links_at[number][frame], sizes[frame]
        index = self._stream[begin + within].astype(np.int64)
        if layout.is_wide:
            begin = begin + size
            index += self._stream[begin + within].astype(np.int64) << 8
        body = layout.observed[index]
        found = [frame, slots[row].astype(np.uint16), slots[body].astype(np.uint16)]
        if not wanted.measured:
            return found
        if layout.measured:
            low, high = (self._stream[begin + within + np.array([[step], [2 + step]]) * size] for step in (1, 2))
            offset = (low + (high.astype(np.uint16) << 8)).view(np.int16) * (layout.scale / UNIT)
        else:
            part = (self._position[frame, body].astype(np.int64) - self._position[frame, row]) / MOST_PART
            offset = shortest(part * space.size, space.period).T
        parts = np.clip(np.rint(offset * (MOST_OFFSET / wanted.scale)), -MOST_OFFSET, MOST_OFFSET)
        return [*found, *parts.astype(np.int16)]


def _counts_of(ends: Integers, *, is_wide: bool) -> Integers:
    """Return the sizes of lists that end there, of which only the lowest one or two bytes are known."""
    return np.asarray(np.diff(ends, axis=1, prepend=0) & (0xFFFF if is_wide else 0xFF))


_FULL_TURN = 2 * math.pi


def slots_of(group: Group) -> list[Slot]:
    """Return the agents of a group as slots, in the order of its rows."""
    channel = group.channels.get(TARGETS)
    angle = float(getattr(channel and channel.sensor, "field_of_view", _FULL_TURN))
    ranges = (group.bodies[name].tolist() for name in ("sensing_range", "awareness_range", "radius"))
    sensing, awareness, radius = ranges
    return [
        Slot(group.number, identity, sensing[row], awareness[row], angle, radius[row])
        for row, identity in enumerate(group.bodies.identity.tolist())
    ]


def _group(group: Group, *, is_counted: bool) -> SceneGroup:
    (policy, awareness), lidar = group.rules, group.lidar
    role = "robot" if group.team is not None else "target" if is_counted else "other"
    return SceneGroup(
        group.name, role, COLOURS[group.number % len(COLOURS)], group.team,
        None if group.decides_alone else label(policy).strip("'"), _degree(awareness), _facts(group),
        group.range_shape,
        {name: float(getattr(lidar, name)) for name in ("rays", "range", "field_of_view")} if lidar else None,
    )  # fmt: skip


def _degree(awareness: Awareness) -> Mapping[str, Fact] | None:
    """Return a degree of awareness by name, with its options; None for none."""
    if awareness.name == "none":
        return None
    options: list[str] = [one.name for one in fields(awareness)] if is_dataclass(awareness) else []
    return {"name": awareness.name, **{name: _fact(getattr(awareness, name)) for name in options}}


def _facts(group: Group) -> dict[str, Fact]:
    """Return further facts: the class of the agents, their speed, and what they sense by which sensor."""
    speed = group.bodies.speed
    facts: dict[str, Fact] = {"class": group.agent_class.__name__}
    if len(speed) and (speed == speed[0]).all():
        facts["speed"] = float(speed[0])
    for name, channel in group.channels.items():
        if channel.observed:
            groups = " + ".join(one.name for one in channel.observed)
            by = f" by {shown(channel.sensor)}" if channel.sensor is not None else ""
            facts[f"senses {name}"] = f"{groups}{by}"
    return facts


def _fact(value: object) -> Fact:
    """Return a value that JSON has."""
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, int | float | np.number) and math.isfinite(value):
        return value.item() if isinstance(value, np.number) else value
    return shown(value)


def _lines(lines: Iterable[Floats]) -> tuple[Line, ...]:
    return tuple(tuple((x, y) for x, y in line.tolist()) for line in lines)


# More links than any frame has.
_ANY_NUMBER = 2**62
# The size of the first chunk, and of the largest; each is twice as large as the one before [bytes].
_FIRST, _LARGEST = 2**20, 2**25


class FrameRecorder(Watcher):
    """Records frames of a world from now on; begin with `begin`, end with `end`.

    A frame is recorded at each tick that `every` divides, and of the present at the beginning. It shows the world as it
    was when the next step began: after the events of its tick, and after all changes that were made between the steps.

    Parameters
    ----------
    data : WorldData
        The data of the world.
    engine : Engine
        Its engine.
    model : str
        The class of the world, for the scene.
    every : int
        Ticks from one frame to the next.
    title : str, optional
        What is recorded, for people; by default made of the class, the policy and the seed.

    Attributes
    ----------
    most_links : int
        How many links of a relation a frame holds; of more it holds none, and says how many there are.
    when_closed : callable
        Called without arguments when the world is closed; by default `end`.
    """

    entry = RECORD_FRAME
    sees_changes = True
    most_links = _ANY_NUMBER

    def __init__(
        self, data: WorldData, engine: Engine, model: str, *, every: int = 1, title: str | None = None
    ) -> None:
        self._data, self._engine, self._model = data, engine, model
        self.every, self.title = every, title
        self._chunks: list[Chunk] = []
        self._slot_of: dict[int, int] = {}
        self._slots: list[Slot] = []
        self._seed, self._room, self._taken = data.seed, _FIRST, 0
        self._scene: Scene | None = None
        self.when_closed: Callable[[], object] = self.end
        arena = data.arena
        (low, high), (x, y) = arena.bounds, arena.period
        self._space = Space(low.copy(), high - low, arena.period)
        # What never changes in a scene: obstacles may, but a frame does not say which.
        self._bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1])), _lines(walls(arena))
        self._wraps = (float(x), float(y)) if x or y else None

    def begin(self) -> None:
        """Record the present, and every step from now on."""
        self._engine.watch(self)
        try:
            self.update()
        except BaseException:
            self._engine.unwatch(self)
            raise

    def end(self) -> None:
        """Record no more."""
        self._engine.unwatch(self)

    def close(self) -> None:
        """Record no more, since the world is closed."""
        self.when_closed()

    @property
    def is_recording(self) -> bool:
        """Whether steps are recorded."""
        return any(watcher is self for watcher in self._data.watchers)

    def update(self) -> None:
        """Record what has changed since the last step; nothing within a step."""
        if self.is_recording and not self._data.timeline.inside:
            self._engine.look()

    def __len__(self) -> int:
        self.update()
        return len(self._numbers())

    def _numbers(self) -> list[tuple[Chunk, int]]:
        """Return for each frame its chunk and its number there; of several of one tick only the last."""
        latest: dict[int, tuple[Chunk, int]] = {}
        for chunk in self._chunks:
            latest.update({tick: (chunk, k) for k, tick in enumerate(chunk.ticks[: len(chunk)].tolist())})
        return list(latest.values())

    @property
    def frames(self) -> list[Frame]:
        """The frames so far, in order of time."""
        self.update()
        lists = self.links
        made = {id(chunk): chunk.frames(lists, self._space) for chunk in self._chunks}
        return [made[id(chunk)][k] for chunk, k in self._numbers()]

    def take(self) -> list[Frame]:
        """Return the frames since the last call, and forget them; for a page that shows a run as it goes on."""
        frames = self.frames
        self._taken += len(frames)
        del self._chunks[:-1]
        for chunk in self._chunks:
            chunk.state[:] = 0, self._taken, chunk.state[2] + 1
        return frames

    @property
    def links(self) -> tuple[LinkList, ...]:
        """The lists of links that each frame has: one for each channel, "teammates" first."""
        found: dict[str, list[LinkLayout]] = {}
        for chunk in self._chunks:
            for one in chunk.layout.links:
                found.setdefault(one.channel, []).append(one)
        return tuple(
            LinkList(
                name, name, any(one.counts for one in found[name]), any(one.measured for one in found[name]),
                max(one.scale for one in found[name]),
            )
            for name in sorted(found, key=lambda name: name != TEAMMATES)
        )  # fmt: skip

    @property
    def scene(self) -> Scene:
        """The scene of the frames so far; the same object as long as nothing in it has changed."""
        groups = self._data.groups
        for group in groups:
            for slot in slots_of(group):
                if (number := self._slot_of.get(slot.id)) is not None:
                    self._slots[number] = slot
        counting = [channel for group in groups for channel in group.channels.values() if channel.counts]
        counted = {one.number for channel in counting for one in channel.observed}
        described = tuple(_group(group, is_counted=group.number in counted) for group in groups)
        seed, title = self._data.seed, self.title
        if title is None:
            policy = next((group.policy for group in described if group.role == "robot"), None)
            title = ", ".join(filter(None, (self._model, policy, f"seed {seed}")))
        scene = Scene(
            title, self._model, __version__, seed, self.every, *self._bounds, _lines(obstacles(self._data.arena)),
            self._wraps, described, tuple(self._slots), SERIES, self.links,
        )  # fmt: skip
        if self._scene is None or self._scene != scene:
            self._scene = scene
        return self._scene

    def outline(self) -> tuple[Scene, Frame]:
        """Return a scene and a frame of where bodies are, without links and numbers, for which nothing is compiled."""
        layout, bodies = self._layout(()), [group.bodies for group in self._data.groups]
        place, ahead = (np.concatenate([one[name] for one in bodies]) for name in ("position", "heading"))
        parts = np.rint((place - self._space.low) * (MOST_PART / self._space.size))
        turn = np.rint(np.arctan2(ahead[:, 1], ahead[:, 0]) * (TURN / _FULL_TURN))
        active, blocked = (np.concatenate([one[name] for one in bodies]) for name in ("active", "blocked"))
        flags = PRESENT + ACTIVE * active + BLOCKED * blocked
        columns = np.zeros((4, layout.size), np.uint16)
        columns[:, layout.slots] = np.stack([*parts.T, turn, flags]).astype(np.int64).astype(np.uint16)
        return self.scene, Frame(float(self._data.timeline.tick), np.full(len(SERIES), np.nan, np.float32), *columns)

    def bind(self, bound: Bound) -> None:
        """Find out whose words are where, and make room for a frame."""
        layouts = link_layouts(bound, self._data.arena, self.most_links)
        arrays = [link_arrays(relation, one) for relation, one in zip(bound.relations, layouts, strict=True)]
        bodies = sum(map(len, bound.groups))
        layout = self._layout(layouts)
        if layout.size > MOST_SLOTS:
            self._give_up()
            return
        chunk = self._chunk(layout, 2 * bodies + sum(map(most_bytes, arrays)) + SLACK)
        records = zip(bound.relations, bound.relation_records, strict=True)
        met = next((record.value.met for relation, record in records if relation.counts), np.zeros(bodies, np.int64))
        groups = [
            BODIES.pack(BodyArrays(one.position.reshape(-1), one.heading.reshape(-1), one.active, one.blocked))
            for one in (group.bodies for group in bound.groups)
        ]
        self.record = FRAMES.pack(FrameArrays(
            bound.moment, self.every, groups, [LINKS.pack(one) for one in arrays], met,
            self._space.low, MOST_PART / self._space.size,
            chunk.state, chunk.ticks, chunk.begins, chunk.fixed, chunk.stream, chunk.most,
            chunk.layout.has_states,
        ))  # fmt: skip

    def _layout(self, links: tuple[LinkLayout, ...]) -> Layout:
        """Return the present layout; bodies that are new get the next slots."""
        slots = []
        for group in self._data.groups:
            for slot in slots_of(group):
                if slot.id not in self._slot_of:
                    self._slot_of[slot.id] = len(self._slots)
                    self._slots.append(slot)
                slots.append(self._slot_of[slot.id])
        has_states = bool(self._data.solid) or any(group.has_conditions for group in self._data.groups)
        return Layout(np.array(slots, np.int64), len(self._slots), has_states, links)

    def _chunk(self, layout: Layout, most: int) -> Chunk:
        """Return the chunk for the next frame: the last one, if it has the layout and room."""
        if self._chunks:
            last = self._chunks[-1]
            # More slots are no reason for another chunk as long as the bodies are the same.
            is_like = _is_same(last.layout._replace(size=0), layout._replace(size=0))
            last.most = max(last.most, most) if is_like else last.most
            if is_like and not last.is_full:
                return last
            if is_like:
                self._room = min(2 * self._room, _LARGEST)
            if not len(last):
                self._chunks.pop()
            elif not is_like:
                last.close()
        earlier = self._taken + sum(map(len, self._chunks))
        self._chunks.append(Chunk(layout, most, self._room, earlier))
        return self._chunks[-1]

    def _give_up(self) -> None:
        """Record no more frames, since further bodies would have no slots."""
        if self.entry is not NO_FRAME:
            self.entry = NO_FRAME
            warnings.warn(
                f"the recording ends at tick {self._data.timeline.tick:,}: more than {MOST_SLOTS:,} agents have come, "
                "and no more can be recorded; record shorter runs",
                stacklevel=2,
            )

    def happened(self) -> None:
        """Begin another chunk, since the last one is full."""
        self._engine.rewatch()

    def forget(self) -> None:
        """Drop the frames from the present tick on, which another run now replaces; all if it has another seed."""
        tick = self._data.timeline.tick
        is_same = self._data.seed == self._seed
        self._seed = self._data.seed
        for chunk in self._chunks:
            chunk.cut(tick if is_same else -1)
        self._chunks = [chunk for chunk in self._chunks if len(chunk)]
        self._taken = 0
        if not self._chunks:
            self._slot_of, self._slots, self._room, self.entry = {}, [], _FIRST, RECORD_FRAME
        self._engine.rewatch()
