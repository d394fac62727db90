"""o(N): every teammate in range, and the targets that each of them senses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from teamsight.agents.awareness.interface import (
    OWN_SECTORS,
    Awareness,
    Width,
    read_ring,
    situate_targets,
    team_group_at,
)
from teamsight.agents.awareness.pairwise import slot_of
from teamsight.agents.awareness.team import group_of
from teamsight.core import checks
from teamsight.core.kernel import kernel


@kernel
def _perceive(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    room = relayed.distance.shape[0]
    need = 0
    for i in range(scene.heading.shape[0]):
        relayed.start[i] = need
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            group = team_group_at(group_of(scene.team, scene.place[k]))
            theirs = group.targets
            row = scene.place[k] - group.first
            for e in range(theirs.start[row], theirs.start[row + 1]):
                if need < room:
                    x = scene.teammates.offset[k, 0] + theirs.offset[e, 0]
                    y = scene.teammates.offset[k, 1] + theirs.offset[e, 1]
                    relayed.identity[need] = theirs.identity[e]
                    relayed.offset[need, 0] = x
                    relayed.offset[need, 1] = y
                    relayed.distance[need] = math.sqrt(x * x + y * y)
                need += 1
    relayed.start[scene.heading.shape[0]] = need
    return need


@kernel
def _situate(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    for i in range(situation.shape[0]):
        situation[i, OWN_SECTORS:] = 1.0
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            group = team_group_at(group_of(scene.team, scene.place[k]))
            theirs = group.targets
            row = scene.place[k] - group.first
            first = OWN_SECTORS + OWN_SECTORS * slot_of(scene.place[k], scene.first + i)
            edges = (theirs.start[row], theirs.start[row + 1])
            reach = group.sensing_range[row] * group.farthest
            read_ring(situation[i], first, OWN_SECTORS, group.heading[row], theirs, edges, reach)


@dataclass(frozen=True)
class SharedAwareness(Awareness):
    """o(N): as Θ(N), and the targets that each teammate in range senses, as relayed targets.

    The situation holds, for every teammate in the order of identities, that teammate's own 16 target sectors, relative
    to that teammate's heading. All are 1 if the teammate is out of range.

    Notes
    -----
    *Source:* §3.2, "sharing the n inputs of the other N robots". *Departs:* the paper writes o(N) for nN inputs, which
    in the usual notation is Θ(N) with a larger constant. The array has n(N − 1) inputs, for N − 1 teammates.
    """

    name = "shared"
    order = "o(N)"
    formula = "n + nN"
    shows = "every teammate's offset and the targets that it senses"
    shows_teammates = True
    perceive = _perceive
    situate = _situate
    delivers = ("targets", "teammates", "relayed")

    def width(self, team_size: int) -> Width:
        return Width(OWN_SECTORS, OWN_SECTORS * (checks.count("team_size", team_size) - 1))

    def rings(self, team_size: int) -> tuple[int, ...]:
        return (OWN_SECTORS,) * (team_size - 1)

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + own * team_size
