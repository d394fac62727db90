"""Every policy that goes by a name."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from teamsight.policies.evolved import Evolved
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.centroid import Centroid
from teamsight.policies.handmade.evasive import Evasive
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.handmade.stationary import Stationary
from teamsight.policies.lazy.lazy_q import lazy_collective, lazy_cooperative

#: By name what makes the policy.
POLICIES: dict[str, Callable[[], Any]] = {
    "a-cmommt": ACmommt,
    "centroid": Centroid,
    "evasive": Evasive,
    "lazy-collective": lazy_collective,
    "lazy-cooperative": lazy_cooperative,
    "evolved": Evolved,
    "random-walk": RandomWalk,
    "stationary": Stationary,
}


def options_of(name: str) -> tuple[str, ...]:
    """Return the options of a policy by name: the parameters of what makes it."""
    return tuple(inspect.signature(POLICIES[name]).parameters)
