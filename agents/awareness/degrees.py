"""The degrees of awareness: what of its teammates a robot perceives, from nothing to the offset of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import (
    OWN_SECTORS,
    Awareness,
    Width,
    read_ring,
    sector_of,
    situate_targets,
    team_group_at,
)
from teamsight.agents.awareness.registry import Delta
from teamsight.core import checks
from teamsight.core.elementary import atan2
from teamsight.core.kernel import inlined, kernel


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


@kernel
def group_of(team: Any, place: int) -> int:
    """Return the address, for `team_group_at`, of the group to which the robot with this index in the team belongs."""
    at = 0
    group = team_group_at(team[at])
    while place >= group.first + group.heading.shape[0]:
        at += 1
        group = team_group_at(team[at])
    return team[at]  # type: ignore[no-any-return]


@kernel
def teammate_heading(scene: Any, k: int) -> tuple[float, float]:
    """Return the heading of the teammate of entry `k` of ``scene.teammates``, a unit vector along the arena's axes."""
    group = team_group_at(group_of(scene.team, scene.place[k]))
    row = scene.place[k] - group.first
    return group.heading[row, 0], group.heading[row, 1]


@inlined
def show(seen: Any, k: int, shown: Any, at: int) -> int:
    """Copy entry `k` of a neighbour list to entry `at` of another, if it has room; return the number of the next."""
    if at < shown.distance.shape[0]:
        shown.identity[at] = seen.identity[k]
        shown.offset[at, 0] = seen.offset[k, 0]
        shown.offset[at, 1] = seen.offset[k, 1]
        shown.distance[at] = seen.distance[k]
    return at + 1


@inlined
def next_nearest(seen: Any, first: int, end: int, last: int) -> int:
    """Return the entry that follows `last` in order of distance, those at one distance in order of identity.

    Parameters
    ----------
    seen : NeighbourList
        Its entries from `first` up to `end` are those of one robot, in the order of identities.
    first, end : int
        These entries.
    last : int
        The entry before; −1 for none. After the farthest entry the result is −1.
    """
    found = -1
    for k in range(first, end):
        if last >= 0 and (
            seen.distance[k] < seen.distance[last] or (seen.distance[k] == seen.distance[last] and k <= last)
        ):
            continue
        if found < 0 or seen.distance[k] < seen.distance[found]:
            found = k
    return found


#: σ, the readings of each teammate: its distance and its bearing.
SIGMA = 2


@kernel
def slot_of(place: int, own: int) -> int:
    """Return the index of robot `place` of a team among the teammates of robot `own`."""
    return place - 1 if place > own else place


@inlined
def _put_readings(scene: Any, i: int, k: int, row: Any, slot: int) -> None:
    """Write distance [range] and bearing of entry `k` of the teammates, anticlockwise from the heading [turns]."""
    seen = scene.teammates
    x = seen.offset[k, 0]
    y = seen.offset[k, 1]
    heading_x = scene.heading[i, 0]
    heading_y = scene.heading[i, 1]
    turn = atan2(y * heading_x - x * heading_y, x * heading_x + y * heading_y) / (2.0 * math.pi)
    at = OWN_SECTORS + SIGMA * slot
    row[at] = seen.distance[k] / (scene.awareness_range[i] * scene.farthest)
    row[at + 1] = turn + 1.0 if turn < 0.0 else turn


@kernel
def _situate_pairwise(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    seen = scene.teammates
    for i in range(situation.shape[0]):
        row = situation[i]
        row[OWN_SECTORS:] = 1.0
        for k in range(seen.start[i], seen.start[i + 1]):
            _put_readings(scene, i, k, row, slot_of(scene.place[k], scene.first + i))


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
    situate = _situate_pairwise
    delivers = ("targets", "teammates")

    def width(self, team_size: int) -> Width:
        return Width(OWN_SECTORS, SIGMA * (checks.count("team_size", team_size) - 1))

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + sigma * team_size


@kernel
def _perceive_shared(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
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
def _situate_shared(scene: Any, parameters: Any, situation: Any) -> None:
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
    perceive = _perceive_shared
    situate = _situate_shared
    delivers: ClassVar[tuple[str, ...]] = ("targets", "teammates", "relayed")

    def width(self, team_size: int) -> Width:
        return Width(OWN_SECTORS, OWN_SECTORS * (checks.count("team_size", team_size) - 1))

    def rings(self, team_size: int) -> tuple[int, ...]:
        return (OWN_SECTORS,) * (team_size - 1)

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + own * team_size


@kernel
def _perceive_ring(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
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
def _situate_ring(scene: Any, parameters: Any, situation: Any) -> None:
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
        Number of sectors, from 1 to 10,000; the paper's δ.

    Raises
    ------
    ValueError, TypeError
        If `delta` is not a whole number within these limits.

    Notes
    -----
    *Source:* §3.4 and §8. *Departs:* Fig. 1 requires δ < N, but the paper uses δ = 16 from N = 1 on; here any δ ≥ 1 is
    accepted for any team.
    """

    delta: Delta = 16

    name = "ring"
    order = "Θ(1)"
    formula = "n + δ"
    shows = "the nearest in each of δ sectors"
    teammate_layout = "sectors"
    perceive = _perceive_ring
    situate = _situate_ring
    delivers = ("targets", "teammates")

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


@kernel
def _perceive_nearest(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    seen = scene.teammates
    room = teammates.distance.shape[0]
    shown = 0
    for i in range(scene.heading.shape[0]):
        teammates.start[i] = shown
        first = seen.start[i]
        end = seen.start[i + 1]
        k = -1
        for _ in range(min(end - first, int(parameters[0]))):
            k = next_nearest(seen, first, end, k)
            if shown < room:
                show(seen, k, teammates, shown)
                teammates.identity[shown] = -1
            shown += 1
    teammates.start[scene.heading.shape[0]] = shown
    return shown


@kernel
def _situate_nearest(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    seen = scene.teammates
    for i in range(situation.shape[0]):
        row = situation[i]
        row[OWN_SECTORS:] = 1.0
        first = seen.start[i]
        end = seen.start[i + 1]
        k = -1
        for slot in range(min(end - first, int(parameters[0]))):
            k = next_nearest(seen, first, end, k)
            _put_readings(scene, i, k, row, slot)


@dataclass(frozen=True)
class NearestAwareness(Awareness):
    """Θ(1): the δ nearest teammates in awareness range, nearest first, without identity.

    The percept holds their exact offsets. Of two at the same distance, the one of smaller identity comes first. The
    situation holds, for each place of the list, the distance over the awareness range and the bearing, anticlockwise
    from the heading, as a fraction of a full turn. Both are 1 for an empty place. Unlike in a ring, teammates in one
    direction do not merge; those beyond the δ nearest are hidden.

    Parameters
    ----------
    delta : int, default 16
        Length of the list, from 1 to 10,000; the paper's δ.

    Raises
    ------
    ValueError, TypeError
        If `delta` is not a whole number within these limits.

    Notes
    -----
    *Source:* none; the paper's Θ(1) is a ring (§3.4). σ = 2 as in §3.3, so it adds σδ inputs where a ring adds δ.
    """

    delta: Delta = 16

    name = "nearest"
    order = "Θ(1)"
    formula = "n + σδ"
    shows = "the δ nearest teammates' offsets"
    teammate_layout = "offsets"
    perceive = _perceive_nearest
    situate = _situate_nearest
    delivers = ("targets", "teammates")

    def width(self, team_size: int) -> Width:
        checks.count("team_size", team_size)
        return Width(OWN_SECTORS, SIGMA * self.delta)

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + sigma * delta

    @classmethod
    def adding(cls, added: int) -> Self:
        return cls(max(added // SIGMA, 1))
