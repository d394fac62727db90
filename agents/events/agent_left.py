"""The error of processes that wait for an agent that has left."""

from __future__ import annotations


class AgentLeftError(RuntimeError):
    """Raised in a process that waits for something that cannot come, because an agent has left the world."""
