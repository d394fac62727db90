"""Frames as bytes: a raw block for each frame of a live run, and all frames of a recording packed together.

Python and JavaScript share the format: ``decodeReplay`` and ``decodeFrame`` in ``assets/view.js`` read what this file
writes. All numbers are little-endian. Packed, a column holds differences to the frame before, all low bytes before all
high bytes, because what changes slowly is then mostly zeros, which zlib shortens most.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.view.scene import Frame, Links, Scene, Words

Mask: TypeAlias = npt.NDArray[np.bool_]

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
    is_there = _is_there(sizes)
    for name in _COLUMNS:
        parts.append(_split(_differences([getattr(frame, name) for frame in frames], is_there)))
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
    reader = _Reader(_inflated(data))
    count = int(reader.take("<u4", 1)[0])
    times = reader.take("<f4", count)
    series = [reader.take("<f4", count) for _ in scene.series]
    sizes = reader.take("<u2", count).astype(np.int64)
    if (np.diff(sizes) < 0).any() or sizes.max(initial=0) > len(scene.slots):
        raise ValueError(f"frames: their number of slots falls or exceeds {len(scene.slots):,}; {_DAMAGED}")
    is_there = _is_there(sizes)
    columns = [_summed(reader.words(int(sizes.sum())), is_there) for _ in _COLUMNS]
    lists = [_unpacked_links(reader, count, is_measured=one.measured) for one in scene.links]
    reader.end()
    numbers = np.array(series, np.float32).reshape(len(series), count)
    frames = []
    for k in range(count):
        x, y, heading, flags = (column[k, : sizes[k]].copy() for column in columns)
        of_frame = tuple(links[k] for links in lists)
        frames.append(Frame(float(times[k]), numbers[:, k].copy(), x, y, heading, flags, of_frame))
    return frames


def _is_there(sizes: npt.NDArray[np.int64]) -> Mask:
    """Return for each frame and slot whether the frame has the slot."""
    return np.asarray(np.arange(sizes.max(initial=0)) < sizes[:, None])


def _differences(rows: Sequence[Words], is_there: Mask) -> Words:
    """Return the values of one column in all frames, each minus that in the frame before."""
    table = np.zeros(is_there.shape, np.uint16)
    table[is_there] = np.concatenate([np.zeros(0, np.uint16), *rows])
    table[1:] -= table[:-1].copy()
    return np.asarray(table[is_there])


def _summed(differences: Words, is_there: Mask) -> Words:
    """Return the values of one column in all frames, shape (frames, slots)."""
    table = np.zeros(is_there.shape, np.uint16)
    table[is_there] = differences
    return np.cumsum(table, axis=0, dtype=np.uint16)


def _packed_links(lists: Sequence[Links], *, is_measured: bool) -> list[bytes]:
    """Return the parts of one list of links: sizes, omitted ones, sources, targets, and offsets if it is measured."""
    sizes = np.array([len(links) for links in lists], np.int64)
    nothing = [np.zeros(0, np.uint16)] * (4 if is_measured else 2)
    rows = [nothing, *(_arrays_of(links, is_measured=is_measured) for links in lists)]
    source, *others = map(np.concatenate, zip(*rows, strict=True))
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
    return [
        _links_of([column[end - size : end].copy() for column in columns], missing)
        for size, end, missing in zip(sizes, ends, omitted, strict=True)
    ]


def _arrays_of(links: Links, *, is_measured: bool) -> list[Words]:
    """Return the arrays of a list of links as words."""
    arrays = [links.source, links.target]
    if is_measured:
        if links.dx is None or links.dy is None:
            raise ValueError("links: have no offsets, and the scene says that the list is measured; give dx and dy")
        arrays += [links.dx.view(np.uint16), links.dy.view(np.uint16)]
    return arrays


def _links_of(arrays: list[Words], omitted: int) -> Links:
    source, target, *offsets = arrays
    dx, dy = (offset.view(np.int16) for offset in offsets) if offsets else (None, None)
    return Links(source, target, dx, dy, omitted)


def _split(words: Words) -> bytes:
    """Return all low bytes, then all high bytes."""
    return words.astype("<u2", copy=False).view(np.uint8).reshape(-1, 2).T.tobytes()


def _inflated(data: bytes) -> bytes:
    try:
        inflater = zlib.decompressobj()
        content = inflater.decompress(data, _MOST_BYTES)
    except zlib.error as error:
        raise ValueError(f"frames: cannot be decompressed ({error}); {_DAMAGED}") from error
    if not inflater.eof:
        raise ValueError(f"frames: end early, or are longer than {_MOST_BYTES:,} bytes; {_DAMAGED}")
    return content


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
