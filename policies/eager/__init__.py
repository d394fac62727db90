"""Eager learners, the paper's counterpart to lazy ones: values are computed beforehand, for one reward.

`TabularQ` uses a table of all situations, `LinearQ` a linear approximation.
"""

from __future__ import annotations

from teamsight.policies.actions import ActionGrid
from teamsight.policies.eager.linear import LinearQ
from teamsight.policies.eager.tabular import StateGrid, TabularQ

__all__ = ["ActionGrid", "LinearQ", "StateGrid", "TabularQ"]
