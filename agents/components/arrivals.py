"""Agents that arrive in a group, and agents that leave it."""

from __future__ import annotations

import contextlib
import inspect
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.agents.components.durations import Duration, Times, TimeTo, lasting, length, next_time, time_to
from teamsight.agents.components.failures import Coming, check_members
from teamsight.agents.events.sources import EventSource
from teamsight.agents.group import Group
from teamsight.agents.host import forget_members, newcomers
from teamsight.core import checks
from teamsight.core.component import Count
from teamsight.world.placement import NoRoomError

if TYPE_CHECKING:
    from teamsight.agents.attributes import Points
    from teamsight.agents.body import Body


class _Leaving(EventSource):
    """A source whose agents may leave."""

    def leave(self, member: int) -> None:
        """Let an agent leave."""
        agent = self.agent(member)
        if agent is not None:
            agent.remove()

    def _plan(self, time: float, method: str, argument: int) -> None:
        if time < math.inf:
            self.plan(time, method, argument)


class Arrivals(_Leaving, Coming):
    """Agents arrive in a group, one at a time, and may leave after a stay.

    The log says "joined" and "left", and "turned away" of an arrival that found the group full, or no room.

    Parameters
    ----------
    interval : float, Duration or Times
        The time from one arrival to the next [ticks]: the mean of an exponential time, a duration, or the times of
        arrivals since the start of the run.
    stay : float, Duration or Times, optional
        How long each stays [ticks]; by default to the end. `Times` are those of the first to arrive, the second, ….
    position : array_like, shape (2,), optional
        Where they arrive [length]; by default anywhere in the arena.
    most : int, optional
        The number of agents with which the group is full.
    **abilities
        What else `Group.add` takes: speed, ranges, values of columns, arguments of the class.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits; when attached, if a listed time has passed, or if
        `Group.add` would refuse an arrival, as it does a value for a column that has not been added.

    Notes
    -----
    A reset removes those who have arrived.
    """

    changing = ("_arrived",)

    def __init__(
        self,
        interval: float | Duration | Times,
        stay: float | Duration | Times | None = None,
        *,
        position: Points | None = None,
        most: Count | None = None,
        **abilities: Any,
    ) -> None:
        self.interval = time_to("interval", interval)
        self.stay = lasting("stay", stay)
        for name, value in (("interval", self.interval), ("stay", self.stay)):
            if isinstance(value, Times) and isinstance(value.times, Mapping):
                raise ValueError(
                    f"{name}={value!r}: arrivals have one list, not one for each member; give it, as in "
                    "Times([100, 250])"
                )
        if position is not None:
            place = np.asarray(position, float)
            if place.shape != (2,) or not np.isfinite(place).all():
                raise ValueError(f"position={checks.shown(position)}: must be (x, y) [length], or None for anywhere")
            position = tuple(place.tolist())
        self.position = position
        self.most = None if most is None else checks.count("most", most)
        self.abilities = abilities

    def connect(self) -> None:
        """Note who is there before anybody arrives, and refuse arguments that none who arrives could have."""
        if "_first" not in vars(self):
            self._check()
            self._first = self._its_group().members_so_far, self.world.agent_id_counter

    @property
    def guests(self) -> Sequence[int]:  # type: ignore[override]
        """Those who have arrived."""
        return self._arrived

    def reset(self) -> None:
        """Remove those who have arrived, so that the next to arrive have their numbers."""
        for member in list(self._arrived):
            self.leave(member)
        members, identity = self._first
        group, world = self._its_group(), self.world
        forget_members(group, max(members, int(group.bodies.member.max(initial=-1)) + 1))
        world.agent_id_counter = max([identity, *(agent.unique_id + 1 for agent in world.agents)])

    def begin(self) -> None:
        """Plan the first arrival."""
        self._arrived: list[int] = []
        if isinstance(self.interval, Times):
            self.interval.check_to_come("interval", self.now)
        self._plan_next(0)

    def arrive(self, number: int) -> None:
        """Let an agent arrive, unless the group is full or there is no room, and plan the next arrival."""
        group = self._its_group()
        agents: list[Body] = []
        if self.most is None or len(group) < self.most:
            with _naming_arrivals(), contextlib.suppress(NoRoomError):
                agents = group.add(1, **self._given())
        for agent in agents:
            member = self.member(agent)
            self._arrived.append(member)
            self._plan(self.now + length(self, self.stay, 0, number, 2 * number + 1), "leave", member)
        if not agents:
            self.log("turned away", present=len(group))
        self._plan_next(number + 1)

    def left(self, agent: Body, member: int) -> None:
        """Forget an agent that has left."""
        if member in self._arrived:
            self._arrived.remove(member)

    def _check(self) -> None:
        """Compute an arrival that does not take place."""
        arguments, own = self._given(), inspect.signature(Group.add).parameters.values()
        given = {one.name: arguments.pop(one.name, one.default) for one in own if one.kind is one.KEYWORD_ONLY}
        # Whoever is in the way now may have gone by then.
        with _naming_arrivals(), contextlib.suppress(NoRoomError):
            newcomers(self.world._data, self._its_group(), 1, given, arguments)

    def _given(self) -> dict[str, Any]:
        """Return the arguments of `Group.add`."""
        given = dict(self.abilities)
        if self.position is not None:
            given["position"] = self.position
        group = self._its_group()
        speed, first = group.bodies.speed, group.members.speed
        is_changed = len(set(speed.tolist())) > 1 or any(group in one.groups for one in self.world._data.interactions)
        if "speed" not in given and is_changed and len(set(first.tolist())) == 1:
            # Some are stopped or slowed now, as at a charging place or by a load; all have begun with the same speed.
            given["speed"] = float(first[0])
        return given

    def _plan_next(self, number: int) -> None:
        self._plan(next_time(self, self.interval, 0, number, 2 * number), "arrive", number)


@contextlib.contextmanager
def _naming_arrivals() -> Iterator[None]:
    """Let errors of `Group.add` say where its arguments are given."""
    try:
        yield
    except (TypeError, ValueError) as error:
        text = str(error).replace("add(…", "Arrivals(…").replace("to add,", "to Arrivals,")
        text = text.replace("add itself takes", "Arrivals itself takes")
        if text == str(error) or type(error) not in (TypeError, ValueError):
            raise
        raise type(error)(text) from error


@dataclass(eq=False, repr=False)
class Departures(_Leaving):
    """The agents of a group leave it, each independently of the others; the log says "left".

    Parameters
    ----------
    time_to_departure : float, Duration or Times
        The time from the start of the run, or from its arrival, to the departure of each agent [ticks]; of `Times`, the
        first counts.

    Raises
    ------
    TypeError, ValueError
        If it is neither a number nor a duration, or is not positive; when attached, if a listed time has passed.

    Notes
    -----
    Those who have left do not come back, also not at a reset.
    """

    time_to_departure: TimeTo

    def check(self) -> None:
        """Refuse times that are listed for unknown members."""
        check_members(self, "time_to_departure")

    def begin(self) -> None:
        """Plan the departure of each agent."""
        if isinstance(self.time_to_departure, Times):
            self.time_to_departure.check_to_come("time_to_departure", self.now)
        for member in self.members:
            self.joined(None, member)

    def joined(self, agent: Body | None, member: int) -> None:
        """Plan the departure of an agent that has come."""
        self._plan(next_time(self, self.time_to_departure, member, 0, 0), "leave", member)
