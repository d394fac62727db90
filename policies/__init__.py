"""What a robot decides: the interface of policies, its check, and the policies of the field."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if __name__ != "teamsight.policies":
    raise ImportError(
        "import teamsight.policies: the folder policies/ is a part of the package teamsight, not a package of its own"
    )

if TYPE_CHECKING:
    from teamsight.core.neighbour_list import NeighbourList
    from teamsight.policies.actions import go
    from teamsight.policies.adaptive_forces import AdaptiveForces
    from teamsight.policies.avoiding import Avoiding
    from teamsight.policies.basis import BasisBehaviours
    from teamsight.policies.braitenberg.adaptive_network import AdaptiveNetwork
    from teamsight.policies.braitenberg.vehicle import FixedPriority
    from teamsight.policies.channels import column_of
    from teamsight.policies.check import check_policy
    from teamsight.policies.compiled import CompiledPolicy
    from teamsight.policies.eager import LinearQ, TabularQ
    from teamsight.policies.evolved import Evolved
    from teamsight.policies.group_forces import GroupForces
    from teamsight.policies.handmade.a_cmommt import ACmommt
    from teamsight.policies.handmade.b_cmommt import BCmommt
    from teamsight.policies.handmade.centroid import Centroid
    from teamsight.policies.handmade.evasive import Evasive
    from teamsight.policies.handmade.follow_free import FollowFree
    from teamsight.policies.handmade.p_cmommt import PCmommt
    from teamsight.policies.handmade.random_walk import RandomWalk
    from teamsight.policies.handmade.seek_charger import SeekCharger
    from teamsight.policies.handmade.stationary import Stationary
    from teamsight.policies.handmade.surround_prey import SurroundPrey
    from teamsight.policies.interface import Action, Floats, Percept, Policy, PolicyArrays, PolicyState, turned
    from teamsight.policies.lazy.lazy_q import LazyQ, PessimisticLazyQ
    from teamsight.policies.lazy.lazy_regression import LazyRegression
    from teamsight.policies.lazy.sheppard_lazy_q import SheppardLazyQ
    from teamsight.policies.online.lattice_walk import BoundedWalk, LatticeWalk
    from teamsight.policies.online.modular_q import ModularQ
    from teamsight.policies.online.online_q import OnlineQ
    from teamsight.policies.online.prey_q import BoundedPreyQ, PreyQ
    from teamsight.policies.percept_of_one import PerceptOfOne, turn_to
    from teamsight.policies.registry import POLICIES
    from teamsight.policies.trained import Trained

_HOMES = {
    "ACmommt": "teamsight.policies.handmade.a_cmommt",
    "Action": "teamsight.policies.interface",
    "AdaptiveForces": "teamsight.policies.adaptive_forces",
    "AdaptiveNetwork": "teamsight.policies.braitenberg.adaptive_network",
    "Avoiding": "teamsight.policies.avoiding",
    "BCmommt": "teamsight.policies.handmade.b_cmommt",
    "BasisBehaviours": "teamsight.policies.basis",
    "BoundedPreyQ": "teamsight.policies.online.prey_q",
    "BoundedWalk": "teamsight.policies.online.lattice_walk",
    "Centroid": "teamsight.policies.handmade.centroid",
    "CompiledPolicy": "teamsight.policies.compiled",
    "Evasive": "teamsight.policies.handmade.evasive",
    "FixedPriority": "teamsight.policies.braitenberg.vehicle",
    "FollowFree": "teamsight.policies.handmade.follow_free",
    "Floats": "teamsight.policies.interface",
    "LazyQ": "teamsight.policies.lazy.lazy_q",
    "Evolved": "teamsight.policies.evolved",
    "GroupForces": "teamsight.policies.group_forces",
    "LazyRegression": "teamsight.policies.lazy.lazy_regression",
    "LinearQ": "teamsight.policies.eager",
    "LatticeWalk": "teamsight.policies.online.lattice_walk",
    "ModularQ": "teamsight.policies.online.modular_q",
    "OnlineQ": "teamsight.policies.online.online_q",
    "PreyQ": "teamsight.policies.online.prey_q",
    "PolicyArrays": "teamsight.policies.interface",
    "PolicyState": "teamsight.policies.interface",
    "POLICIES": "teamsight.policies.registry",
    "PCmommt": "teamsight.policies.handmade.p_cmommt",
    "Percept": "teamsight.policies.interface",
    "PerceptOfOne": "teamsight.policies.percept_of_one",
    "PessimisticLazyQ": "teamsight.policies.lazy.lazy_q",
    "Policy": "teamsight.policies.interface",
    "RandomWalk": "teamsight.policies.handmade.random_walk",
    "SeekCharger": "teamsight.policies.handmade.seek_charger",
    "SheppardLazyQ": "teamsight.policies.lazy.sheppard_lazy_q",
    "NeighbourList": "teamsight.core.neighbour_list",
    "Stationary": "teamsight.policies.handmade.stationary",
    "SurroundPrey": "teamsight.policies.handmade.surround_prey",
    "TabularQ": "teamsight.policies.eager",
    "Trained": "teamsight.policies.trained",
    "check_policy": "teamsight.policies.check",
    "column_of": "teamsight.policies.channels",
    "go": "teamsight.policies.actions",
    "turn_to": "teamsight.policies.percept_of_one",
    "turned": "teamsight.policies.interface",
}

__all__ = [
    "POLICIES", "ACmommt", "Action", "AdaptiveForces", "AdaptiveNetwork", "Avoiding", "BCmommt", "BasisBehaviours",
    "BoundedPreyQ", "BoundedWalk", "Centroid", "CompiledPolicy", "Evasive", "Evolved", "FixedPriority", "Floats",
    "FollowFree", "GroupForces", "LatticeWalk", "LazyQ", "LazyRegression", "LinearQ", "ModularQ", "NeighbourList",
    "OnlineQ", "PCmommt", "Percept", "PerceptOfOne", "PessimisticLazyQ", "Policy", "PolicyArrays", "PolicyState",
    "PreyQ", "RandomWalk", "SeekCharger", "SheppardLazyQ", "Stationary", "SurroundPrey", "TabularQ", "Trained",
    "check_policy", "column_of", "go", "turn_to", "turned",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
