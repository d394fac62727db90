"""Batteries: what a step costs, what happens when one is empty, and places to charge."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import Column
from teamsight.agents.body import Body
from teamsight.agents.components.durations import Lasting, length
from teamsight.agents.components.failures import Holding, check_members
from teamsight.agents.engine.records import Bound
from teamsight.agents.events.sources import Watching
from teamsight.agents.group import Group
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.world_data import AgentLeftError
from teamsight.core import checks
from teamsight.core.component import Allowed, Count
from teamsight.core.kernel import Entry, Record
from teamsight.core.neighbour_list import Filled

if TYPE_CHECKING:
    from teamsight.agents.attributes import Points, PolicyLike

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: The level of a battery.
ENOUGH, LOW, EMPTY = range(3)
#: The share of the capacity below which a charge is 0.
ROUNDING = 1e-9


class DrainArrays(NamedTuple):
    """The record of the batteries of a group.

    Attributes
    ----------
    member : ndarray, shape (n,), int64
        The member of each row.
    active : ndarray, shape (n,), bool
        Who takes part; others drain nothing.
    moved : ndarray, shape (n, 2), float64
        The displacement of the last step [length].
    decided_at : ndarray, shape (n,) or (0,), int64
        The tick at which each last decided; empty if all active agents decide at every step.
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    charge : ndarray, shape (n,), float64
        Written: the charge.
    supply : ndarray, shape (members,), float64
        By member, the charge that a battery gains in a step while it is charged; 0 while it is not.
    level : ndarray, shape (members,), int64
        Written: by member, `ENOUGH`, `LOW` or `EMPTY`.
    capacity, low, per_distance, per_tick, per_decision : float
        As for `Batteries`.
    """

    member: Annotated[Integers, "n"]
    active: Annotated[npt.NDArray[np.bool_], "n"]
    moved: Annotated[Floats, "n", 2]
    decided_at: Annotated[Integers, "deciding"]
    moment: Annotated[Integers, 1]
    charge: Annotated[Floats, "n"]
    supply: Annotated[Floats, "members"]
    level: Annotated[Integers, "members"]
    capacity: float
    low: float
    per_distance: float
    per_tick: float
    per_decision: float


DRAIN = Record(DrainArrays)
_drain_at = DRAIN.at


def _drain(address: int) -> int:
    here = _drain_at(address)
    has_changed = 0
    rounding = ROUNDING * here.capacity
    for i in range(here.member.shape[0]):
        m = here.member[i]
        charge = here.charge[i]
        if here.supply[m] > 0.0:
            charge = min(charge + here.supply[m], here.capacity)
        elif here.active[i]:
            x = here.moved[i, 0]
            y = here.moved[i, 1]
            has_decided = here.decided_at.shape[0] == 0 or here.decided_at[i] == here.moment[0] - 1
            decision = here.per_decision if has_decided else 0.0
            charge -= here.per_tick + decision + here.per_distance * math.sqrt(x * x + y * y)
        # Ten drains of 0.1 must empty a battery of 1.
        charge = charge if charge > rounding else 0.0
        here.charge[i] = charge
        level = EMPTY if charge == 0.0 else LOW if charge <= here.low + rounding else ENOUGH
        if level != here.level[m]:
            here.level[m] = level
            has_changed = 1
    return has_changed


_DRAIN = Entry(_drain)
#: The column with the charge of each agent.
BATTERY = "battery"

_Drain = Annotated[float, Allowed(least=0, cure="0 is no drain")]


@dataclass(eq=False, repr=False)
class Batteries(Holding, Watching):
    """Each agent has a battery; one whose battery is empty is inactive until it is charged.

    The charge is the column "battery" of the group: ``robot.battery``, ``robots.battery``. It can be set, from 0 to
    the capacity; what follows from it, follows after the next step. All batteries are full when the source is attached
    and at each reset, and those of agents that come later are, unless ``group.add(battery=…)`` says otherwise. The log
    says "low" and "empty".

    Parameters
    ----------
    capacity : float
        The charge of a full battery [charge], above 0.
    per_distance : float
        Drain for each unit of length moved [charge / length], at least 0.
    per_tick, per_decision : float
        Drain in each step and for each decision of an active agent [charge], at least 0.
    low_level : float, optional
        The charge from which on downwards a battery is low [charge], less than the capacity; by default a fifth of it.

    Raises
    ------
    TypeError, ValueError
        If a value is not a number or outside its limits; when attached, if the agents have an attribute "battery".

    Notes
    -----
    The charge after a step is that before it, less the drain of that step; below a billionth of the capacity it is 0.
    So a battery becomes empty at a whole tick, and its agent is inactive from that tick on. Compiled code computes it,
    and stops a run only where a battery becomes low or empty. `ChargingPlaces` charge batteries.
    """

    capacity: Annotated[float, Allowed(above=0, cure="leave Batteries out for no limit", unit="charge")]
    per_distance: Annotated[_Drain, Allowed(unit="charge / length")] = 1.0
    per_tick: Annotated[_Drain, Allowed(unit="charge")] = 0.0
    per_decision: Annotated[_Drain, Allowed(unit="charge")] = 0.0
    low_level: Annotated[float, Allowed(least=0, unit="charge")] | None = None

    entry = _DRAIN
    changing = ("_held", "_level", "_supply", "_reported")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.per_distance + self.per_tick + self.per_decision:
            raise ValueError(
                f"per_distance={self.per_distance:g}, per_tick={self.per_tick:g}, per_decision={self.per_decision:g}: "
                "nothing drains the batteries; give one of them above 0"
            )
        if self.low_level is None:
            self.low_level = 0.2 * self.capacity
        if self.low_level >= self.capacity:
            raise ValueError(f"low_level={self.low_level:g}: must be less than the capacity, {self.capacity:g}")

    def connect(self) -> None:
        """Add the column, and watch."""
        columns = self._its_group().columns
        if "_supply" in vars(self) and BATTERY in columns:
            # A state has brought it back, but not the charge of agents that come later.
            columns.create(BATTERY, columns.array(BATTERY), self.capacity)
        else:
            self._its_group().add_column(BATTERY, self.capacity)
        if "_supply" not in vars(self):
            # By member; see `DrainArrays`.
            self._supply, self._level = np.zeros(0), np.zeros(0, np.int64)
        columns.limit(BATTERY, self._check_charge)
        super().connect()

    def disconnect(self) -> None:
        """Remove the column, and watch no longer."""
        # If the column could not be added, there is one of the user's.
        if "_supply" in vars(self):
            super().disconnect()
            self._its_group().columns.pop(BATTERY, None)

    def begin(self) -> None:
        """Fill all batteries."""
        super().begin()
        self._its_group().columns.assign(BATTERY, ..., self.capacity)
        self._supply[:], self._level[:] = 0.0, ENOUGH
        self.make_room()
        # The levels of which events have been planned, by member.
        self._reported = self._level.copy()
        # The SimPy events for which users wait, by member and level.
        self._awaited: dict[tuple[int, int], Any] = {}

    def make_room(self) -> None:
        """Make room for the members that have come."""
        more = self._its_group().members_so_far - len(self._level)
        if more > 0:
            self._supply = np.append(self._supply, np.zeros(more))
            self._level = np.append(self._level, np.full(more, ENOUGH))

    def bind(self, bound: Bound) -> None:
        """Pack the record from the present arrays."""
        self.make_room()
        group = self._its_group()
        bodies, charge, table = group.bodies, group.columns.array(BATTERY), group.timetable
        self.record = DRAIN.pack(DrainArrays(
            bodies.member, bodies.active, bodies.moved, np.zeros(0, np.int64) if table is None else table.decided_at,
            bound.moment, charge, self._supply, self._level, self.capacity, self.low_level or 0.0, self.per_distance,
            self.per_tick, self.per_decision,
        ))  # fmt: skip

    def happened(self) -> None:
        """Plan an event for each battery whose level has changed."""
        level = self._level
        before = np.zeros(len(level), np.int64)
        before[: len(self._reported)] = self._reported
        self._reported = level.copy()
        for member in np.flatnonzero(level != before).tolist():
            self.plan(self.now, "reach", member, int(before[member]), int(level[member]))

    @property
    def charge(self) -> Column:
        """The charge of each agent, shape (n,) [charge]: the column "battery" of the group."""
        return self._its_group().columns[BATTERY]

    def low(self, agent: Body) -> Any:
        """Return a SimPy event that happens when the battery of an agent is low; at once if it is already.

        If the agent leaves the world before, waiting raises `AgentLeftError`; so for `empty`.
        """
        return self._event(agent, LOW)

    def empty(self, agent: Body) -> Any:
        """Return a SimPy event that happens when the battery of an agent is empty; at once if it is already."""
        return self._event(agent, EMPTY)

    def supply(self, member: int, per_step: float) -> None:
        """Charge the battery of a member by this much in each step, in place of its drain; 0 ends that."""
        self.make_room()
        self._supply[member] = per_step

    def reach(self, member: int, before: int, level: int) -> None:
        """Act on a level that the battery of an agent has fallen to, or risen to."""
        agent = self.agent(member)
        if agent is None:
            return
        if level == EMPTY:
            self.hold(member)
            self.log("empty", agent)
        else:
            self.release(member)
            if before < level:
                self.log("low", agent)
        for reached in range(LOW, level + 1):
            event = self._awaited.pop((member, reached), None)
            if event is not None:
                event.succeed(agent)
        if level >= LOW:
            for places in self.beside(ChargingPlaces):
                places.is_low(member)

    def left(self, agent: Body, member: int) -> None:
        """Forget an agent that has left; processes that wait for its battery get an `AgentLeftError`."""
        super().left(agent, member)
        for level, name in ((LOW, "low"), (EMPTY, "empty")):
            event = self._awaited.pop((member, level), None)
            if event is not None and not event.triggered:
                # An event that nobody waits for must not stop the run; processes get the error nevertheless.
                event.defused = True
                event.fail(AgentLeftError(f"{name}({agent!r}): it has left the world, and its battery with it"))

    def load(self, data: Any) -> None:
        """Go back to what `save` returned."""
        super().load(data)
        self._awaited = {}

    def _check_charge(self, charge: npt.NDArray[Any]) -> None:
        """Refuse charges that a battery cannot have. What is no number at all, columns refuse."""
        given = np.ravel(charge) if charge.dtype.kind in "iuf" else np.zeros(0)
        wrong = given[~((given >= 0) & (given <= self.capacity))]
        if len(wrong):
            raise ValueError(
                f"battery={wrong[0]:g}: must be at least 0 and at most the capacity, {self.capacity:g}; give "
                f"min(max(charge, 0), {self.capacity:g}), or attach Batteries with a larger capacity"
            )

    def _event(self, agent: Body, level: int) -> Any:
        group = self._its_group()
        if getattr(agent, "group", None) is not group:
            raise ValueError(f"{checks.shown(agent)}: has none of these batteries; give an agent of {group.name!r}")
        member = self.member(agent)
        event = self._awaited.get((member, level)) or self.clock.event()
        charge = self.charge[agent.row]
        if not event.triggered and charge <= (0.0 if level == EMPTY else self.low_level):
            return event.succeed(agent)
        self._awaited[member, level] = event
        return event


class VicinityArrays(NamedTuple):
    """The record of the agents that may need a charging place.

    Attributes
    ----------
    member : ndarray, shape (n,), int64
        The member of each row.
    level : ndarray, shape (members,), int64
        By member, the level of its battery.
    place : ndarray, shape (members,), int64
        Written: by member, the charging place at which it is, counted from 1; 0 for none.
    near : NeighbourList
        The charging places in range of each agent, by their indices.
    first, number : int
        The index of the first of these charging places, and how many there are.
    radius : float
        The distance within which an agent is at a place [length].
    """

    member: Annotated[Integers, "n"]
    level: Annotated[Integers, "members"]
    place: Annotated[Integers, "members"]
    near: Filled
    first: int
    number: int
    radius: float


VICINITY = Record(VicinityArrays)
_vicinity_at = VICINITY.at


def _find(address: int) -> int:
    here = _vicinity_at(address)
    has_come = 0
    for i in range(here.member.shape[0]):
        m = here.member[i]
        if here.level[m] != ENOUGH and here.place[m] == 0:
            least = here.radius
            for k in range(here.near.start[i], here.near.start[i + 1]):
                index = here.near.identity[k] - here.first
                if 0 <= index < here.number and here.near.distance[k] <= least:
                    least = here.near.distance[k]
                    here.place[m] = index + 1
                    has_come = 1
    return has_come


_FIND = Entry(_find)
#: The channel in which agents sense charging places, and the name of their group.
CHARGERS = "chargers"


def _places(name: str, value: Any) -> tuple[tuple[float, ...], ...]:
    places = np.asarray(value, float)
    if places.shape[-1:] != (2,) or places.ndim > 2 or not np.isfinite(places).all():
        raise ValueError(f"{name}={checks.shown(value)}: must be (x, y), or a list of these, [length]")
    return tuple(map(tuple, np.atleast_2d(places).tolist()))


@dataclass(eq=False, repr=False)
class ChargingPlaces(Watching):
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

    position: Annotated[Points, Allowed(check=_places, unit="length")]
    chargers: Count = 1
    _: KW_ONLY
    rate: Annotated[float, Allowed(above=0, cure="it is charge per tick", unit="charge / tick")] | None = None
    duration: Lasting | None = None
    radius: Annotated[float, Allowed(above=0, cure="it is a length, such as 0.1", unit="length")] = 0.1
    policy: PolicyLike | None = None
    reach: Annotated[float, Allowed(above=0, cure="leave it out for no limit", unit="length")] | None = None

    entry = _FIND
    changing = ("_speeds", "_policies", "_visits", "_begun", "_place")

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.rate is None) == (self.duration is None):
            raise ValueError(f"rate={self.rate}, duration={self.duration}: give one of the two, such as rate=0.5")

    def check(self) -> None:
        """Refuse durations that are listed for unknown members."""
        check_members(self, "duration")

    def connect(self) -> None:
        """Add the places, and watch."""
        group = self._its_group()
        if "_place" not in vars(self):
            found = self.beside(Batteries)
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
                Body, len(np.asarray(self.position)), policy="stationary", team=None, position=self.position, name=name
            )
            self.world.senses(group, self.places, as_=CHARGERS, sensor=sensor, counts=False)
            self._batteries = found[0]
            if self.policy is not None and len(group) and self.world.tick == 0:
                # The group knows it before the run, so that a state fits every world that is built alike. In the middle
                # of a run this would cost a robot its memory.
                before, group[0].policy = group[0].policy, self.policy
                group[0].policy = before
            # By member; see `VicinityArrays`.
            self._place = np.zeros(0, np.int64)
            self.make_room()
        # The places stay when it is detached, since groups cannot leave a world.
        super().connect()

    def make_room(self) -> None:
        """Make room for the members that have come."""
        self._batteries.make_room()
        self._place = np.append(self._place, np.zeros(len(self._batteries._level) - len(self._place), np.int64))

    def bind(self, bound: Bound) -> None:
        """Pack the record from the present arrays."""
        self.make_room()
        group = self._its_group()
        relation = bound.relation(group, CHARGERS)
        assert relation is not None
        first = group.relations[CHARGERS].first[self.places.number]
        self.record = VICINITY.pack(VicinityArrays(
            group.bodies.member, self._batteries._level, self._place, relation.value.neighbours, first,
            len(self.places), self.radius,
        ))  # fmt: skip

    def begin(self) -> None:
        """Begin with free places."""
        self._place[:] = 0
        # By member: its speed and its own policy, by its index in the group, before; and the number of its visits.
        self._speeds: dict[int, float] = {}
        self._policies: dict[int, int] = {}
        self._visits: dict[int, int] = {}
        self._requests: dict[int, Any] = {}
        self._begun: set[int] = set()
        self._resources = [self.clock.resource(self.chargers) for _ in np.asarray(self.position)]
        for member in self.members:
            if self._batteries._level[member] != ENOUGH:
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
        if agent is None or any(member in one._requests for one in self.beside(ChargingPlaces)):
            return
        self._speeds[member], agent.speed = agent.speed, 0.0
        self._place[member] = place + 1
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
        needed = length(self, self.duration, member, visit, visit) if self.rate is None else missing / self.rate
        self.log("charging", agent, place=int(self._place[member]) - 1)
        self._batteries.supply(member, missing / needed if missing else math.ulp(0.0))
        if needed < math.inf:
            self.plan(self.now + needed, "finish", member, visit)

    def finish(self, member: int, visit: int) -> None:
        """Let an agent go whose battery is full."""
        agent = self.agent(member)
        if agent is None or member not in self._requests or self._visits[member] != visit:
            return
        # It becomes active at once if only its battery has kept it inactive.
        self._batteries.charge[agent.row] = self._batteries.capacity
        self._batteries.release(member)
        self.log("charged", agent, place=int(self._place[member]) - 1)
        self._let_go(member)

    def left(self, agent: Body, member: int) -> None:
        """Free the place of an agent that has left."""
        self._let_go(member)

    def save(self) -> Any:
        """Return who is where, in the order of the queues."""
        order = [
            [self._members_of(resource.users), self._members_of(resource.queue)] for resource in self._resources
        ]
        return order, super().save()

    def load(self, data: Any) -> None:
        """Go back to what `save` returned: the queues are made again, in the same order."""
        order, own = data
        super().load(own)
        self._requests = {}
        self._resources = [self.clock.resource(self.chargers) for _ in np.asarray(self.position)]
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
        for one in self.beside(ChargingPlaces):
            one._give_policy_back(member)
            if one is not self and member not in one._requests:
                # Where it is, is found again.
                one.make_room()
                one._place[member] = 0
        if request is None:
            return
        self._speeds.pop(member, None)
        self._batteries.supply(member, 0.0)
        self._begun.discard(member)
        resource = self._resources[int(self._place[member]) - 1]
        self._place[member] = 0
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

    def _check_policy(self) -> None:
        """Refuse a second policy for agents that are low."""
        others = [one for one in self.beside(ChargingPlaces) if one is not self and one.policy is not None]
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

    def happened(self) -> None:
        """Plan the arrival of each agent that has come."""
        for member in np.flatnonzero(self._place).tolist():
            if member not in self._requests:
                self.plan(self.now, "come", member, int(self._place[member]) - 1)


def _longest_reach(world: Any) -> float:
    """Return the longest range in an arena: all of it, or on a torus half of its shorter side."""
    arena = world._data.arena
    (left, bottom), (right, top) = arena.bounds
    sides = [side / 2 for side in arena.period if side > 0]
    return float(min([math.hypot(right - left, top - bottom), *sides]))
