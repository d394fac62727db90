"""The learned rule: observe targets by forces whose laws evolution found."""

from __future__ import annotations

from teamsight.policies.evolved.policy import Evolved

__all__ = ["Evolved"]
