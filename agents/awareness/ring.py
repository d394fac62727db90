"""Θ(1): a ring of δ sectors, each showing the nearest teammate in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import OWN_SECTORS, Awareness, Width, read_ring, sector_of, situate_targets
from teamsight.core import checks
from teamsight.core.kernel import kernel

#: Largest number of sectors; more would fill memory with empty sectors.
MOST_SECTORS = 10_000


@kernel
def _perceive(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    sectors = parameters.shape[0] // 2
    seen = scene.teammates
    room = teammates.distance.shape[0]
    # Teammates in one sector merge, so there are no more entries than teammates in range.
    if seen.start[scene.heading.shape[0]] > room:
        return int(seen.start[scene.heading.shape[0]])
    shown = 0
    for i in range(scene.heading.shape[0]):
        teammates.start[i] = shown
        heading_x = scene.heading[i, 0]
        heading_y = scene.heading[i, 1]
        begin = shown
        for k in range(seen.start[i], seen.start[i + 1]):
            sector = sector_of(seen.offset[k, 0], seen.offset[k, 1], heading_x, heading_y, sectors)
            distance = seen.distance[k]
            at = begin
            # Until the row is complete, `identity` holds the sectors, in ascending order.
            while at < shown and teammates.identity[at] < sector:
                at += 1
            if at < shown and teammates.identity[at] == sector:
                teammates.distance[at] = min(teammates.distance[at], distance)
                continue
            for later in range(shown, at, -1):
                teammates.identity[later] = teammates.identity[later - 1]
                teammates.distance[later] = teammates.distance[later - 1]
            teammates.identity[at] = sector
            teammates.distance[at] = distance
            shown += 1
        for at in range(begin, shown):
            cosine = parameters[2 * teammates.identity[at]]
            sine = parameters[2 * teammates.identity[at] + 1]
            teammates.offset[at, 0] = teammates.distance[at] * (cosine * heading_x - sine * heading_y)
            teammates.offset[at, 1] = teammates.distance[at] * (sine * heading_x + cosine * heading_y)
            teammates.identity[at] = -1
    teammates.start[scene.heading.shape[0]] = shown
    return shown


@kernel
def _situate(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    # Read from the true surroundings; the percept puts teammates at the centres of their sectors.
    seen = scene.teammates
    for i in range(situation.shape[0]):
        edges = (seen.start[i], seen.start[i + 1])
        sectors = parameters.shape[0] // 2
        reach = scene.awareness_range[i] * scene.farthest
        read_ring(situation[i], OWN_SECTORS, sectors, scene.heading[i], seen, edges, reach)


@dataclass(frozen=True)
class RingAwareness(Awareness):
    """Θ(1): for each of δ heading-relative sectors the nearest teammate, without identity.

    The percept holds its exact distance, with the centre of the sector as bearing; teammates in one sector merge. The
    centre of sector 0 is straight ahead.

    Parameters
    ----------
    delta : int, default 16
        Number of sectors, from 1 to `MOST_SECTORS`; the paper's δ.

    Raises
    ------
    ValueError, TypeError
        If `delta` is not a whole number within these limits.

    Notes
    -----
    *Source:* §3.4 and §8. *Departs:* Fig. 1 requires δ < N, but the paper uses δ = 16 from N = 1 on; here any δ ≥ 1 is
    accepted for any team.
    """

    delta: int = 16

    name = "ring"
    order = "Θ(1)"
    formula = "n + δ"
    shows = "the nearest in each of δ sectors"
    teammate_layout = "sectors"
    perceive = _perceive
    situate = _situate
    delivers = ("targets", "teammates")

    def __post_init__(self) -> None:
        cure = "a ring needs at least 1 sector; for no awareness use NoAwareness()"
        delta = checks.count("delta", self.delta, cure=cure)
        if delta > MOST_SECTORS:
            raise ValueError(
                f"delta={checks.shown(delta)}: must be at most {MOST_SECTORS}, since a situation has an input for each "
                "sector; 360 sectors of one degree are enough for most uses"
            )
        object.__setattr__(self, "delta", delta)

    @property
    def parameters(self) -> npt.NDArray[np.float64]:
        angle = 2 * math.pi * np.arange(self.delta) / self.delta
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1).ravel()

    def width(self, team_size: int) -> Width:
        checks.count("team_size", team_size)
        return Width(OWN_SECTORS, self.delta)

    def rings(self, team_size: int) -> tuple[int, ...]:
        return (self.delta,)

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + delta

    @classmethod
    def adding(cls, added: int) -> Self:
        return cls(added)
