"""Θ(0): a robot perceives no teammate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamsight.agents.awareness.interface import Awareness, Width
from teamsight.agents.awareness.sectors import OWN_SECTORS, read_ring
from teamsight.core import checks
from teamsight.core.kernel import kernel


@kernel
def situate_targets(scene: Any, parameters: Any, situation: Any) -> None:
    """Write the own part of the situation: a heading-relative ring of target sectors."""
    targets = scene.targets
    for i in range(situation.shape[0]):
        edges = (targets.start[i], targets.start[i + 1])
        read_ring(situation[i], 0, OWN_SECTORS, scene.heading[i], targets, edges, scene.sensing_range[i])


@dataclass(frozen=True)
class NoAwareness(Awareness):
    """Θ(0): a robot perceives no teammate; the inputs are its own 16 target sectors.

    Notes
    -----
    *Source:* §3.1.
    """

    name = "none"
    order = "Θ(0)"
    formula = "n"
    shows = "no teammate is perceived"
    situate = situate_targets

    def width(self, team_size: int) -> Width:
        checks.count("team_size", team_size)
        return Width(OWN_SECTORS, 0)
