"""Awareness over several hops: robots pass on what they know of teammates and targets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.degrees import SharedAwareness, group_of, slot_of
from teamsight.agents.awareness.interface import (
    OWN_SECTORS,
    past_at,
    read_ring,
    situate_targets,
    team_group_at,
)
from teamsight.agents.sensing.sensor import MOST_DELAY, Delay
from teamsight.core import checks
from teamsight.core.component import Allowed, Probability
from teamsight.core.kernel import kernel

#: In place of a number of hops: as many as the team has robots, less one.
ALL: Literal["all"] = "all"


class Entries(NamedTuple):
    """A neighbour list of one tick; `index` holds places in the team, or identities of targets."""

    start: Any
    index: Any
    offset: Any
    distance: Any


@kernel
def has_reports(group: Any, age: int) -> bool:
    """Return whether a group of a team has reports of so many ticks ago."""
    if group.past.shape[0] == 0:
        return True
    past = past_at(group.past[0])
    tick = past.newest[0] - age
    return tick >= 0 and past.links.tick[tick % past.links.tick.shape[0]] == tick  # type: ignore[no-any-return]


@kernel
def _slot(past: Any, age: int) -> int:
    """Return the slot of the reports of so many ticks ago."""
    return (past.newest[0] - age) % past.links.tick.shape[0]  # type: ignore[no-any-return]


@kernel
def links_at(group: Any, age: int) -> Any:
    """Return the teammates that the robots of a group sensed so many ticks ago; `has_reports` says if it is known."""
    if group.past.shape[0] == 0:
        return Entries(group.teammates.start, group.place, group.teammates.offset, group.teammates.distance)
    past = past_at(group.past[0])
    links = past.links
    slot = _slot(past, age)
    return Entries(links.start[slot], links.place[slot], links.offset[slot], links.distance[slot])


@kernel
def targets_at(group: Any, age: int) -> Any:
    """Return the targets that the robots of a group sensed so many ticks ago, as `links_at`."""
    if group.past.shape[0] == 0:
        return Entries(group.targets.start, group.targets.identity, group.targets.offset, group.targets.distance)
    past = past_at(group.past[0])
    targets = past.targets
    slot = _slot(past, age)
    return Entries(targets.start[slot], targets.identity[slot], targets.offset[slot], targets.distance[slot])


@kernel
def _is_active_target(group: Any, e: int, age: int) -> bool:
    """Return whether a target of `targets_at` is active now."""
    if group.past.shape[0] == 0:
        return True
    past = past_at(group.past[0])
    return past.target_x.shape[0] == 0 or not math.isnan(past.target_x[past.targets.place[_slot(past, age), e]])


# Columns of `Scene.marks`: the hops to a robot (0 for unknown), the last round in which it was reached, and two lists
# of the robots reached in a round, which take turns. Columns of `Scene.sums`: offset and distance of a robot that is
# known, and the offsets in the two lists, by robot.
_HOPS, _ROUND, _LISTS = 0, 1, 2
_KNOWN, _WAYS = 0, 3


@kernel
def spread(scene: Any, i: int, hops: int, delay: int) -> None:
    """Write into `Scene.marks` and `Scene.sums` which teammates robot `i` knows, over how many hops, and where.

    A breadth-first search over links, of which those of hop h are as old as h delays. With a delay a robot is passed
    again, since what it hears later can be new. Of the shortest ways to a robot the first counts, by the order of the
    robots in the team.
    """
    marks = scene.marks
    sums = scene.sums
    if marks.shape[0] == 0:
        return
    for place in range(marks.shape[0]):
        marks[place, _HOPS] = 0
        marks[place, _ROUND] = 0
    own = scene.first + i
    mine = team_group_at(group_of(scene.team, own))
    if mine.past.shape[0] > 0:
        reach = past_at(mine.past[0]).reach
        if reach.shape[0] > 0 and reach[i] < 0.0:
            return
    marks[0, _LISTS] = own
    count = 1
    for hop in range(1, hops + 1):
        into = hop % 2
        out = 1 - into
        reached = 0
        for at in range(count):
            via = marks[at, _LISTS + out]
            group = team_group_at(group_of(scene.team, via))
            if not has_reports(group, hop * delay):
                continue
            links = links_at(group, hop * delay)
            for k in range(links.start[via - group.first], links.start[via - group.first + 1]):
                place = links.index[k]
                is_new = marks[place, _HOPS] == 0 and place != own
                if marks[place, _ROUND] == hop or not (is_new or delay > 0):
                    continue
                x = links.offset[k, 0]
                y = links.offset[k, 1]
                distance = links.distance[k]
                if hop > 1:
                    x += sums[via, _WAYS + 2 * out]
                    y += sums[via, _WAYS + 2 * out + 1]
                    distance = math.sqrt(x * x + y * y)
                marks[place, _ROUND] = hop
                marks[reached, _LISTS + into] = place
                sums[place, _WAYS + 2 * into] = x
                sums[place, _WAYS + 2 * into + 1] = y
                reached += 1
                if is_new:
                    marks[place, _HOPS] = hop
                    sums[place, _KNOWN] = x
                    sums[place, _KNOWN + 1] = y
                    sums[place, _KNOWN + 2] = distance
        count = reached
        if count == 0:
            return


@kernel
def _is_shown(scene: Any, place: int) -> bool:
    """Return whether a robot of the team is known and active now."""
    if scene.marks[place, _HOPS] == 0:
        return False
    past = team_group_at(scene.team[0]).past
    if past.shape[0] == 0:
        return True
    x = past_at(past[0]).x
    return x.shape[0] == 0 or not math.isnan(x[place])


@kernel
def _hops_of(scene: Any, parameters: Any) -> int:
    """Return the number of hops, which is given or that to reach all robots of the team."""
    return int(parameters[0]) if parameters[0] > 0.0 else scene.marks.shape[0] - 1


@kernel
def _perceive_relayed(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    delay = int(parameters[1])
    shown = 0
    need = 0
    for i in range(scene.heading.shape[0]):
        teammates.start[i] = shown
        relayed.start[i] = need
        if scene.marks.shape[0] == 0:
            continue
        spread(scene, i, _hops_of(scene, parameters), delay)
        for place in range(scene.marks.shape[0]):
            if not _is_shown(scene, place):
                continue
            group = team_group_at(group_of(scene.team, place))
            row = place - group.first
            x = scene.sums[place, _KNOWN]
            y = scene.sums[place, _KNOWN + 1]
            if shown < teammates.distance.shape[0]:
                teammates.identity[shown] = group.identity[row]
                teammates.offset[shown, 0] = x
                teammates.offset[shown, 1] = y
                teammates.distance[shown] = scene.sums[place, _KNOWN + 2]
            shown += 1
            age = scene.marks[place, _HOPS] * delay
            if not has_reports(group, age):
                continue
            theirs = targets_at(group, age)
            for e in range(theirs.start[row], theirs.start[row + 1]):
                if not _is_active_target(group, e, age):
                    continue
                if need < relayed.distance.shape[0]:
                    there_x = x + theirs.offset[e, 0]
                    there_y = y + theirs.offset[e, 1]
                    relayed.identity[need] = theirs.index[e]
                    relayed.offset[need, 0] = there_x
                    relayed.offset[need, 1] = there_y
                    relayed.distance[need] = math.sqrt(there_x * there_x + there_y * there_y)
                need += 1
    teammates.start[scene.heading.shape[0]] = shown
    relayed.start[scene.heading.shape[0]] = need
    return max(shown, need)


@kernel
def _situate_relayed(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    delay = int(parameters[1])
    for i in range(situation.shape[0]):
        situation[i, OWN_SECTORS:] = 1.0
        if scene.marks.shape[0] == 0:
            continue
        spread(scene, i, _hops_of(scene, parameters), delay)
        for place in range(scene.marks.shape[0]):
            age = scene.marks[place, _HOPS] * delay
            group = team_group_at(group_of(scene.team, place))
            if not _is_shown(scene, place) or not has_reports(group, age):
                continue
            row = place - group.first
            theirs = targets_at(group, age)
            heading = group.heading[row]
            if group.past.shape[0] > 0:
                past = past_at(group.past[0])
                heading = past.heading[_slot(past, age), row]
            first = OWN_SECTORS + OWN_SECTORS * slot_of(place, scene.first + i)
            edges = (theirs.start[row], theirs.start[row + 1])
            reach = group.sensing_range[row] * group.farthest
            read_ring(situation[i], first, OWN_SECTORS, heading, theirs, edges, reach)


def _hops(name: str, value: Any) -> Any:
    if isinstance(value, str):
        return checks.choice(name, value, [ALL])
    cure = f'for robots that know nobody use NoAwareness(), or awareness="none"; for all hops "{ALL}"'
    return checks.count(name, value, least=1, cure=cure)


@dataclass(frozen=True)
class RelayedAwareness(SharedAwareness):
    """As `SharedAwareness`, over several hops: robots pass on the reports of teammates that they hear.

    At each tick every robot reports where it is and the targets that it senses. A report goes from a robot to those
    that sense it as a teammate, within their awareness range, and from these to others: at most `hops` times. Each hop
    takes `delay` ticks and fails with the probability `loss`. So a robot knows a teammate h hops away as it was
    h · delay ticks ago. Of several reports it uses that with the fewest hops.

    The percept holds each teammate that is known, with identity and offset, the sum of those along the way; and its
    targets, as relayed targets. The situation is that of `SharedAwareness`.

    Parameters
    ----------
    hops : int or "all", default "all"
        The most hops of a report; less than there are robots. "all" reaches whoever can be reached.
    delay : int, default 0
        How long a hop takes [ticks]; all hops take at most 1,000 ticks.
    loss : float, default 0
        The probability that a report is not heard, for each pair of robots and tick on its own.

    Raises
    ------
    ValueError, TypeError
        If a value is of the wrong type or outside its limits; in a world, if `hops` is not less than the number of
        robots, or all hops take too long.

    Notes
    -----
    *Source:* none. With one hop, no delay and no loss it is `SharedAwareness`, to the last bit.
    """

    hops: Annotated[int | Literal["all"], Allowed(check=_hops)] = ALL
    delay: Delay = 0
    loss: Probability = 0.0

    name = "relayed"
    order = "o(N)"
    formula = "n + nN"
    shows = "the offset of every teammate that can be reached, and the targets that it senses"
    shows_teammates = False
    perceive = _perceive_relayed
    situate = _situate_relayed
    delivers = ("targets", "teammates", "relayed", "identities")
    spreads = True

    @property
    def parameters(self) -> npt.NDArray[np.float64]:
        return np.array([0.0 if self.hops == ALL else float(self.hops), float(self.delay)])

    def memory(self, team_size: int) -> int:
        return self.delay * (max(team_size - 1, 1) if self.hops == ALL else int(self.hops))

    def check_team(self, team_size: int, present: int) -> None:
        if self.hops != ALL and int(self.hops) > max(team_size - 1, 1):
            raise ValueError(
                f"hops={self.hops}: must be at most {max(team_size - 1, 1)} in a team of {team_size}, where no way is "
                f'longer; give fewer, or "{ALL}"'
            )
        if self.memory(present) > MOST_DELAY:
            raise ValueError(
                f"delay={self.delay}: {self.memory(present)} ticks for hops={self.hops!r} in a team of {present}; "
                f"all hops must take at most {MOST_DELAY}, so give a shorter delay or fewer hops"
            )
