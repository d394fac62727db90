"""Types of what users give: policies and degrees of awareness as objects or by name, and other names.

The names are for completion in editors; a test compares them with the registries. Any other name is a ``str``.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from teamsight.agents.awareness.interface import Awareness
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import Rule

PolicyName: TypeAlias = Literal[
    "a-cmommt", "centroid", "evasive", "evolved", "lazy-collective", "lazy-cooperative", "random-walk", "stationary"
]
AwarenessName: TypeAlias = Literal["none", "ring", "pairwise", "shared"]
PlacementName: TypeAlias = Literal["uniform", "spread"]
PresetName: TypeAlias = Literal["touzet2000"]

PolicyLike: TypeAlias = Policy | Rule | PolicyName | str
AwarenessLike: TypeAlias = Awareness | AwarenessName | str
