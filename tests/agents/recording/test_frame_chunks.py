"""The memory of recordings: no frame is lost where it ends, and no two recordings get the same."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from teamsight import CMOMMT, Sensor
from teamsight.agents.recording import frames


@pytest.fixture
def impatient() -> Iterator[None]:
    """Let threads take turns as often as possible."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_no_frame_is_lost_wherever_the_memory_of_a_chunk_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "_MOST", 0)
    monkeypatch.setattr(frames, "_spare", [])
    # Noisy readings are recorded as they are: so many bytes that these fill the memory, and not the number of frames.
    noisy = Sensor(range_noise=0.05)
    for room in range(12_000, 14_000, 32):
        monkeypatch.setattr(frames, "_FIRST", room)
        monkeypatch.setattr(frames, "_LARGEST", room)
        replay = CMOMMT(robots=12, targets=14, radius=0.8, sensor=noisy, rng=1).record(steps=60)
        assert [frame.time for frame in replay.frames] == list(range(61)), room


@pytest.mark.usefixtures("impatient")
def test_threads_never_share_memory_and_get_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "_spare", [])

    def use(number: int) -> bool:
        good = True
        for turn in range(1, 300):
            size = 1 + turn * (number + 1) % 7
            taken = frames.memory(size)
            taken[:] = number
            good &= len(taken) >= size and bool((np.asarray(taken) == number).all())
            frames.give_back(taken)
        return good

    with ThreadPoolExecutor(8) as threads:
        assert all(threads.map(use, range(8)))
