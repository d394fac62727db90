"""The lazy memory: explored transitions, from which learners compute values for any reward."""

from __future__ import annotations

from teamsight.policies.memory.file import MemoryFileError
from teamsight.policies.memory.memory import LazyMemory

__all__ = ["LazyMemory", "MemoryFileError"]
