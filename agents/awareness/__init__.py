"""The degrees of awareness: what of its teammates a robot perceives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.awareness.check import check_awareness
    from teamsight.agents.awareness.interface import OWN_SECTORS, Awareness, Scene, Width, situate_targets
    from teamsight.agents.awareness.nearest import NearestAwareness
    from teamsight.agents.awareness.none import NoAwareness
    from teamsight.agents.awareness.pairwise import PairwiseAwareness
    from teamsight.agents.awareness.registry import AWARENESS
    from teamsight.agents.awareness.ring import RingAwareness
    from teamsight.agents.awareness.shared import SharedAwareness
    from teamsight.agents.awareness.team import show, teammate_heading

_HOMES = {
    "AWARENESS": "teamsight.agents.awareness.registry",
    "Awareness": "teamsight.agents.awareness.interface",
    "NearestAwareness": "teamsight.agents.awareness.nearest",
    "NoAwareness": "teamsight.agents.awareness.none",
    "OWN_SECTORS": "teamsight.agents.awareness.interface",
    "PairwiseAwareness": "teamsight.agents.awareness.pairwise",
    "RingAwareness": "teamsight.agents.awareness.ring",
    "Scene": "teamsight.agents.awareness.interface",
    "SharedAwareness": "teamsight.agents.awareness.shared",
    "Width": "teamsight.agents.awareness.interface",
    "check_awareness": "teamsight.agents.awareness.check",
    "show": "teamsight.agents.awareness.team",
    "situate_targets": "teamsight.agents.awareness.interface",
    "teammate_heading": "teamsight.agents.awareness.team",
}

__all__ = [
    "AWARENESS", "OWN_SECTORS", "Awareness", "NearestAwareness", "NoAwareness", "PairwiseAwareness", "RingAwareness",
    "Scene", "SharedAwareness", "Width", "check_awareness", "show", "situate_targets", "teammate_heading",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
