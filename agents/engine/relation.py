"""A relation: one group senses others in a channel. Percepts are made from relations."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.detection import Detection, Readings, Searched
from teamsight.agents.engine.records import Conditions
from teamsight.agents.sensing.sensor import BODIES, Sensor, View, salt_of
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.world.limits import farthest_of
from teamsight.world.noise import Stream, stream_number
from teamsight.world.search import BODY_LANES, Search

if TYPE_CHECKING:
    from teamsight.agents.channel import Channel
    from teamsight.agents.engine.binding import Sizes
    from teamsight.agents.engine.records import RelationArrays
    from teamsight.agents.group import Group
    from teamsight.agents.world_data import WorldData
    from teamsight.core.kernel import Packed
    from teamsight.world.occlusion import GatheringArrays

_PERFECT = Sensor()


class Relation:
    """Which agents of the groups of a channel each observer senses.

    Attributes
    ----------
    name : str
        The name of the channel.
    counts : bool
        Whether what is sensed counts in the observed fraction.
    observers, observed : Group, list of Group
        The group that observes, and those that it observes, in this order.
    identities : ndarray, shape (room,), int64
        The identities of the observed, and room for more.
    identity : ndarray, shape (k,), int64
        Room for the identities of all in range.
    is_conditional : bool
        Whether observers or observed can be inactive, or a sensor out of order.
    bodies : Packed of GatheringArrays or None
        The bodies that block the sight of the sensor; None if none do.
    detection : Detection or None
        What the sensor makes of them; None for a perfect sensor.
    """

    def __init__(
        self, channel: Channel, observers: Group, data: WorldData, bodies: Packed[GatheringArrays] | None
    ) -> None:
        self.name, self.counts = channel.name, channel.counts
        self.observers, self.observed = observers, list(channel.observed)
        sensor = channel.sensor or _PERFECT
        self.bodies = bodies if sensor.occluded == BODIES else None
        reach = observers.reach(channel.name)
        if sensor.range is not None:
            reach = np.full(len(observers), float(sensor.range))
        self._longest = float(reach.max(initial=0.0))
        data.arena.check_reach(self._longest)
        self.has_own_range = sensor.range is not None
        self.is_conditional = any(group.has_conditions for group in (observers, *self.observed))
        rows = observers.bodies.room, sum(group.bodies.room for group in self.observed)
        self.identities = np.zeros(rows[1], np.int64)
        self._reach_now = np.zeros(rows[0] if self.is_conditional else 0)
        np.concatenate([group.bodies.identity for group in self.observed], out=self.everyone)
        self._show_conditions(channel, reach)
        self._conditions.reach[:] = self._conditions.full
        self._search = Search(
            observers.bodies.position, self._searched(reach), len(self.everyone), self.own, data.arena,
            shape=observers.range_shape, rows=rows,
        )  # fmt: skip
        self.identity = np.zeros(len(self.search.room.identity), np.int64)
        self.detection: Detection | None = None
        if needs_detection(sensor, data.arena):
            searched = Searched(self.conditions.reach, self.search.x if self.is_conditional else self.search.x[:0])
            self.detection = Detection(sensor, self._view(data, self.own, reach), self._readings(sensor), searched)

    @property
    def first(self) -> dict[int, int]:
        """For each observed group's number, the index of its first agent among the observed."""
        sizes = [len(group) for group in self.observed]
        return dict(zip((group.number for group in self.observed), accumulate([0, *sizes[:-1]]), strict=True))

    @property
    def own(self) -> int:
        """The index of the first observer among the observed; −1 if it is none of them."""
        return self.first.get(self.observers.number, -1)

    @property
    def everyone(self) -> npt.NDArray[np.int64]:
        """The identities of the observed, shape (observed,)."""
        return self.identities[: sum(map(len, self.observed))]

    @property
    def search(self) -> Search:
        """The search for all in range; it finds indices among the observed."""
        search, size = self._search, sum(map(len, self.observed))
        if len(search.position) != len(self.observers) or len(search.x) != size:
            search.fit(self.observers.bodies.position, self._searched(self.observers.reach(self.name)), size)
        return search

    @property
    def conditions(self) -> Conditions:
        """Which observers sense; empty if nobody is ever inactive."""
        if self.is_conditional and len(self._conditions.full) != len(self.observers):
            self._show_conditions(self.observers.channels[self.name], self.observers.reach(self.name))
        return self._conditions

    def _searched(self, reach: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the ranges of the search: those of the observers, or those of observers that can be inactive."""
        return self.conditions.reach if self.is_conditional else reach

    def _show_conditions(self, channel: Channel, reach: npt.NDArray[np.float64]) -> None:
        """Show the conditions of the present observers, with these ranges; all empty if they never change."""
        size = len(self.observers) if self.is_conditional else 0
        self._conditions = Conditions(
            self.observers.bodies.active[:size], channel.works[:size], reach[:size], self._reach_now[:size]
        )

    @property
    def has_wide_cells(self) -> bool:
        """Whether nobody, of those who have come since, has a longer range than cells are wide."""
        return not self._search.has_cells or float(self.observers.reach(self.name).max(initial=0.0)) <= self._longest

    def follow(self, sizes: Sizes, record: Packed[RelationArrays], rows: npt.NDArray[np.int64]) -> None:
        """Let the records follow the sizes of groups; `rows` are those of `RelationArrays`, with all room."""
        observers, observed, search = [self.observers], self.observed, self._search.record
        sizes.add_relation(self, rows)
        search.follow(lambda: self.search.arrays(self.own))
        for packed in (record, search):
            sizes.add(packed.word("n"), observers)
        sizes.add(record.word("observed"), observed)
        if self.is_conditional:
            sizes.add(record.word("conditions..n"), observers)
        sizes.add(search.word("lanes"), observed, BODY_LANES)
        sizes.add(search.word("observed.size"), observed)
        if self.own >= 0:
            sizes.add(search.word("observed.own"), observed[: observed.index(self.observers)])

    def _view(self, data: WorldData, own: int, reach: npt.NDArray[np.float64]) -> View:
        group = self.observers
        view = View(
            data.moment, data.key, salt_of(self.name), stream_number(Stream.SENSOR, group.number), group.bodies.member,
            group.bodies.position, group.bodies.heading, reach, self.everyone, own, self.search.room,
            data.arena.sight, farthest_of(group.range_shape),
        )  # fmt: skip
        if self.bodies is None:
            return view
        return view._replace(identity=group.bodies.identity, opaque=self.bodies.value.opaque)

    def _readings(self, sensor: Sensor) -> Readings | None:
        """Return the readings on their way; those of another delay are dropped."""
        kept = self.observers.readings
        if not sensor.delay:
            kept.pop(self.name, None)
            return None
        if self.name not in kept or kept[self.name].delay != sensor.delay:
            kept[self.name] = Readings(sensor.delay)
        return kept[self.name]

    def grow(self, edges: int, *, detection: bool = False) -> None:
        """Make room for this many agents in range, or detections; records must be bound again."""
        if detection and self.detection:
            self.detection.grow(edges)
            return
        self.search.grow(edges)
        self.identity = np.zeros(len(self.search.room.identity), np.int64)
        if self.detection:
            self.detection.see(self.detection.view._replace(in_range=self.search.room))

    def agents(self, start: npt.NDArray[np.int64], indices: npt.NDArray[np.int64], row: int) -> list[Any]:
        """Return the agents of an observer in lists of indices: those of `graph`, or `true_lists`."""
        first = list(self.first.values())
        found = []
        for index in indices[start[row] : start[row + 1]]:
            place = bisect_right(first, index) - 1
            found.append(self.observed[place]._agents[index - first[place]])
        return found

    def observers_of(self, agent: Any) -> list[Any]:
        """Return the observers that sense an agent."""
        if agent.group.number not in self.first:
            return []
        start, indices = self.true_lists
        edges = np.flatnonzero(indices[: start[-1]] == self.first[agent.group.number] + agent.row)
        rows = np.searchsorted(start, edges, side="right") - 1
        return [self.observers._agents[row] for row in rows]

    @property
    def graph(self) -> NeighbourList:
        """All in range, by their indices among the observed."""
        return self.search.graph

    @property
    def true_lists(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """The agents that each observer senses, without false detections: ``start`` and indices, with unused room."""
        if self.detection:
            return self.detection.arrays.true_start, self.detection.arrays.true_index
        return self.search.room.start, self.search.room.identity

    @property
    def neighbours(self) -> NeighbourList:
        """What percepts show, by identities."""
        return filled(self.room)

    @property
    def room(self) -> NeighbourList:
        """The whole arrays behind `neighbours`."""
        if self.detection:
            return self.detection.arrays.shown
        start, _, offset, distance = self.search.room
        return NeighbourList(start, self.identity, offset, distance)

    @property
    def place(self) -> npt.NDArray[np.int64]:
        """The index among the observed of each entry of `room`."""
        return self.detection.arrays.shown_place if self.detection else self.search.room.identity


def counted_groups(relations: Sequence[Relation]) -> list[list[Group]]:
    """Return which agents can be observed: for each relation the groups that it counts and no earlier one does.

    The observed fraction of a world is the number of agents that are observed over the number that can be. An agent can
    be observed if some group senses its group in a channel that counts: by default "targets", of a group on a team;
    `World.senses` says otherwise by `counts`. It is observed if an agent of such a group senses it there. Whoever
    senses it, it counts once; while it is inactive it does not count.

    Parameters
    ----------
    relations : sequence of Relation
        Those of a world, in their order.

    Notes
    -----
    *Source:* §6, "during which targets are being monitored by at least one robot". *Departs:* the paper has one team
    and one group of targets.
    """
    known: set[int] = set()
    found = []
    for relation in relations:
        found.append([group for group in relation.observed if relation.counts and group.number not in known])
        known.update(group.number for group in found[-1])
    return found


def needs_detection(sensor: Sensor, arena: Any) -> bool:
    """Whether a sensor shows anything else than all in range."""
    if sensor is not _PERFECT and not sensor.is_perfect:
        return True
    sight = arena.sight
    return sensor.occluded and len(sight.segments) + len(sight.discs) > 0
