"""Minds without a world: what a policy is told, what it may answer, and the policies of the field."""

from __future__ import annotations

if __name__ != "teamsight.policies":
    raise ImportError(
        "import teamsight.policies: the folder policies/ is a part of the package teamsight, not a package of its own"
    )

from teamsight.policies.a_cmommt import ACmommt
from teamsight.policies.centroid import Centroid
from teamsight.policies.check import check_policy
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.eager import LinearQ, TabularQ
from teamsight.policies.evasive import Evasive
from teamsight.policies.interface import Action, Memory, Percept, PerceptOfOne, Policy, Sightings, turned
from teamsight.policies.lazy_q import LazyQ
from teamsight.policies.learned import Learned
from teamsight.policies.pessimistic_lazy_q import PessimisticLazyQ
from teamsight.policies.random_walk import RandomWalk
from teamsight.policies.registry import POLICIES
from teamsight.policies.sheppard_lazy_q import SheppardLazyQ
from teamsight.policies.stationary import Stationary

__all__ = [
    "POLICIES", "ACmommt", "Action", "Centroid", "CompiledPolicy", "Evasive", "LazyQ", "Learned", "LinearQ", "Memory",
    "Percept", "PerceptOfOne", "PessimisticLazyQ", "Policy", "RandomWalk", "SheppardLazyQ", "Sightings", "Stationary",
    "TabularQ", "check_policy", "turned",
]  # fmt: skip
