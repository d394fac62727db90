"""Charging places, at which agents with low batteries queue."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.agents.body import Body
from teamsight.agents.components.batteries import Batteries, NeedsCharge
from teamsight.agents.components.durations import Duration, Times, lasting
from teamsight.agents.components.listed_members import check_members
from teamsight.agents.components.vicinity import Vicinity
from teamsight.agents.events.source import EventSource
from teamsight.agents.sensing.sensor import Sensor
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.given import Points, PolicyLike
    from teamsight.agents.group import Group

#: The channel in which agents sense charging places, and the name of their group.
CHARGERS = "chargers"


class ChargingPlaces(EventSource, NeedsCharge):
    """Agents with a low battery that come to a charging place queue there, are charged, and go on.

    It is attached to a group that has `Batteries`. It adds a group "chargers" of bodies that do not move, which the
    agents sense in the channel "chargers", so that their policy can go there. An agent that is at a place and low stops
    (its speed is 0), requests one of its chargers, and goes on when its battery is full. While it is charged, its
    battery does not drain. The log says "queued", "charging" and "charged".

    Parameters
    ----------
    position : array_like, shape (2,) or (k, 2)
        The places [length].
    chargers : int, default 1
        The number of agents that a place can charge at the same time; the others queue, first come, first served.
    rate : float, optional
        Charge per tick [charge / tick].
    duration : float, Duration or Times, optional
        In place of `rate`: how long charging takes [ticks], whatever the charge; a number is the mean of an exponential
        duration.
    radius : float, default 0.1
        The distance within which an agent is at a place [length].
    policy : Policy, callable or str, optional
        The policy of an agent from when its battery is low until it is charged, such as
        `teamsight.policies.SeekCharger`; by default its policy does not change.
    reach : float, optional
        The distance within which agents sense the places [length]; by default all that the arena allows.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or not one of `rate` and `duration` is given; when
        attached, if a place is outside the arena, the group has no batteries, or other places have a `policy` already.

    Notes
    -----
    If several are attached to one group, an agent queues at one place at a time, and is as before once any has charged
    it. One `policy` serves them all.
    """

    def __init__(
        self,
        position: Points,
        chargers: int = 1,
        *,
        rate: float | None = None,
        duration: float | Duration | Times | None = None,
        radius: float = 0.1,
        policy: PolicyLike | None = None,
        reach: float | None = None,
    ) -> None:
        places = np.asarray(position, float)
        if places.shape[-1:] != (2,) or places.ndim > 2 or not np.isfinite(places).all():
            raise ValueError(f"position={checks.shown(position)}: must be (x, y), or a list of these, [length]")
        self.position = tuple(map(tuple, np.atleast_2d(places).tolist()))
        self.chargers = checks.count("chargers", chargers)
        if (rate is None) == (duration is None):
            raise ValueError(f"rate={rate}, duration={duration}: give one of the two, such as rate=0.5")
        self.rate = None if rate is None else checks.number("rate", rate, above=0)
        self.duration = None if duration is None else lasting("duration", duration)
        self.radius = checks.number("radius", radius, above=0)
        self.policy = policy
        self.reach = None if reach is None else checks.number("reach", reach, above=0)

    def check(self) -> None:
        """Refuse durations that are listed for unknown members."""
        check_members(self, "duration")

    def connect(self) -> None:
        """Add the places, and watch."""
        group = self._its_group()
        if "_vicinity" not in vars(self):
            found = [one for one in self.world.sources if isinstance(one, Batteries) and one.group is group]
            if not found:
                raise ValueError(
                    f"ChargingPlaces: the agents of {group.name!r} have no batteries; attach them first, as in "
                    "world.attach(Batteries(20), robots)"
                )
            self._check_policy()
            reach = _longest_reach(self.world) if self.reach is None else self.reach
            sensor = Sensor(range=max(reach, self.radius), occluded=False)
            others = sum(one.name.startswith(CHARGERS) for one in self.world.groups)
            name = f"{CHARGERS} {others + 1}" if others else CHARGERS
            self.places: Group[Body] = self.world.add(
                Body, len(self.position), policy="stationary", team=None, position=self.position, name=name
            )
            self.world.senses(group, self.places, as_=CHARGERS, sensor=sensor, counts=False)
            self._batteries = found[0]
            if self.policy is not None and len(group) and self.world.tick == 0:
                # The group knows it before the run, so that a state fits every world that is built alike. In the middle
                # of a run this would cost a robot its memory.
                before, group[0].policy = group[0].policy, self.policy
                group[0].policy = before
            self._vicinity = Vicinity(group, self.places, CHARGERS, self.radius, found[0].drain, self._report)
        self.world._engine.watch(self._vicinity)

    def disconnect(self) -> None:
        """Watch no longer; the places stay, since groups cannot leave a world."""
        if "_vicinity" in vars(self):
            self.world._engine.unwatch(self._vicinity)

    def begin(self) -> None:
        """Begin with free places."""
        self._vicinity.place[:] = 0
        # By member: its speed and its own policy, by its index in the group, before; and the number of its visits.
        self._speeds: dict[int, float] = {}
        self._policies: dict[int, int] = {}
        self._visits: dict[int, int] = {}
        self._requests: dict[int, Any] = {}
        self._begun: set[int] = set()
        self._resources = [self.clock.resource(self.chargers) for _ in self.position]
        for member in self.members:
            if self._batteries.level(member):
                self.is_low(member)

    def end(self) -> None:
        """Let all agents go."""
        for member in [*self._requests, *self._policies]:
            self._let_go(member)

    def queue(self, place: int = 0) -> list[Body]:
        """Return the agents that wait at a place, the next to be charged first."""
        return self._agents_of(self._resources[place].queue)

    def charging(self, place: int = 0) -> list[Body]:
        """Return the agents that are charged at a place, in the order in which they began."""
        return self._agents_of(self._resources[place].users)

    def is_low(self, member: int) -> None:
        """Give an agent whose battery is low the policy for that."""
        if self.policy is not None and member not in self._policies:
            agent = self.agent(member)
            before = agent.policy
            known = self._its_group().policies
            self._policies[member] = next(index for index, policy in enumerate(known) if policy is before)
            agent.policy = self.policy

    def come(self, member: int, place: int) -> None:
        """Let an agent queue at a place."""
        agent = self.agent(member)
        # Where it queues already, it comes from there again if it leaves that queue low.
        if agent is None or any(member in one._requests for one in self._all_places()):
            return
        self._speeds[member], agent.speed = agent.speed, 0.0
        self._vicinity.place[member] = place + 1
        self.log("queued", agent, place=place)
        self._request(member, place)

    def charge(self, member: int) -> None:
        """Begin to charge an agent, whose turn it is."""
        agent = self.agent(member)
        if agent is None or member not in self._requests or member in self._begun:
            return
        self._begun.add(member)
        missing = self._batteries.capacity - float(self._batteries.charge[agent.row])
        visit = self._visits[member] = self._visits.get(member, -1) + 1
        if self.rate is not None:
            needed = missing / self.rate
        elif isinstance(self.duration, Times):
            needed = self.duration.lasting(visit, member)
        else:
            needed = self.duration.draw(self.random(member, visit))  # type: ignore[union-attr]
        self.log("charging", agent, place=int(self._vicinity.place[member]) - 1)
        self._batteries.supply(member, missing / needed if missing else math.ulp(0.0))
        if needed < math.inf:
            self.plan(self.now + needed, "finish", member, visit)

    def finish(self, member: int, visit: int) -> None:
        """Let an agent go whose battery is full."""
        agent = self.agent(member)
        if agent is None or member not in self._requests or self._visits[member] != visit:
            return
        self._batteries.set_charge(member, self._batteries.capacity)
        self.log("charged", agent, place=int(self._vicinity.place[member]) - 1)
        self._let_go(member)

    def left(self, agent: Body, member: int) -> None:
        """Free the place of an agent that has left."""
        self._let_go(member)

    def save(self) -> Any:
        """Return who is where, in the order of the queues."""
        order = [
            [self._members_of(resource.users), self._members_of(resource.queue)] for resource in self._resources
        ]
        own = self._speeds.copy(), self._policies.copy(), self._visits.copy(), self._begun.copy()
        return order, self._vicinity.place.copy(), own

    def load(self, data: Any) -> None:
        """Go back to what `save` returned: the queues are made again, in the same order."""
        order, place, own = data
        self._speeds, self._policies, self._visits, self._begun = (part.copy() for part in own)
        self._vicinity.place = place.copy()
        self._requests = {}
        self._resources = [self.clock.resource(self.chargers) for _ in self.position]
        for number, (users, queue) in enumerate(order):
            for member in [*users, *queue]:
                self._request(member, number)

    def _request(self, member: int, place: int) -> None:
        request = self._requests[member] = self._resources[place].request()
        if member not in self._begun:
            self.when(request, "charge", member)

    def _let_go(self, member: int) -> None:
        request, agent = self._requests.pop(member, None), self.agent(member)
        if agent is not None and member in self._speeds and agent.speed == 0.0:
            agent.speed = self._speeds[member]
        for one in self._all_places():
            one._give_policy_back(member)
            if one is not self and member not in one._requests:
                one._vicinity.release(member)
        if request is None:
            return
        self._speeds.pop(member, None)
        self._batteries.supply(member, 0.0)
        self._begun.discard(member)
        resource = self._resources[int(self._vicinity.place[member]) - 1]
        self._vicinity.place[member] = 0
        if request.triggered:
            resource.release(request)
        else:
            request.cancel()

    def _give_policy_back(self, member: int) -> None:
        agent, index = self.agent(member), self._policies.pop(member, None)
        if agent is not None and index is not None:
            known = self._its_group().policies
            # A group that was given another policy has forgotten those of single robots.
            agent.policy = known[index] if index < len(known) else known[0]

    def _all_places(self) -> list[ChargingPlaces]:
        """Return the sources of charging places of the group, this one among them."""
        sources = [one for one in self.world.sources if isinstance(one, ChargingPlaces)]
        return [one for one in sources if one.group is self.group]

    def _check_policy(self) -> None:
        """Refuse a second policy for agents that are low."""
        others = [one for one in self._all_places() if one is not self and one.policy is not None]
        if self.policy is not None and others:
            raise ValueError(
                f"ChargingPlaces(policy={checks.shown(self.policy)}): other places of {self._its_group().name!r} give "
                f"agents that are low {checks.shown(others[0].policy)} already; leave policy out, since one serves all "
                "places, or give all places to one ChargingPlaces"
            )

    def _members_of(self, requests: list[Any]) -> list[int]:
        member_of = {id(request): member for member, request in self._requests.items()}
        return [member_of[id(request)] for request in requests]

    def _agents_of(self, requests: list[Any]) -> list[Body]:
        return [self.agent(member) for member in self._members_of(requests)]

    def _report(self) -> None:
        """Plan the arrival of each agent that has come."""
        for member in np.flatnonzero(self._vicinity.place).tolist():
            if member not in self._requests:
                self.plan(self.now, "come", member, int(self._vicinity.place[member]) - 1)


def _longest_reach(world: Any) -> float:
    """Return the longest range in an arena: all of it, or on a torus half of its shorter side."""
    arena = world._data.arena
    (left, bottom), (right, top) = arena.bounds
    sides = [side / 2 for side in arena.period if side > 0]
    return float(min([math.hypot(right - left, top - bottom), *sides]))
