"""The learned rule: observe targets by forces whose laws evolution found."""

from __future__ import annotations

from teamsight.policies.learned.policy import Learned

__all__ = ["Learned"]
