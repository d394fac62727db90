"""The evolved policy: observe targets by forces whose laws were found by evolution."""

from __future__ import annotations

from teamsight.policies.evolved.policy import Evolved

__all__ = ["Evolved"]
