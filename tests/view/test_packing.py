"""Frames survive being packed, whatever comes and goes."""

from __future__ import annotations

import json
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from teamsight.view.packing import from_raw, pack, raw, unpack
from teamsight.view.scene import Frame, LinkList, Links, Scene, SceneGroup, Slot

WORD, OFFSET = st.integers(0, 65_535), st.integers(-32_768, 32_767)


def scene(slots: int, links: tuple[LinkList, ...] = (), series: tuple[str, ...] = ("observed",)) -> Scene:
    group = SceneGroup("robots", "robot", "#1f77b4", "robots", "a-cmommt", {"name": "ring", "delta": 8})
    return Scene(
        "a run", "CMOMMT", "0.1.0", 7, 1, (-5.0, -5.0, 5.0, 5.0), (((-5.0, 0.0), (5.0, 0.25)),), (), None, (group,),
        tuple(Slot(0, 1 + one, 1.0, 2.0) for one in range(slots)), series, links,
    )  # fmt: skip


@st.composite
def recordings(draw: Any) -> tuple[list[Frame], Scene]:
    sizes = sorted(draw(st.lists(st.integers(0, 6), max_size=6)))
    lists = tuple(LinkList(f"list {k}", "targets", True, each, 1.5) for k, each in enumerate(draw(st.lists(st.booleans(), max_size=3))))
    series = tuple(f"series {k}" for k in range(draw(st.integers(0, 3))))
    frames = []
    for time, size in enumerate(sizes):
        columns = [draw(arrays(np.uint16, size, elements=WORD)) for _ in range(4)]
        links = []
        for one in lists:
            count = draw(st.integers(0, 5)) if size else 0
            ends = [np.sort(draw(arrays(np.uint16, count, elements=WORD))), draw(arrays(np.uint16, count, elements=WORD))]
            offsets = [draw(arrays(np.int16, count, elements=OFFSET)) for _ in range(2)] if one.measured else []
            links.append(Links(*ends, *offsets, omitted=draw(st.integers(0, 2**32 - 1))))
        numbers = draw(arrays(np.float32, len(series), elements=st.floats(width=32)))
        frames.append(Frame(float(time), numbers, *columns, tuple(links)))
    return frames, scene(sizes[-1] if sizes else 0, lists, series)


def assert_same(one: Frame, other: Frame) -> None:
    assert one.time == other.time
    for name in ("series", "x", "y", "heading", "flags"):
        assert getattr(one, name).dtype == getattr(other, name).dtype
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert len(one.links) == len(other.links)
    for mine, theirs in zip(one.links, other.links, strict=True):
        for name in ("source", "target", "dx", "dy"):
            np.testing.assert_array_equal(getattr(mine, name), getattr(theirs, name), err_msg=name)
        assert mine.omitted == theirs.omitted


@pytest.mark.short
@given(recordings())
def test_what_is_packed_is_unpacked(recording: tuple[list[Frame], Scene]) -> None:
    frames, about = recording
    found = unpack(pack(frames, about), about)
    assert len(found) == len(frames)
    for one, other in zip(frames, found, strict=True):
        assert_same(one, other)
        assert_same(one, from_raw(raw(one, about), about))


@pytest.mark.short
def test_the_bytes_are_those_of_the_format() -> None:
    links = (LinkList("teammates", "teammates"), LinkList("targets", "targets", True, True, 1.2))
    about = scene(2, links, ("observed", "mean_neighbours"))
    words = [np.array(each, np.uint16) for each in ([1, 2], [3, 4], [5, 0x1234], [7, 7])]
    offsets = [np.array([-2], np.int16), np.array([3], np.int16)]
    pairs = (Links(np.array([0, 1], np.uint16), np.array([1, 0], np.uint16)), Links(np.array([1], np.uint16), np.array([0], np.uint16), *offsets, omitted=258))
    first = Frame(0.0, np.array([0.5, 1.0], np.float32), *(each[:1] for each in words), (pairs[0], pairs[1]))
    second = Frame(1.0, np.array([1.0, 2.0], np.float32), *words, pairs)
    counts, numbers = np.array([2, 2, 1, 0, 258], "<u4"), np.array([1.0, 1.0, 2.0], "<f4")
    block = np.array([1, 2, 3, 4, 5, 0x1234, 7, 7, 0, 1, 1, 0, 1, 0, 65534, 3], "<u2")
    assert raw(second, about) == counts.tobytes() + numbers.tobytes() + block.tobytes()

    content = zlib.decompress(pack([first, second], about))
    head = np.array([2], "<u4").tobytes() + np.array([0, 1, 0.5, 1, 1, 2], "<f4").tobytes() + np.array([1, 2], "<u2").tobytes()
    # Low bytes of the differences, then high bytes: slot 0 does not change, slot 1 begins.
    columns = bytes([1, 0, 2, 0, 0, 0, 3, 0, 4, 0, 0, 0, 5, 0, 0x34, 0, 0, 0x12, 7, 0, 7, 0, 0, 0])
    teammates = np.array([2, 2, 0, 0], "<u4").tobytes() + bytes([0, 1, 0, 1, 0, 0, 0, 0]) + bytes([1, 0, 1, 0, 0, 0, 0, 0])
    targets = np.array([1, 1, 258, 258], "<u4").tobytes() + bytes([1, 1, 0, 0]) + bytes(4) + bytes([254, 254, 255, 255]) + bytes([3, 3, 0, 0])
    assert content == head + columns + teammates + targets


@given(st.data())
def test_damaged_bytes_are_refused_in_one_line(data: st.DataObject) -> None:
    frames, about = data.draw(recordings())
    content = bytearray(pack(frames, about))
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    try:
        unpack(bytes(content), about)
    except ValueError as error:
        assert "\n" not in str(error)
        assert "frames: " in str(error)
    for cut in (bytes(content[: at // 2]), b""):
        with pytest.raises(ValueError, match="record the run again"):
            unpack(cut, about)
    with pytest.raises(ValueError, match="record the run again"):
        unpack(zlib.compress(data.draw(st.binary(max_size=60).filter(lambda found: found != bytes(4)))), scene(0, (), ()))


def test_slots_never_fall() -> None:
    words = [np.zeros(2, np.uint16)] * 4
    frames = [Frame(0.0, np.zeros(1, np.float32), *words), Frame(1.0, np.zeros(1, np.float32), *(each[:1] for each in words))]
    with pytest.raises(ValueError, match="slots are kept"):
        pack(frames, scene(2))


@pytest.mark.short
def test_a_scene_survives_json() -> None:
    about = scene(3, (LinkList("targets", "targets", True, True, 1.2),))
    assert Scene.from_json(json.loads(json.dumps(about.as_json()))) == about
    for wrong in ({}, [], None, {"format": 2}, {**about.as_json(), "bounds": [1]}, {**about.as_json(), "slots": [{}]}):
        with pytest.raises(ValueError, match="open|record the run again"):
            Scene.from_json(wrong)
