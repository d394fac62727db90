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
        group_of,
        show,
        teammate_heading,
    )
    from teamsight.agents.awareness.interface import (
        OWN_SECTORS,
        Awareness,
        Past,
        Scene,
        TeamGroup,
        Width,
        past_at,
        situate_targets,
        team_group_at,
    )
    from teamsight.agents.awareness.registry import AWARENESS
    from teamsight.agents.awareness.relayed import RelayedAwareness, has_reports, links_at, spread, targets_at

_HOMES = {
    "AWARENESS": "teamsight.agents.awareness.registry",
    "Awareness": "teamsight.agents.awareness.interface",
    "NearestAwareness": "teamsight.agents.awareness.degrees",
    "NoAwareness": "teamsight.agents.awareness.degrees",
    "OWN_SECTORS": "teamsight.agents.awareness.interface",
    "Past": "teamsight.agents.awareness.interface",
    "PairwiseAwareness": "teamsight.agents.awareness.degrees",
    "RelayedAwareness": "teamsight.agents.awareness.relayed",
    "RingAwareness": "teamsight.agents.awareness.degrees",
    "Scene": "teamsight.agents.awareness.interface",
    "SharedAwareness": "teamsight.agents.awareness.degrees",
    "TeamGroup": "teamsight.agents.awareness.interface",
    "Width": "teamsight.agents.awareness.interface",
    "check_awareness": "teamsight.agents.awareness.check",
    "group_of": "teamsight.agents.awareness.degrees",
    "has_reports": "teamsight.agents.awareness.relayed",
    "links_at": "teamsight.agents.awareness.relayed",
    "past_at": "teamsight.agents.awareness.interface",
    "show": "teamsight.agents.awareness.degrees",
    "situate_targets": "teamsight.agents.awareness.interface",
    "spread": "teamsight.agents.awareness.relayed",
    "targets_at": "teamsight.agents.awareness.relayed",
    "team_group_at": "teamsight.agents.awareness.interface",
    "teammate_heading": "teamsight.agents.awareness.degrees",
}

__all__ = [
    "AWARENESS", "OWN_SECTORS", "Awareness", "NearestAwareness", "NoAwareness", "PairwiseAwareness", "Past",
    "RelayedAwareness", "RingAwareness", "Scene", "SharedAwareness", "TeamGroup", "Width", "check_awareness",
    "group_of", "has_reports", "links_at", "past_at", "show", "situate_targets", "spread", "targets_at",
    "team_group_at", "teammate_heading",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
