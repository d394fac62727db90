"""A relation: one group senses others in a channel. Percepts are made from relations."""

from __future__ import annotations

from bisect import bisect_right
from itertools import accumulate
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.detection import Detection, Readings, Searched
from teamsight.agents.engine.records import Conditions
from teamsight.agents.sensing.interface import View, salt_of
from teamsight.agents.sensing.sensor import Sensor
from teamsight.core.neighbour_list import filled
from teamsight.world.noise import Stream, stream_number
from teamsight.world.proximity.search import Search
from teamsight.world.proximity.shapes import farthest_of

if TYPE_CHECKING:
    from teamsight.agents.channel import Channel
    from teamsight.core.neighbour_list import NeighbourList
    from teamsight.core.table import Table

_PERFECT = Sensor()


class Members(Protocol):
    """The part of `Group` that a relation uses; groups import this file."""

    name: str
    number: int
    channels: dict[str, Channel]
    bodies: Table
    _agents: list[Any]
    readings: dict[str, Readings]
    has_conditions: bool

    @property
    def range_shape(self) -> str: ...
    @property
    def team(self) -> str | None: ...
    def reach(self, channel: str) -> npt.NDArray[np.float64]: ...
    def __len__(self) -> int: ...


class Surroundings(Protocol):
    """The part of `WorldData` that a relation uses."""

    arena: Any
    key: npt.NDArray[np.uint64]
    moment: npt.NDArray[np.int64]


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
    first : dict of int to int
        For each observed group's number, the index of its first agent among the observed.
    everyone : ndarray, shape (observed,), int64
        The identities of the observed.
    search : Search
        The search for all in range; it finds indices among the observed.
    identity : ndarray, shape (k,), int64
        Room for the identities of all in range.
    is_conditional : bool
        Whether observers or observed can be inactive, or a sensor out of order.
    conditions : Conditions
        Which observers sense; empty if nobody is ever inactive.
    detection : Detection or None
        What the sensor makes of them; None for a perfect sensor.
    """

    def __init__(self, channel: Channel, observers: Members, data: Surroundings) -> None:
        self.name, self.counts = channel.name, channel.counts
        self.observers, self.observed = observers, list(channel.observed)
        sensor = channel.sensor or _PERFECT
        reach = observers.reach(channel.name)
        if sensor.range is not None:
            reach = np.full(len(observers), float(sensor.range))
        self._longest = float(reach.max(initial=0.0))
        data.arena.check_reach(self._longest)
        self._own_reach = reach if sensor.range is not None else None
        self._rows = observers.bodies.room, sum(group.bodies.room for group in self.observed)
        self._identities = np.zeros(self._rows[1], np.int64)
        self.is_conditional = any(group.has_conditions for group in (observers, *self.observed))
        self._reach_now = np.zeros(self._rows[0] if self.is_conditional else 0)
        own = self._number_observed()
        self.conditions = self._conditions(channel, reach)
        self.search = Search(
            observers.bodies.position, self.conditions.reach if self.is_conditional else reach, len(self.everyone), own,
            data.arena, shape=observers.range_shape, rows=self._rows,
        )  # fmt: skip
        self.identity = np.zeros(len(self.search.room.identity), np.int64)
        self.detection: Detection | None = None
        if needs_detection(sensor, data.arena):
            searched = Searched(
                self.conditions.reach, self.search.x if self.is_conditional else self.search.x[:0]
            )
            self.detection = Detection(sensor, self._view(data, own, reach), self._readings(sensor), searched)

    def _number_observed(self) -> int:
        """Number the agents of the observed groups, one after the other; return the number of the first observer."""
        bodies = [group.bodies for group in self.observed]
        sizes = [len(one) for one in bodies]
        first = [0, *accumulate(sizes[:-1])]
        self.first = dict(zip((group.number for group in self.observed), first, strict=True))
        self.everyone = self._identities[: sum(sizes)]
        np.concatenate([one.identity for one in bodies], out=self.everyone)
        return self.first.get(self.observers.number, -1)

    def _conditions(self, channel: Channel, reach: npt.NDArray[np.float64]) -> Conditions:
        """Return the conditions of the observers, whose ranges these are; all empty if they never change."""
        size = len(reach) if self.is_conditional else 0
        active, works = (
            (self.observers.bodies.active, channel.works) if size else (np.zeros(0, np.bool_), np.zeros(0, np.bool_))
        )
        now = self._reach_now[:size]
        now[:] = reach[:size]
        return Conditions(active, works, reach[:size] if size else np.zeros(0), now)

    @property
    def can_fit(self) -> bool:
        """Whether `fit` can follow agents who come and leave.

        It cannot with a sensor, which keeps what it has measured, or where somebody has a longer range than cells are
        wide.
        """
        if self.detection is not None or self._own_reach is not None:
            return False
        return not self.search.has_cells or float(self.observers.reach(self.name).max(initial=0.0)) <= self._longest

    def fit(self) -> None:
        """Follow agents who have come or left, for whom there is room; the arrays stay where they are."""
        own, observers = self._number_observed(), self.observers
        reach = observers.reach(self.name)
        self.conditions = self._conditions(observers.channels[self.name], reach)
        now = self.conditions.reach if self.is_conditional else reach
        self.search.fit(observers.bodies.position, now, len(self.everyone), own)

    def _view(self, data: Surroundings, own: int, reach: npt.NDArray[np.float64]) -> View:
        group = self.observers
        return View(
            data.moment, data.key, salt_of(self.name), stream_number(Stream.SENSOR, group.number), group.bodies.member,
            group.bodies.position, group.bodies.heading, reach, self.everyone, own, self.search.room,
            data.arena.sight, farthest_of(group.range_shape),
        )  # fmt: skip

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

    def agents_in_range(self, row: int) -> list[Any]:
        """Return the agents within the range of an observer, whether or not it senses them."""
        return self._agents(self.graph.start, self.graph.identity, row)

    def agents_sensed(self, row: int) -> list[Any]:
        """Return the agents that an observer senses."""
        return self._agents(*self.true_lists, row)

    def _agents(self, start: npt.NDArray[np.int64], indices: npt.NDArray[np.int64], row: int) -> list[Any]:
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
        return self.search.room._replace(identity=self.identity)

    @property
    def place(self) -> npt.NDArray[np.int64]:
        """The index among the observed of each entry of `room`."""
        return self.detection.arrays.shown_place if self.detection else self.search.room.identity


def needs_detection(sensor: Sensor, arena: Any) -> bool:
    """Whether a sensor shows anything else than all in range."""
    if sensor is not _PERFECT and not sensor.is_perfect:
        return True
    sight = arena.sight
    return sensor.occluded and len(sight.segments) + len(sight.discs) > 0
