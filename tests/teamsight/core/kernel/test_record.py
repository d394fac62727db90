"""Records: arrays reach compiled code as they were packed, what would be misread is refused, and the digest sees it."""

from __future__ import annotations

import gc
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.core.kernel import Entry, Packed, Record, inlined, kernel
from teamsight.core.kernel.cache import digest
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.core.neighbour_list import Filled, NeighbourList, filled, neighbour_room

Floats = npt.NDArray[np.float64]


class Inner(NamedTuple):
    number: int


class Outer(NamedTuple):
    position: Annotated[Floats, "n", 2]
    seen: Filled
    room: NeighbourList
    small: Annotated[npt.NDArray[np.float32], "rows", 3, "columns"]
    factor: float
    is_true: bool
    one: Packed[Inner] | None
    many: list[Packed[Inner]]
    result: Annotated[npt.NDArray[np.int64], 8]


INNER, OUTER = Record(Inner), Record(Outer)
inner_at, outer_at = INNER.at, OUTER.at


def _read(address: int) -> int:
    outer = outer_at(address)
    result = outer.result
    result[0] = outer.position.shape[0]
    result[1] = outer.seen.distance.shape[0]
    result[2] = outer.room.distance.shape[0]
    result[3] = outer.small.shape[0] * 100 + outer.small.shape[1] * 10 + outer.small.shape[2]
    result[4] = outer.many.shape[0]
    result[5] = outer.one
    total = 0
    for at in range(outer.many.shape[0]):
        total += inner_at(outer.many[at]).number
    result[6] = total
    for i in range(outer.position.shape[0]):
        outer.position[i, 1] = outer.factor * outer.position[i, 0] + outer.is_true
    return np.int64(outer.small[0, 2, 0])


READ = Entry(_read)


def outer(n: int = 3, most: int = 7, **changes: Any) -> Outer:
    seen = neighbour_room(n, most)
    seen.start[1:] = min(2, most)
    value = Outer(
        np.arange(2.0 * n).reshape(n, 2), seen, neighbour_room(n, most + 4), np.arange(30, dtype=np.float32).reshape(2, 3, 5),
        2.5, True, None, [INNER.pack(Inner(number)) for number in (4, 30)], np.zeros(8, np.int64),
    )  # fmt: skip
    return value._replace(**changes)


@pytest.mark.short
@given(n=st.integers(1, 20), room=st.integers(2, 30))
def test_a_kernel_reads_what_was_packed(n: int, room: int) -> None:
    one = INNER.pack(Inner(5))
    value = outer(n, room, one=one)
    before = value.position[:, 0].copy()
    assert READ(OUTER.pack(value)) == 10
    # Of a filled list a kernel sees what is in use, of the other all the room.
    assert value.result[:7].tolist() == [n, len(filled(value.seen).distance), room + 4, 235, 2, one.address, 34]
    assert value.position[:, 1].tolist() == (2.5 * before + 1).tolist()


def test_a_record_keeps_alive_what_it_points_to() -> None:
    packed = [OUTER.pack(outer()) for _ in range(200)]
    gc.collect()
    # What was freed would be written over.
    _ = [np.full((3, 2), -1.0) for _ in range(1000)]
    for one in packed:
        READ(one)
        assert one.value.position[:, 0].tolist() == [0.0, 2.0, 4.0]
        assert one.value.result[6] == 34


def test_an_update_replaces_a_field_and_nothing_else() -> None:
    packed = OUTER.pack(outer())
    address = packed.address
    packed.update(factor=-1.0, many=[])
    READ(packed)
    assert packed.address == address
    assert packed.value.result[[0, 4, 6]].tolist() == [3, 0, 0]
    assert packed.value.position[:, 1].tolist() == [1.0, -1.0, -3.0]


@given(most=st.integers(0, 30), room=st.integers(0, 30), factor=st.floats(-1.0, 1.0))
def test_fields_that_are_updated_read_as_if_all_were_packed(most: int, room: int, factor: float) -> None:
    changes: dict[str, Any] = {
        "seen": neighbour_room(3, most), "room": neighbour_room(3, room), "factor": factor, "one": INNER.pack(Inner(7)),
    }  # fmt: skip
    packed = OUTER.pack(outer())
    for name, field in changes.items():
        packed.update(**{name: field})
    whole = OUTER.pack(packed.value)
    # Each has a list of addresses of its own.
    packed.words[OUTER.leaves["many"].slot] = whole.words[OUTER.leaves["many"].slot]
    assert packed.words.tolist() == whole.words.tolist()
    assert packed.value.factor == factor


def test_an_updated_list_is_kept_alive() -> None:
    packed = [OUTER.pack(outer()) for _ in range(200)]
    for one in packed:
        one.update(many=[INNER.pack(Inner(number)) for number in range(5)])
    gc.collect()
    _ = [np.full(5, -1) for _ in range(1000)]
    for one in packed:
        READ(one)
        assert one.value.result[[4, 6]].tolist() == [5, 10]


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"position": np.zeros((3, 2), np.float32)}, TypeError, r"position: .*float32.*float64"),
        ({"position": np.zeros((3, 4))[:, ::2]}, TypeError, r"position: .*C-contiguous"),
        ({"position": np.zeros((3, 3))}, ValueError, r"position: .*\(3, 3\).*\(n, 2\)"),
        ({"position": np.zeros(3)}, ValueError, r"position: .*\(3,\).*\(n, 2\)"),
        # A record that is packed shows first what comes later; an update, what is new.
        ({"position": np.zeros((4, 2))}, ValueError, r"(seen\.start: .*\(4,\).*\(n \+ 1\)|position: .*\(4, 2\).*\(n, 2\))"),
        ({"room": neighbour_room(2, 5)}, ValueError, r"room\.start: .*\(3,\)"),
        ({"room": neighbour_room(3, 5)._replace(distance=np.zeros(4))}, ValueError, r"room\.distance: .*\(4,\).*\(k\)"),
    ],
)  # fmt: skip


def test_what_would_be_misread_is_refused_and_the_record_stays(changes: Any, error: Any, message: str) -> None:
    with pytest.raises(error, match=message):
        OUTER.pack(outer(**changes))
    packed = OUTER.pack(outer())
    with pytest.raises(error, match=message):
        packed.update(**changes)
    READ(packed)
    assert packed.value.result[0] == 3


class Numbers(NamedTuple):
    first: Annotated[Floats, "n"]
    second: Annotated[Floats, "n"]


class Turned(NamedTuple):
    second: Annotated[Floats, "n"]
    first: Annotated[Floats, "n"]


class Narrow(NamedTuple):
    first: Annotated[npt.NDArray[np.float32], "n"]
    second: Annotated[Floats, "n"]


class Fixed(NamedTuple):
    first: Annotated[Floats, 4]
    second: Annotated[Floats, "n"]


def test_the_digest_of_a_kernel_notices_every_change_of_a_record() -> None:
    def of(kind: Any) -> str:
        numbers_at = Record(kind).at

        def run(address: int) -> int:
            return int(numbers_at(address).first[0])

        return digest(run)

    assert of(Numbers) == of(Numbers)
    digests = {of(kind) for kind in (Numbers, Turned, Narrow, Fixed)}
    assert len(digests) == 4


def test_the_digest_of_a_kernel_notices_that_another_is_inlined() -> None:
    def double(x: float) -> float:
        return 2.0 * x

    def of(decorator: Any) -> str:
        twice = decorator(double)

        def run(address: int) -> int:
            return int(twice(1.0))

        return digest(run)

    assert of(kernel) == of(kernel) != of(inlined)


def test_a_guard_names_the_array_and_refuses_what_may_only_be_read() -> None:
    record = Record(Numbers)
    guard, at = Guard(record, ("second",), {"n": Axis("numbers", "stay below n")}), record.at

    def _beyond(address: int) -> int:
        numbers = at(address)
        numbers.second[0] = numbers.first[numbers.first.shape[0]]
        return 0

    def _writes(address: int) -> int:
        at(address).first[0] = 1.0
        return 0

    def _fills(address: int) -> int:
        at(address).first.fill(1.0)
        return 0

    def _adds(address: int) -> int:
        numbers = at(address)
        numbers.second[0] = numbers.first[1] + 1.0
        return 7

    given = Numbers(np.zeros(3), np.zeros(3))
    begin_check()
    with pytest.raises(ValueError, match=r"test_record\.py:\d+: kernel uses index 3 of first, whose number of numbers is 3; stay"):
        guard.run("owner", "kernel", Entry(_beyond), given)
    with pytest.raises(ValueError, match=r"writes into first, which is read-only"):
        guard.run("owner", "kernel", Entry(_writes), given)
    with pytest.raises(ValueError, match=r"next to first, or into it although it is read-only"):
        guard.execute("owner", "kernel", Entry(_fills), given)
    status, written = guard.run("owner", "kernel", Entry(_adds), given)
    assert status == 7
    assert (written.second[0], given.second[0]) == (1.0, 0.0)


def test_a_guard_ends_when_the_accesses_of_a_check_are_used_up(monkeypatch: pytest.MonkeyPatch) -> None:
    record = Record(Numbers)
    guard, at = Guard(record, (), {"n": Axis("numbers", "stay below n")}), record.at

    def _far(address: int) -> int:
        total = 0.0
        for i in range(5):
            total += at(address).first[i]
        return int(total)

    given = Numbers(np.zeros(3), np.zeros(3))
    monkeypatch.setattr("teamsight.core.kernel.guard._MOST_ACCESSES", 3)
    begin_check()
    guard.interpret("owner", "kernel", Entry(_far), given)
    monkeypatch.setattr("teamsight.core.kernel.guard._MOST_ACCESSES", 4)
    begin_check()
    with pytest.raises(ValueError, match=r"index 3 of first, .* is 3; stay below n"):
        guard.interpret("owner", "kernel", Entry(_far), given)
    begin_check()
    with pytest.raises(ValueError, match=r"index 1 of first, .* is 1; stay below n"):
        guard.interpret("owner", "kernel", Entry(_far), given, {"first": 1})
