"""A chunk of recorded frames: the arrays that the kernel fills, and how they become frames."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.recording.frame_kernel import MIDDLE, UNIT
from teamsight.agents.recording.frame_layout import Layout, LinkLayout
from teamsight.agents.recording.spare_memory import give_back, memory
from teamsight.view.frame import ACTIVE, MOST_OFFSET, MOST_PART, OBSERVED, PRESENT, TURN, Frame, Links
from teamsight.view.scene import LinkList
from teamsight.world.period import shortest

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
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
        # Its positions and directions, its tick, and where its stream begins. Half of the memory is for the streams.
        size = 2 * width + 2 * _WORD
        self._memory = base = memory(max(2 * (size * _FEWEST_FRAMES + _WORD + most), room))
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
        self._memory = np.empty(0, np.uint8)

    def release(self) -> None:
        """Give the memory to the next chunk; this one is empty then."""
        self.state[:] = 0
        self._made = ((), [])
        spare, self._memory = self._memory, np.empty(0, np.uint8)
        self.fixed, self.ticks = self.fixed[:0].copy(), self.ticks[:0].copy()
        self.begins, self.stream = self.begins[:1].copy(), self.stream[:0].copy()
        give_back(spare)

    def cut(self, tick: int) -> None:
        """Drop the frames from a tick on."""
        self.state[0] = np.searchsorted(self.ticks[: len(self)], tick)
        self.state[2] += 1

    def frames(self, lists: Sequence[LinkList], space: Space, first: int = 0) -> list[Frame]:
        """Return the frames from the number `first` on, with these lists of links."""
        key = (int(self.state[2]), tuple(lists), space.low.tobytes(), space.size.tobytes(), first)
        if self._made[0] != key:
            self._made = key, _Reading(self, first).frames(lists, space)
        return self._made[1]


class _Reading:
    """The arrays of some frames of a chunk."""

    def __init__(self, chunk: Chunk, first: int) -> None:
        self._layout, last = chunk.layout, len(chunk)
        self._stream, self._ticks = chunk.stream, chunk.ticks[first:last]
        bodies = len(self._layout.slots)
        fixed = chunk.fixed[first:last].reshape(last - first, 2, bodies, 2)
        # To add half of the range of 16 bits is to change the highest one.
        self._position, self._heading = fixed[:, 0].view(np.uint16) ^ np.uint16(MIDDLE), fixed[:, 1]
        self._at = chunk.begins[first:last]
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
        active = np.ones_like(observed)
        if self._layout.is_conditional:
            active = self._numbers(bodies).astype(np.uint16)
        return np.asarray(PRESENT + ACTIVE * active + OBSERVED * observed, np.uint16)

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
        shares = [_divided(observed, is_active[:, counted].sum(axis=1)), _divided(edges, robots), largest]
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


def link_lists(layouts: Sequence[Layout]) -> tuple[LinkList, ...]:
    """Return the lists of links of frames that have one of these layouts: one for each channel, "teammates" first."""
    found: dict[str, list[LinkLayout]] = {}
    for layout in layouts:
        for one in layout.links:
            found.setdefault(one.channel, []).append(one)
    names = sorted(found, key=lambda name: name != TEAMMATES)
    return tuple(
        LinkList(
            name, name, any(one.counts for one in found[name]), any(one.measured for one in found[name]),
            max(one.scale for one in found[name]),
        )
        for name in names
    )  # fmt: skip


def _counts_of(ends: Integers, *, is_wide: bool) -> Integers:
    """Return the sizes of lists that end there, of which only the lowest one or two bytes are known."""
    return np.asarray(np.diff(ends, axis=1, prepend=0) & (0xFFFF if is_wide else 0xFF))


def _divided(numbers: Integers, sizes: Integers) -> Floats:
    """Return shares; NaN where nobody is there."""
    return np.asarray(numbers / np.where(sizes > 0, sizes, np.nan))
