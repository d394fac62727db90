"""The parts of kernels that are written as machine code: room on the stack, and many comparisons at once."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight.core.kernel import Entry, array_at, below_8, below_64, ones, scratch


def _reverse(address: int) -> int:
    row = array_at(address, 300, np.float32)
    for _ in range(3):
        room, other = scratch(300, np.float32), scratch(5, np.int64)
        other[4] = 299
        for i in range(300):
            room[i] = row[i]
        for i in range(300):
            row[i] = room[other[4] - i]
    return room.size + other.size


def _count(address: int) -> int:
    row = array_at(address, 70, np.float32)
    return ones(below_64(row, 5, row[0]))


def _eight(address: int) -> int:
    row = array_at(address, 70, np.float32)
    return np.int64(below_8(row, 5, row[0]))


def _unknown(address: int) -> int:
    return scratch(address, np.float32).size


def test_scratch_is_room_of_its_own() -> None:
    row = np.arange(300, dtype=np.float32)
    assert Entry(_reverse)(row.ctypes.data) == 305
    assert row.tolist() == list(range(299, -1, -1))
    with pytest.raises(TypeError, match=r"test_lanes\.py:\d+: numba cannot compile scratch\(int64"):
        Entry(_unknown).address  # noqa: B018


def test_comparisons_are_strict_and_false_for_nan() -> None:
    row = np.full(70, 2.0, np.float32)
    row[0] = 2.0
    row[[5, 17, 68]] = 1.0
    row[[4, 69]] = -1.0
    row[[6, 30]] = np.nan
    assert Entry(_count)(row.ctypes.data) == 3
    row[0] = np.inf
    assert Entry(_count)(row.ctypes.data) == 62


def test_eight_comparisons_are_the_lowest_bits_of_a_word() -> None:
    row = np.full(70, 2.0, np.float32)
    row[[4, 13]] = -1.0
    row[6] = np.nan
    assert Entry(_eight)(row.ctypes.data) == 0
    row[[5, 7, 12]] = 1.0
    assert Entry(_eight)(row.ctypes.data) == 0b10000101
