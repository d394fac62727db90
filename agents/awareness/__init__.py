"""The four degrees of awareness."""

from __future__ import annotations

from teamsight.agents.awareness.check import check_awareness
from teamsight.agents.awareness.interface import Awareness, Scene, Width
from teamsight.agents.awareness.none import NoAwareness
from teamsight.agents.awareness.pairwise import PairwiseAwareness
from teamsight.agents.awareness.ring import RingAwareness
from teamsight.agents.awareness.shared import SharedAwareness

AWARENESS: dict[str, type[Awareness]] = {
    "none": NoAwareness,
    "ring": RingAwareness,
    "pairwise": PairwiseAwareness,
    "shared": SharedAwareness,
}

__all__ = [
    "AWARENESS", "Awareness", "NoAwareness", "PairwiseAwareness", "RingAwareness", "Scene", "SharedAwareness", "Width",
    "check_awareness",
]  # fmt: skip
