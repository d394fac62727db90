"""A limit for tests that wait for other processes: one that hangs fails, with the place where it hangs."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from types import FrameType

import pytest


@pytest.fixture(autouse=True)
def time_limit() -> Iterator[None]:
    """End a test after half an hour."""
    if not hasattr(signal, "SIGALRM"):
        yield
        return

    def end(number: int, frame: FrameType | None) -> None:
        raise TimeoutError("the test takes longer than half an hour")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(1800)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
