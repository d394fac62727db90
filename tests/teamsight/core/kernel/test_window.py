"""Windows of records: a kernel that is shown some rows does what plain slices do."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight.core.kernel import Entry, Packed, Record
from teamsight.core.kernel.record import Window, show_rows, window
from teamsight.core.neighbour_list import Filled, neighbour_room

Floats = npt.NDArray[np.float64]


class Sums(NamedTuple):
    """For each row, the sum of its neighbours' distances, of its two numbers, and of its noise."""

    way: Annotated[Floats, "n", 2]
    seen: Filled
    noise: Annotated[Floats, "draws", "lanes"]
    result: Annotated[Floats, "n", 3]


class Call(NamedTuple):
    """A call on some rows."""

    window: Window
    rows: Annotated[npt.NDArray[np.int64], 2]


SUMS, CALL = Record(Sums), Record(Call)
sums_at, call_at = SUMS.at, CALL.at


def _sum(address: int) -> int:
    sums = sums_at(address)
    for i in range(sums.way.shape[0]):
        sums.result[i, 0] = 0.0
        for k in range(sums.seen.start[i], sums.seen.start[i + 1]):
            sums.result[i, 0] += sums.seen.distance[k]
        sums.result[i, 1] = sums.way[i, 0] + sums.way[i, 1]
        sums.result[i, 2] = 0.0
        for draw in range(sums.noise.shape[0]):
            sums.result[i, 2] += sums.noise[draw, i]
    return int(sums.seen.distance.shape[0])


def _show(address: int) -> int:
    here = call_at(address)
    show_rows(here.window, here.rows[0], here.rows[1])
    return 0


SUM, SHOW = Entry(_sum), Entry(_show)


@settings(max_examples=25, deadline=None)
@given(data=st.data(), degree=st.lists(st.integers(0, 4), min_size=1, max_size=9), seed=st.integers(0, 2**32))
def test_a_kernel_sees_the_rows_of_its_window(data: Any, degree: list[int], seed: int) -> None:
    size, rng = len(degree), np.random.default_rng(seed)
    start = np.append(0, np.cumsum(degree))
    seen = neighbour_room(size, int(start[-1]) + 3)
    seen.start[:], seen.distance[:] = start, rng.random(len(seen.distance))
    way, noise, result = rng.random((size, 2)), rng.random((3, size + 2)), np.full((size, 3), -1.0)
    packed: Packed[Sums] = SUMS.pack(Sums(way, seen, noise, result))
    first = data.draw(st.integers(0, size - 1))
    last = data.draw(st.integers(first + 1, size))
    call = CALL.pack(Call(window(packed, last_axis=("noise",)), np.array([first, last])))
    assert SHOW(call) == 0
    assert SUM(packed) == start[last]
    expected = np.full((size, 3), -1.0)
    for row in range(first, last):
        expected[row] = seen.distance[start[row] : start[row + 1]].sum(), way[row].sum(), noise[:, row].sum()
    np.testing.assert_allclose(result, expected)
