"""The frames that a live run keeps for a recording: the newest ones, within limits of number and memory."""

from __future__ import annotations

from collections import deque
from itertools import accumulate, takewhile

#: Of each world: frames, and bytes of memory.
MOST_FRAMES, MOST_BYTES = 20_000, 64 * 2**20


class Kept:
    """The newest frames of one world, as raw blocks."""

    def __init__(self) -> None:
        self._blocks: deque[bytes] = deque()
        self._bytes = 0

    def __len__(self) -> int:
        return len(self._blocks)

    def append(self, block: bytes) -> None:
        """Keep a frame, and drop the oldest ones beyond the limits."""
        self._blocks.append(block)
        self._bytes += len(block)
        while len(self._blocks) > MOST_FRAMES or (self._bytes > MOST_BYTES and len(self._blocks) > 1):
            self._bytes -= len(self._blocks.popleft())

    def replace_last(self, block: bytes) -> None:
        """Keep a frame in place of the newest one, of which it is another view."""
        if self._blocks:
            self._bytes -= len(self._blocks.pop())
        self.append(block)

    def clear(self) -> None:
        """Drop all."""
        self._blocks.clear()
        self._bytes = 0

    def blocks(self, most: int | None = None) -> list[bytes]:
        """Return the frames, the oldest first, or the newest of them that have at most so many bytes."""
        blocks = list(self._blocks)
        if most is not None and self._bytes > most:
            sizes = accumulate(map(len, reversed(blocks)))
            blocks = blocks[len(blocks) - sum(1 for _ in takewhile(lambda size: size <= most, sizes)) :]
        return blocks
