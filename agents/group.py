"""A group: agents of one class that share a policy and a degree of awareness, stored as arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Generic, overload
from weakref import WeakValueDictionary

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.awareness.binding import Perception
from teamsight.agents.channel import TEAMMATES, Channel
from teamsight.agents.columns import Column, Columns, new_column
from teamsight.agents.condition_of_one import note_of_inactive
from teamsight.agents.decisions.cycle import CycleLike
from teamsight.agents.engine.detection import Readings
from teamsight.agents.fixed import put, refusing
from teamsight.agents.given import Numbers, PlacementName, Points, Rows
from teamsight.agents.host_protocol import Host
from teamsight.agents.perceiving import Perceiving
from teamsight.agents.policy_state import first_state as first_state
from teamsight.agents.selection import rows_of
from teamsight.agents.settings import readonly as readonly
from teamsight.core.card import shown
from teamsight.policies.interface import Action, Policy
from teamsight.policies.percept_of_one import Rule
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.noise import LANES, TICKS_A_BLOCK
from teamsight.world.placement import Founders

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    # The agents' class; files that do not care leave it out.
    A = TypeVar("A", default=Any, covariant=True)
else:
    from typing import TypeVar

    A = TypeVar("A")

Floats = npt.NDArray[np.float64]


@refusing(
    team="give the team when a group is added, as in world.add(…, team='rivals')",
    range_shape="give the shape when a group is added, as in world.add(…, range_shape='square')",
    sensors="set the sensor of a channel, as in robots.sensors['targets'] = Sensor(delay=2)",
    position="to move an agent, set its own position, as in robots[0].position = (0, 1)",
    heading="to turn an agent, set its own heading, as in robots[0].heading = (0, 1)",
    active="set that of one agent, as in robots[0].active = False",
    identity="identities are given by the world; add_column makes numbers of your own",
    agents="robots.add(1) adds one, and robots[0].remove() takes one out",
)


class Group(Perceiving, Generic[A]):
    """Agents of one class that share a policy and a degree of awareness: ``Group[Scout]`` is a group of scouts.

    Attributes
    ----------
    policies, channels, percept, …
        How its agents decide, and what they perceive; see `Deciding` and `Perceiving`.
    name : str
        The group's name in its world.
    number : int
        Its index among the groups of its world.
    agent_class, first_size : type, int
        The class of its agents, and their number when the group was added.
    bodies : Bodies
        The arrays behind `position`, `heading`, `speed` and `turn_limit`. Values written into them are not checked.
    ranges : tuple of two ndarray, shape (n,), float64
        The arrays behind `sensing_range` and `awareness_range`; not checked either.
    founders : list of Founders
        The rules by which its agents, those that have left included, are placed at the start of a run.
    departed : mapping of int to Body
        Agents that have left, by member, as long as somebody refers to them; restoring a state brings them back.
    first_abilities : Abilities
        The abilities at the start of a run, by member.
    readings : dict of str to Readings
        What sensors with a delay have measured and not yet delivered, by channel.
    columns : mapping of str to Column
        The user's own columns, shape (n, …) each; see `add_column`.
    has_conditions : bool
        Whether an agent has ever been inactive, or a sensor out of order; the compiled loop then reads which are.
    action : Action
        The last decision.
    last_rewards : ndarray, shape (2, n), float64
        What interactions gave each agent in the last step, and 1 if one ended a trial for it, else 0.
    """

    def __init__(
        self,
        name: str,
        number: int,
        team: str | None,
        agent_class: type[A],
        bodies: Bodies,
        ranges: tuple[Floats, Floats],
        policy: Policy | Rule,
        awareness: Awareness,
        host: Host,
        range_shape: str = "disc",
    ) -> None:
        self.name, self.number, self._team, self._range_shape = name, number, team, range_shape
        self.agent_class, self.first_size = agent_class, len(bodies)
        self.bodies = bodies
        self.ranges = ranges
        put(self, rules=(policy, awareness), others=(), timetable=None)
        self.columns = Columns(name)
        self._agents: list[A] = []
        self.due = None
        self.decides_alone = self.is_growing = self.has_conditions = False
        self.founders: list[Founders] = []
        self.departed: WeakValueDictionary[int, A] = WeakValueDictionary()
        self.first_abilities: Abilities
        self.channels: dict[str, Channel] = {}
        if team is not None:
            self.channels[TEAMMATES] = Channel(TEAMMATES, np.ones(len(bodies), bool))
        self.arrived_at = np.zeros(len(bodies), np.int64)
        self.readings: dict[str, Readings] = {}
        self.relations = {}
        self.host = host
        self.time = np.zeros(1)
        self.perceived_columns: dict[str, Floats] = {}
        self.begin(first_state(policy, len(bodies)))

    @property
    def decided(self) -> Action | None:
        """The actions that its kernel decided in a step that failed, which the next one carries out; None for none."""
        return self.action if self.has_decided else None

    def begin(self, state: Any, decided: Action | None = None) -> None:
        """Make new buffers for the present size, and set the state of the policy, and what it has `decided`."""
        size = len(self.bodies)
        self.policy_state = state
        # Robots that do not decide at every step go on with their last action.
        fresh = decided or Action(np.zeros((size, 2)), np.zeros(size))
        self.action = self.timetable.action if self.timetable else fresh
        lanes = -(-max(size, 1) // LANES) * LANES
        self.numbers = np.zeros((TICKS_A_BLOCK, self.draws, lanes))
        self.members = np.zeros(lanes, np.int64)
        self.members[:size] = self.bodies.member
        self.perception = Perception(size)
        self.last_rewards = np.zeros((2, size))
        # After a failed step: whether the kernel had decided; the next step then carries out `action`, so that nothing
        # is learned twice.
        self.has_decided = decided is not None

    def restart(self, position: Floats, heading: Floats) -> None:
        """Put all agents back to the start of a run, in the arrays that the kernels read.

        Parameters
        ----------
        position, heading : ndarray, shape (members, 2), float64
            The start of each member; those of removed agents are ignored.
        """
        bodies, first = self.bodies, self.first_abilities
        rows = slice(None) if len(self) == self.members_so_far else bodies.member
        bodies.position[:], bodies.heading[:], bodies.moved[:] = position[rows], heading[rows], 0.0
        bodies.speed[:] = first.speed[rows]
        bodies.turn_cosine[:], bodies.turn_sine[:] = first.turn_cosine[rows], first.turn_sine[rows]
        self.ranges[0][:], self.ranges[1][:] = first.sensing_range[rows], first.awareness_range[rows]
        self.action.heading[:], self.action.distance[:] = 0.0, 0.0
        bodies.active[:] = True
        bodies.reward[:], bodies.ended[:], self.last_rewards[:] = 0.0, False, 0.0
        for channel in self.channels.values():
            channel.works[:] = True
        for readings in self.readings.values():
            readings.forget()
        self.has_decided = False
        self.arrived_at[:] = 0

    def __len__(self) -> int:
        return len(self.bodies)

    def __iter__(self) -> Iterator[A]:
        # A copy, so that agents can leave, or come, in a loop over them.
        return iter(self.agents)

    @overload
    def __getitem__(self, row: int | np.integer[Any]) -> A: ...  # type: ignore[overload-overlap]
    @overload
    def __getitem__(self, row: slice | Rows) -> list[A]: ...
    def __getitem__(self, row: int | np.integer[Any] | slice | Rows) -> A | list[A]:
        try:
            return self._agents[row]  # type: ignore[index]
        except TypeError:
            return [self._agents[one] for one in rows_of(row, len(self), self.name)]

    def __repr__(self) -> str:
        inactive = note_of_inactive(self.bodies.active)
        names = " and ".join(type(policy).__name__ for policy in self.policies)
        return f"<Group {self.name!r}: {len(self)} agents{inactive}, {names}, {self.awareness}>"

    def _repr_html_(self) -> str | None:
        from teamsight.agents.group_card import group_html

        return shown(group_html, self)

    @property
    def team(self) -> str | None:
        """Groups of the same team are teammates. It cannot be changed."""
        return self._team

    @property
    def range_shape(self) -> str:
        """The shape of all its ranges: "disc", or "square" with sides along the axes. It cannot be changed."""
        return self._range_shape

    @property
    def agents(self) -> tuple[A, ...]:
        """Its agents, one for each row of the arrays."""
        return tuple(self._agents)

    @property
    def members_so_far(self) -> int:
        """The number of agents ever in the group; the next member has this number."""
        return sum(one.size for one in self.founders)

    def add(
        self,
        count: int = 1,
        *,
        placement: PlacementName | Points = "uniform",
        position: Points | None = None,
        heading: Points | None = None,
        sensing_range: Numbers | None = None,
        awareness_range: Numbers | None = None,
        speed: Numbers | None = None,
        turn_limit: Numbers | None = None,
        cycle: CycleLike | None = None,
        **arguments: Any,
    ) -> list[A]:
        """Add agents, before a run or in the middle: between steps, in events and in processes.

        They go on as if they had been in the group from the start, in the same arrays; a reset places all again.

        Parameters
        ----------
        count : int
            The number of new agents, at least 1.
        placement, position, heading
            As for `World.add`.
        sensing_range, awareness_range, speed, turn_limit : float or array_like, shape (count,), optional
            By default the group's, if all its agents have the same.
        cycle : Cycle or float, optional
            Their cycle, which begins now; by default the group's, if all its agents have the same.
        **arguments
            Arguments of the ``__init__`` of the agents' class, and values of columns; a list of `count` values gives
            one to each. By default a column has the value with which it was filled.

        Returns
        -------
        list of Body
            The new agents.

        Raises
        ------
        TypeError, ValueError
            If a value is of the wrong type, shape or size, or must be given. Nothing is changed then.
        RuntimeError
            If called while a group decides, or by the ``__init__`` of an agent of this group.
        """
        given = {
            "placement": placement, "position": position, "heading": heading, "speed": speed, "turn_limit": turn_limit,
            "sensing_range": sensing_range, "awareness_range": awareness_range, "cycle": cycle,
        }  # fmt: skip
        return self.host.extend(self, count, given, arguments)

    def add_column(self, name: str, fill: Any = 0.0) -> Column:
        """Add a property of your own, which is saved and restored with the world.

        It is also an attribute of each agent: after ``robots.add_column("battery", 1.0)``, ``robot.battery -= 0.1``.

        Parameters
        ----------
        name : str
            A name that is not yet an attribute of the agents.
        fill : object or array_like, shape (n, …)
            One value, also for agents that come later, or one for each agent. It determines the column's type: 0 for
            integers, 0.0 for floats.

        Returns
        -------
        Column
            Used like an array of shape (n, …). It stays valid when agents come or leave and states are restored.

        Raises
        ------
        TypeError, ValueError
            If the name is not a string, or the name of a column or another attribute; or if `fill` has another length.
        """
        return new_column(self, name, fill)


def team_of(groups: Sequence[Group], group: Group) -> list[Group]:
    """Return the groups of a group's team, itself included; none without a team."""
    return [other for other in groups if other.team == group.team] if group.team is not None else []
