"""Parts: the Parquet files of a shard, named by digests of their runs and of their bytes."""

from __future__ import annotations

from typing import NamedTuple


class Damaged(NamedTuple):
    """A part that is damaged, and how."""

    kind: str
    name: str
    reason: str


class DamagedError(ValueError):
    """Raised when a part that shall be read is damaged."""
