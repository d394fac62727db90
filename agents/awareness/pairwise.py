"""Θ(N): every teammate in range, with identity and exact offset."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from teamsight.agents.awareness.interface import OWN_SECTORS, Awareness, Width, situate_targets
from teamsight.core import checks
from teamsight.core.kernel import inlined, kernel

#: σ, the readings of each teammate: its distance and its bearing.
SIGMA = 2


@kernel
def slot_of(place: int, own: int) -> int:
    """Return the index of robot `place` of a team among the teammates of robot `own`."""
    return place - 1 if place > own else place


@inlined
def bearing_of(seen: Any, k: int, heading_x: float, heading_y: float) -> Any:
    """Return the bearing of entry `k` of a neighbour list, anticlockwise from the heading, as a fraction of a turn."""
    x = seen.offset[k, 0]
    y = seen.offset[k, 1]
    turn = math.atan2(y * heading_x - x * heading_y, x * heading_x + y * heading_y) / (2.0 * math.pi)
    return turn + 1.0 if turn < 0.0 else turn


@kernel
def _situate(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    seen = scene.teammates
    for i in range(situation.shape[0]):
        row = situation[i]
        row[OWN_SECTORS:] = 1.0
        heading_x = scene.heading[i, 0]
        heading_y = scene.heading[i, 1]
        for k in range(seen.start[i], seen.start[i + 1]):
            at = OWN_SECTORS + SIGMA * slot_of(scene.place[k], scene.first + i)
            row[at] = seen.distance[k] / (scene.awareness_range[i] * scene.farthest)
            row[at + 1] = bearing_of(seen, k, heading_x, heading_y)


@dataclass(frozen=True)
class PairwiseAwareness(Awareness):
    """Θ(N): each teammate in awareness range, with identity and exact offset.

    The situation holds, for every teammate in the order of identities, its distance over the awareness range and its
    bearing, anticlockwise from the heading, as a fraction of a full turn. Both are 1 if the teammate is out of range.

    Notes
    -----
    *Source:* §3.3, σ = 2. *Departs:* the paper adds σN inputs; a robot has N − 1 teammates, so the array has σ(N − 1).
    """

    name = "pairwise"
    order = "Θ(N)"
    formula = "n + σN"
    shows = "every teammate's offset"
    shows_teammates = True
    teammate_layout = "offsets"
    situate = _situate
    delivers = ("targets", "teammates")

    def width(self, team_size: int) -> Width:
        return Width(OWN_SECTORS, SIGMA * (checks.count("team_size", team_size) - 1))

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + sigma * team_size
