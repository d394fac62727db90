"""Θ(0): a robot perceives no teammate."""

from __future__ import annotations

from dataclasses import dataclass

from teamsight.agents.awareness.interface import Awareness, Width
from teamsight.core import checks


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

    def width(self, team_size: int) -> Width:
        checks.count("team_size", team_size)
        return super().width(team_size)
