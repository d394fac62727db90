"""The lock of a study: one sweep of all, or shards of a job array side by side."""

from __future__ import annotations


class LockedError(ValueError):
    """Raised when another process holds the folder of a study."""
