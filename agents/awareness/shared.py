"""o(N): every teammate in range, and the targets that it senses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from teamsight.agents.awareness.interface import Awareness, Width
from teamsight.agents.awareness.none import situate_targets
from teamsight.agents.awareness.pairwise import slot_of
from teamsight.agents.awareness.sectors import OWN_SECTORS, read_ring
from teamsight.core import checks
from teamsight.core.kernel import array_at, kernel
from teamsight.core.neighbour_list import NeighbourList

# The columns of Scene.team: where a group begins in the team, its size, and its arrays' addresses.
FIRST, SIZE, START, IDENTITY, OFFSET, DISTANCE, HEADING, REACH = range(8)


@kernel
def _group_at(team: Any, place: int) -> int:
    group = 0
    while place >= team[group, FIRST] + team[group, SIZE]:
        group += 1
    return group


@kernel
def team_targets(team: Any, group: int) -> NeighbourList:
    """Return what a group of the team senses."""
    size = team[group, SIZE]
    start = array_at(team[group, START], size + 1, np.int64)
    edges = start[size]
    return NeighbourList(
        start,
        array_at(team[group, IDENTITY], edges, np.int64),
        array_at(team[group, OFFSET], (edges, 2), np.float64),
        array_at(team[group, DISTANCE], edges, np.float64),
    )


@kernel
def _perceive(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    room = relayed.distance.shape[0]
    told = 0
    for i in range(scene.heading.shape[0]):
        relayed.start[i] = told
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            group = _group_at(scene.team, scene.place[k])
            theirs = team_targets(scene.team, group)
            row = scene.place[k] - scene.team[group, FIRST]
            for e in range(theirs.start[row], theirs.start[row + 1]):
                if told < room:
                    x = scene.teammates.offset[k, 0] + theirs.offset[e, 0]
                    y = scene.teammates.offset[k, 1] + theirs.offset[e, 1]
                    relayed.identity[told] = theirs.identity[e]
                    relayed.offset[told, 0] = x
                    relayed.offset[told, 1] = y
                    relayed.distance[told] = math.sqrt(x * x + y * y)
                told += 1
    relayed.start[scene.heading.shape[0]] = told
    return told


@kernel
def _situate(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    for i in range(situation.shape[0]):
        situation[i, OWN_SECTORS:] = 1.0
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            group = _group_at(scene.team, scene.place[k])
            size = scene.team[group, SIZE]
            row = scene.place[k] - scene.team[group, FIRST]
            heading = array_at(scene.team[group, HEADING], (size, 2), np.float64)[row]
            reach = array_at(scene.team[group, REACH], size, np.float64)[row]
            theirs = team_targets(scene.team, group)
            first = OWN_SECTORS + OWN_SECTORS * slot_of(scene.place[k], scene.first + i)
            edges = (theirs.start[row], theirs.start[row + 1])
            read_ring(situation[i], first, OWN_SECTORS, heading, theirs, edges, reach)


@dataclass(frozen=True)
class SharedAwareness(Awareness):
    """o(N): as Θ(N), and the targets which each perceived teammate senses, as relayed.

    The situation holds, for every teammate in the order of identities, that teammate's own 16 target sectors, relative
    to its own heading; all are 1 while it is out of range.

    Notes
    -----
    *Source:* §3.2, "sharing the n inputs of the other N robots". *Departs:* the paper writes o(N) for nN inputs, which
    by the usual notation are Θ(N) with a larger constant; and the array has n(N − 1), for N − 1 teammates.
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

    @staticmethod
    def dimensions(own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + own * team_size
