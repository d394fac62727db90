"""Every policy that goes by a name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from teamsight.policies.a_cmommt import ACmommt
from teamsight.policies.centroid import Centroid
from teamsight.policies.evasive import Evasive
from teamsight.policies.lazy_q import lazy_collective, lazy_cooperative
from teamsight.policies.learned import Learned
from teamsight.policies.random_walk import RandomWalk
from teamsight.policies.stationary import Stationary

#: By name what makes the policy.
POLICIES: dict[str, Callable[[], Any]] = {
    "a-cmommt": ACmommt,
    "centroid": Centroid,
    "evasive": Evasive,
    "lazy-collective": lazy_collective,
    "lazy-cooperative": lazy_cooperative,
    "learned": Learned,
    "random-walk": RandomWalk,
    "stationary": Stationary,
}
