"""The degrees of awareness: what of its teammates a robot perceives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.awareness.check import check_awareness
    from teamsight.agents.awareness.degrees import (
        NearestAwareness,
        NoAwareness,
        PairwiseAwareness,
        RingAwareness,
        SharedAwareness,
        show,
        teammate_heading,
    )
    from teamsight.agents.awareness.interface import OWN_SECTORS, Awareness, Scene, Width, situate_targets
    from teamsight.agents.awareness.registry import AWARENESS

_HOMES = {
    "AWARENESS": "teamsight.agents.awareness.registry",
    "Awareness": "teamsight.agents.awareness.interface",
    "NearestAwareness": "teamsight.agents.awareness.degrees",
    "NoAwareness": "teamsight.agents.awareness.degrees",
    "OWN_SECTORS": "teamsight.agents.awareness.interface",
    "PairwiseAwareness": "teamsight.agents.awareness.degrees",
    "RingAwareness": "teamsight.agents.awareness.degrees",
    "Scene": "teamsight.agents.awareness.interface",
    "SharedAwareness": "teamsight.agents.awareness.degrees",
    "Width": "teamsight.agents.awareness.interface",
    "check_awareness": "teamsight.agents.awareness.check",
    "show": "teamsight.agents.awareness.degrees",
    "situate_targets": "teamsight.agents.awareness.interface",
    "teammate_heading": "teamsight.agents.awareness.degrees",
}

__all__ = [
    "AWARENESS", "OWN_SECTORS", "Awareness", "NearestAwareness", "NoAwareness", "PairwiseAwareness", "RingAwareness",
    "Scene", "SharedAwareness", "Width", "check_awareness", "show", "situate_targets", "teammate_heading",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
