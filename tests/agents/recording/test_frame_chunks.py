"""The memory of recordings: no frame is lost where it ends."""

from __future__ import annotations

import pytest

from teamsight import CMOMMT, Sensor
from teamsight.agents.recording import frames


def test_no_frame_is_lost_wherever_the_memory_of_a_chunk_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    # Noisy readings are recorded as they are: so many bytes that these fill the memory, and not the number of frames.
    noisy = Sensor(range_noise=0.05)
    for room in range(12_000, 14_000, 32):
        monkeypatch.setattr(frames, "_FIRST", room)
        monkeypatch.setattr(frames, "_LARGEST", room)
        replay = CMOMMT(robots=12, targets=14, radius=0.8, sensor=noisy, rng=1).record(steps=60)
        assert [frame.time for frame in replay.frames] == list(range(61)), room
