"""What is read or written eight at a time is what NumPy does one by one, in machine code and in plain Python."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from teamsight.core.kernel import Entry, array_at, equal_eight, put_eight_bytes, put_eight_parts
from teamsight.core.kernel.intrinsics import near_eight, near_eight_in_square

SIZE, ROOM = 20, 24
FIRST, AT = st.integers(0, SIZE - 8), st.integers(0, ROOM - 8)
INTEGER = st.integers(-(2**63), 2**63 - 1)
INTEGERS = arrays(np.int64, SIZE, elements=st.one_of(st.integers(-2, 2), INTEGER))


def _parts(address: int) -> int:
    where, numbers = array_at(address, 5, np.int64), array_at(array_at(address, 5, np.int64)[4], 4, np.float64)
    values, out = array_at(where[0], SIZE, np.float64), array_at(where[1], ROOM, np.int16)
    put_eight_parts(values, where[2], (numbers[0], numbers[1]), (numbers[2], numbers[3]), out, where[3])
    return 0


def _bytes(address: int) -> int:
    where = array_at(address, 4, np.int64)
    put_eight_bytes(array_at(where[0], SIZE, np.int64), where[2], array_at(where[1], ROOM, np.uint8), where[3])
    return 0


def _equal(address: int) -> int:
    where = array_at(address, 4, np.int64)
    return np.int64(equal_eight(array_at(where[0], SIZE, np.int64), where[1], where[2], where[3]))


def _near(address: int) -> int:
    where, numbers = array_at(address, 5, np.int64), array_at(array_at(address, 5, np.int64)[4], 3, np.float64)
    xs, ys = array_at(where[0], SIZE, np.float64), array_at(where[1], SIZE, np.float64)
    if where[3] > 0:
        return np.int64(near_eight_in_square(xs, ys, where[2], numbers[0], numbers[1], numbers[2]))
    return np.int64(near_eight(xs, ys, where[2], numbers[0], numbers[1], numbers[2]))


# Each compiled, and in plain Python.
PARTS, BYTES, EQUAL, NEAR = ((Entry(one), one) for one in (_parts, _bytes, _equal, _near))


def call(run: Callable[[int], int], *numbers: int) -> int:
    where = np.array(numbers, np.int64)
    return int(run(where.ctypes.data))


def place(array: npt.NDArray[np.generic]) -> int:
    return int(array.ctypes.data)


@given(
    arrays(np.float64, SIZE, elements=st.floats(0, 1)), st.tuples(*[st.floats(-1e3, 1e3)] * 2),
    st.tuples(*[st.floats(1e-3, 1e3)] * 2), FIRST, AT,
)  # fmt: skip
def test_parts_are_the_nearest_whole_numbers(
    shares: npt.NDArray[np.float64], low: tuple[float, float], size: tuple[float, float], first: int, at: int
) -> None:
    # Element `first` has the first low and factor, wherever it is.
    turns = (np.arange(SIZE) - first) % 2
    lows, sizes = np.array(low)[turns], np.array(size)[turns]
    values, factors = lows + shares * sizes, 65_535 / sizes
    numbers = np.array([*low, *(65_535 / np.array(size))])
    expected = np.full(ROOM, 77, np.int16)
    whole = np.trunc((values - lows) * factors + 0.5).astype(np.int64)[first : first + 8]
    expected[at : at + 8] = whole - 32_768
    for run in PARTS:
        out = np.full(ROOM, 77, np.int16)
        call(run, place(values), place(out), first, at, place(numbers))
        np.testing.assert_array_equal(out, expected)


@given(INTEGERS, FIRST, AT)
def test_bytes_are_the_lowest_ones(values: npt.NDArray[np.int64], first: int, at: int) -> None:
    expected = np.full(ROOM, 77, np.uint8)
    expected[at : at + 8] = values[first : first + 8] & 0xFF
    for run in BYTES:
        out = np.full(ROOM, 77, np.uint8)
        call(run, place(values), place(out), first, at)
        np.testing.assert_array_equal(out, expected)


@given(INTEGERS, FIRST, st.data())
def test_bits_say_which_are_one_of_two_numbers(values: npt.NDArray[np.int64], first: int, data: st.DataObject) -> None:
    # Numbers that are there, more often than not.
    one, other = (data.draw(st.one_of(st.sampled_from(values.tolist()), INTEGER), label=name) for name in ("one", "other"))
    expected = np.packbits(np.isin(values[first : first + 8], [one, other]), bitorder="little")[0]
    assert [call(run, place(values), first, one, other) for run in EQUAL] == [expected] * 2


@given(
    arrays(np.float64, (2, SIZE), elements=st.floats(-3, 3)), FIRST, st.tuples(*[st.floats(-3, 3)] * 2), st.floats(0, 9)
)
def test_points_are_near_within_a_disc_or_a_square(
    points: npt.NDArray[np.float64], first: int, centre: tuple[float, float], limit: float
) -> None:
    xs, ys = points[:, first : first + 8] - np.array(centre)[:, None]
    near = xs * xs + ys * ys <= limit, (abs(xs) <= limit) & (abs(ys) <= limit)
    numbers = np.array([*centre, limit])
    for shape, expected in enumerate(near):
        word = np.packbits(expected, bitorder="little")[0]
        where = place(points[0]), place(points[1]), first, shape, place(numbers)
        assert [call(run, *where) for run in NEAR] == [word] * 2
