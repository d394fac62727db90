"""Lazy memory: explore once, keep the pairs, and compute what they are worth when somebody asks."""

from __future__ import annotations

from teamsight.policies.memory.file import MemoryFileError
from teamsight.policies.memory.memory import LazyMemory

__all__ = ["LazyMemory", "MemoryFileError"]
