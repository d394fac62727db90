"""Frames as bytes: a raw block for each frame of a live run, and all frames of a recording packed together.

Python and JavaScript share the format: ``decodeReplay`` and ``decodeFrame`` in ``assets/view.js`` read what this file
writes. All numbers are little-endian. Packed, a column holds differences to the frame before, all low bytes before all
high bytes, because what changes slowly is then mostly zeros, which zlib shortens most.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.view.scene import Frame, Links, Scene, Words

_COLUMNS = ("x", "y", "heading", "flags")
_DAMAGED = "the file is damaged; record the run again"
# Larger recordings do not fit into the memory of a page anyway.
_MOST_BYTES = 2**31


def raw(frame: Frame, scene: Scene) -> bytes:
    """Return a frame as a raw block: numbers of bodies, of links and of omitted links, time, series, columns, links.

    Parameters
    ----------
    frame : Frame
        The frame.
    scene : Scene
        Its scene.
    """
    counts = np.array([len(frame), *map(len, frame.links), *(links.omitted for links in frame.links)], "<u4")
    numbers = np.array([frame.time, *frame.series], "<f4")
    words = [getattr(frame, name) for name in _COLUMNS]
    for one, links in zip(scene.links, frame.links, strict=True):
        words += _arrays_of(links, is_measured=one.measured)
    return counts.tobytes() + numbers.tobytes() + b"".join(array.astype("<u2", copy=False).tobytes() for array in words)


def from_raw(data: bytes, scene: Scene) -> Frame:
    """Return the frame of a raw block.

    Raises
    ------
    ValueError
        If the block has another length than it says.
    """
    reader = _Reader(data)
    bodies, *lists = reader.take("<u4", 1 + len(scene.links)).tolist()
    omitted = reader.take("<u4", len(scene.links)).tolist()
    time, *series = reader.take("<f4", 1 + len(scene.series))
    x, y, heading, flags = (reader.take("<u2", bodies) for _ in _COLUMNS)
    links = []
    for one, size, missing in zip(scene.links, lists, omitted, strict=True):
        arrays = [reader.take("<u2", size) for _ in range(4 if one.measured else 2)]
        links.append(_links_of(arrays, missing))
    reader.end()
    return Frame(float(time), np.array(series, np.float32), x, y, heading, flags, tuple(links))


def ticks_of(scene: Scene, blocks: Sequence[bytes]) -> list[int]:
    """Return the ticks of raw blocks."""
    # Behind the numbers of bodies, of links and of omitted links.
    at = 4 * (1 + 2 * len(scene.links))
    return [int(np.frombuffer(block, "<f4", 1, at)[0]) for block in blocks]


def pack(frames: Sequence[Frame], scene: Scene) -> bytes:
    """Return the frames of a recording, packed together.

    Parameters
    ----------
    frames : sequence of Frame
        The frames, in order of time; the number of slots never falls.
    scene : Scene
        Their scene.

    Raises
    ------
    ValueError
        If the number of slots falls, or frames do not fit the scene.
    """
    sizes = np.array([len(frame) for frame in frames], np.int64)
    if (np.diff(sizes) < 0).any() or (len(sizes) and sizes[-1] > len(scene.slots)):
        most = int(sizes.max(initial=0))
        raise ValueError(f"frames: have up to {most:,} slots, of {len(scene.slots):,}; slots are kept, and never fall")
    parts = [
        np.array([len(frames)], "<u4").tobytes(),
        np.array([frame.time for frame in frames], "<f4").tobytes(),
        np.array([frame.series for frame in frames], "<f4").reshape(len(frames), len(scene.series)).T.tobytes(),
        sizes.astype("<u2").tobytes(),
    ]
    table, is_there = _table(sizes)
    for name in _COLUMNS:
        table[is_there] = _joined([getattr(frame, name) for frame in frames])
        parts.append(_split(np.diff(table, axis=0, prepend=np.uint16(0))[is_there]))
    for number, one in enumerate(scene.links):
        parts += _packed_links([frame.links[number] for frame in frames], is_measured=one.measured)
    return zlib.compress(b"".join(parts), 6)


def unpack(data: bytes, scene: Scene) -> list[Frame]:
    """Return the frames of what `pack` returned.

    Raises
    ------
    ValueError
        If the data are damaged.
    """
    try:
        inflater = zlib.decompressobj()
        reader = _Reader(inflater.decompress(data, _MOST_BYTES))
    except zlib.error as error:
        raise ValueError(f"frames: cannot be decompressed ({error}); {_DAMAGED}") from error
    if not inflater.eof:
        raise ValueError(f"frames: end early, or are longer than {_MOST_BYTES:,} bytes; {_DAMAGED}")
    count = int(reader.take("<u4", 1)[0])
    times = reader.take("<f4", count)
    numbers = reader.take("<f4", len(scene.series) * count).reshape(-1, count).T if count else ()
    sizes = reader.take("<u2", count).astype(np.int64)
    if (np.diff(sizes) < 0).any() or sizes.max(initial=0) > len(scene.slots):
        raise ValueError(f"frames: their number of slots falls or exceeds {len(scene.slots):,}; {_DAMAGED}")
    table, is_there = _table(sizes)
    columns = []
    for _ in _COLUMNS:
        table[is_there] = reader.words(int(sizes.sum()))
        columns.append(_cut(np.cumsum(table, axis=0, dtype=np.uint16)[is_there], sizes))
    lists = [_unpacked_links(reader, count, is_measured=one.measured) for one in scene.links]
    reader.end()
    frames = []
    for k in range(count):
        x, y, heading, flags = (column[k] for column in columns)
        of_frame = tuple(links[k] for links in lists)
        frames.append(Frame(float(times[k]), numbers[k].copy(), x, y, heading, flags, of_frame))
    return frames


def _table(sizes: npt.NDArray[np.int64]) -> tuple[Words, npt.NDArray[np.bool_]]:
    """Return a table with a value for each frame and slot, and whether the frame has the slot."""
    is_there = np.arange(sizes.max(initial=0)) < sizes[:, None]
    return np.zeros(is_there.shape, np.uint16), is_there


def _joined(rows: Iterable[Words]) -> Words:
    return np.concatenate([np.zeros(0, np.uint16), *rows])


def _cut(values: Words, sizes: npt.NDArray[np.int64]) -> list[Words]:
    """Return the values of each frame, of which there are so many."""
    return np.split(values, np.cumsum(sizes)[:-1])


def _packed_links(lists: Sequence[Links], *, is_measured: bool) -> list[bytes]:
    """Return the parts of one list of links: sizes, omitted ones, sources, targets, and offsets if it is measured."""
    sizes = np.array([len(links) for links in lists], np.int64)
    rows = [_arrays_of(links, is_measured=is_measured) for links in lists]
    source, *others = (_joined(row[k] for row in rows) for k in range(4 if is_measured else 2))
    before = np.concatenate([np.zeros(1, np.uint16), source])[: len(source)]
    # Where each list begins, one after the other; nothing for empty ones.
    before[(np.cumsum(sizes) - sizes)[sizes > 0]] = 0
    omitted = np.array([links.omitted for links in lists], "<u4")
    return [sizes.astype("<u4").tobytes(), omitted.tobytes(), _split(source - before), *map(_split, others)]


def _unpacked_links(reader: _Reader, count: int, *, is_measured: bool) -> list[Links]:
    sizes, omitted = reader.take("<u4", count).astype(np.int64), reader.take("<u4", count).tolist()
    total = int(sizes.sum())
    # Four bytes at least for each link.
    reader.check(4 * total)
    columns = [reader.words(total) for _ in range(4 if is_measured else 2)]
    ends = np.cumsum(sizes)
    sums = np.concatenate([np.zeros(1, np.uint16), np.cumsum(columns[0], dtype=np.uint16)])
    columns[0] = sums[1:] - np.repeat(sums[ends - sizes], sizes)
    by_frame = zip(*(_cut(column, sizes) for column in columns), strict=True)
    return [_links_of(arrays, missing) for arrays, missing in zip(by_frame, omitted, strict=False)]


def _arrays_of(links: Links, *, is_measured: bool) -> list[Words]:
    """Return the arrays of a list of links as words."""
    arrays = [links.source, links.target]
    if is_measured:
        if links.dx is None or links.dy is None:
            raise ValueError("links: have no offsets, and the scene says that the list is measured; give dx and dy")
        arrays += [links.dx.view(np.uint16), links.dy.view(np.uint16)]
    return arrays


def _links_of(arrays: Sequence[Words], omitted: int) -> Links:
    source, target, *offsets = arrays
    dx, dy = (offset.view(np.int16) for offset in offsets) if offsets else (None, None)
    return Links(source, target, dx, dy, omitted)


def _split(words: Words) -> bytes:
    """Return all low bytes, then all high bytes."""
    return words.astype("<u2", copy=False).view(np.uint8).reshape(-1, 2).T.tobytes()


class _Reader:
    """Reads arrays from bytes, one after the other; refuses to read beyond the end."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def check(self, size: int) -> None:
        """Refuse data with fewer bytes left."""
        if size > len(self._data) - self._at:
            raise ValueError(f"frames: {len(self._data):,} bytes are fewer than they say; {_DAMAGED}")

    def take(self, dtype: str, count: int) -> npt.NDArray[Any]:
        """Return the next numbers, in the machine's own order of bytes."""
        kind = np.dtype(dtype)
        self.check(kind.itemsize * count)
        found = np.frombuffer(self._data, kind, count, self._at)
        self._at += kind.itemsize * count
        return found.astype(kind.newbyteorder("="))

    def words(self, count: int) -> Words:
        """Return numbers of which all low bytes come before all high bytes."""
        halves = self.take("u1", 2 * count).reshape(2, count)
        return np.asarray(halves[0] + (halves[1].astype(np.uint16) << 8))

    def end(self) -> None:
        """Refuse data that go on."""
        if self._at != len(self._data):
            raise ValueError(f"frames: {len(self._data) - self._at:,} bytes too many; {_DAMAGED}")
