"""Eager learners: what they learn is worked out beforehand, for one reward, and the pairs are no longer needed.

They are the other side of the paper's comparison: a table of all situations, and a function that is fitted to them.
"""

from __future__ import annotations

from teamsight.policies.actions import ActionGrid
from teamsight.policies.eager.linear import LinearQ
from teamsight.policies.eager.state_grid import StateGrid
from teamsight.policies.eager.tabular import TabularQ

__all__ = ["ActionGrid", "LinearQ", "StateGrid", "TabularQ"]
