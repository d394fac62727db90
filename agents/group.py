"""A group: agents of one class that share a policy and a degree of awareness, stored as arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, TypedDict, overload
from weakref import WeakValueDictionary

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import (
    AwarenessLike,
    Column,
    Columns,
    Kept,
    Numbers,
    PlacementName,
    Points,
    PolicyLike,
    Rows,
    Setting,
    new_column,
    put,
    readonly,
    refusing,
)
from teamsight.agents.awareness.interface import Awareness, Perception
from teamsight.agents.channel import TARGETS, TEAMMATES, Channel, Sensors, note_of_inactive
from teamsight.agents.decisions import EVERY_STEP, Cycle, CycleLike
from teamsight.agents.engine.detection import Readings
from teamsight.agents.resolve import IN_TABLE, columns_of_state, first_state, has_rows
from teamsight.core import checks
from teamsight.core.card import shown
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.core.table import Field, Table
from teamsight.policies.channels import OWN_FIELDS, channels_of, columns_of
from teamsight.policies.compiled import decides_in_kernel
from teamsight.policies.interface import Action, Percept, Policy, PolicyState
from teamsight.policies.percept_of_one import Rule
from teamsight.world.drive import Drive, Free
from teamsight.world.motion import BODIES, limit_of_turn
from teamsight.world.noise import LANES, TICKS_A_BLOCK
from teamsight.world.placement import Founders, Starts

if TYPE_CHECKING:
    from teamsight.agents.decisions import Timetable
    from teamsight.agents.engine.due import DueArrays
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.host import WorldHost
    from teamsight.agents.sensing.lidar import Lidar


def rows_of(index: Any, size: int, group: str) -> list[int]:
    """Return the rows that an index of one dimension selects from a group of `size` agents.

    Raises
    ------
    TypeError, IndexError
        If they are not whole numbers or a mask, or if a row or the length of a mask is wrong.
    """
    rows = np.asarray(index)
    if rows.ndim != 1 or (rows.dtype.kind not in "iub" and rows.size):
        raise TypeError(
            f"{group}[{checks.shown(index)}]: give a row, a slice, a list of rows, or a mask of shape ({size},)"
        ) from None
    if rows.dtype.kind == "b":
        if len(rows) != size:
            raise IndexError(
                f"{group}[…]: the mask has {len(rows)} elements; give {size}, one for each agent"
            ) from None
        rows = np.flatnonzero(rows)
    outside = rows[(rows < -size) | (rows >= size)]
    if outside.size:
        raise IndexError(
            f"{group}[{outside[0]}]: the group has {size} agents, with rows from 0 to {size - 1}"
        ) from None
    return [int(row) for row in rows]


if TYPE_CHECKING:
    from typing_extensions import TypeVar

    # The agents' class; files that do not care leave it out.
    A = TypeVar("A", default=Any, covariant=True)
else:
    from typing import TypeVar

    A = TypeVar("A")

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_set = object.__setattr__


class Changes(TypedDict, total=False):
    """The settings of a group that `World.adjust` changes; see `World.add`."""

    policy: PolicyLike | None
    policy_options: Mapping[str, Any] | None
    awareness: AwarenessLike | None
    sensing_range: Numbers | None
    awareness_range: Numbers | None
    speed: Numbers | None
    turn_limit: Numbers | None
    cycle: CycleLike | None


def _ability(group: Any, name: str) -> Any:
    return readonly(group.bodies[name])


def _setting(doc: str, get: Callable[[Any, str], Any] = _ability) -> Any:
    """Return a setting of a group that ``get(group, name)`` reads and `World.adjust` changes; by default a column."""
    return Setting(
        get, lambda group, name, value: group.host.adjust(group, {name: value}),
        f"{doc} A new value takes effect as by `World.adjust`.",
    )  # fmt: skip


def _lanes(size: int) -> int:
    return -(-max(size, 1) // LANES) * LANES


@refusing(
    team="give the team when a group is added, as in world.add(…, team='rivals')",
    range_shape="give the shape when a group is added, as in world.add(…, range_shape='square')",
    sensors="set the sensor of a channel, as in robots.sensors['targets'] = Sensor(delay=2)",
    drive_state="its drive writes it in each step",
    radius="give the radius when a group is added, as in world.add(…, radius=0.1)",
    bumps="it is counted",
    position="to move an agent, set its own position, as in robots[0].position = (0, 1)",
    heading="to turn an agent, set its own heading, as in robots[0].heading = (0, 1)",
    active="set that of one agent, as in robots[0].active = False",
    identity="identities are given by the world; add_column makes numbers of your own",
    agents="robots.add(1) adds one, and robots[0].remove() takes one out",
)


class Group(Generic[A]):
    """Agents of one class that share a policy and a degree of awareness: ``Group[Scout]`` is a group of scouts.

    Attributes
    ----------
    rules : tuple
        The policy and the degree of awareness; `World.adjust` changes them.
    others : tuple of Policy or callable
        Further policies, which single robots have or have had.
    timetable : Timetable or None
        When robots decide and by which policy, if not all at every step and by the group's.
    first_cycle : Cycle
        The cycle with which the group was added.
    drive : Drive
        How its agents carry out their actions.
    lidar : Lidar or None
        The lidar of each robot, if they have one. It cannot be changed.
    time : ndarray, shape (1,), float64
        The present tick, which percepts show: an array of the world.
    channels : dict of str to Channel
        What the group senses, by name; `World.senses` declares it.
    perceived_columns : dict of str to ndarray, shape (identities,), float64
        The columns that its policies read, by identity; empty for a function of one robot in a world without any.
    whole_lanes : ndarray, shape (room,), int64
        `lanes`, and room for more.
    relations : dict of str to Relation
        Who is near in each channel.
    name : str
        The group's name in its world.
    number : int
        Its index among the groups of its world.
    agent_class, first_size : type, int
        The class of its agents, and their number when the group was added.
    bodies : Table
        All that has a value for each agent: `BODIES`, the user's own columns, whether sensors work, the timetable and
        the state of compiled policies. Values written into its arrays are not checked.
    members : Table
        With what each member begins a run, those that have left included: the columns of `bodies` that a reset takes
        back to it; and `arrived_at`, the tick at which it came.
    founders : list of Founders
        The rules by which the members are placed at the start of a run.
    drawn_ahead : tuple or None
        For which arena and key the places of members from which number on were drawn, and these `Starts`.
    departed : mapping of int to Body
        Agents that have left, by member, as long as somebody refers to them; restoring a state brings them back.
    readings : dict of str to Readings
        What sensors with a delay have measured and not yet delivered, by channel.
    columns : mapping of str to Column
        The user's own columns, shape (n, …) each; see `add_column`.
    has_conditions : bool
        Whether an agent has ever been inactive, or a sensor out of order; the compiled loop then reads which are.
    has_decided : bool
        After a step that failed: whether its kernel had decided; the next step then carries out `action`, so that
        nothing is learned twice.
    """

    bodies: Table
    members: Table
    channels: dict[str, Channel]
    host: WorldHost
    rules: tuple[Any, Any] = Kept("set the policy or the degree, as in robots.policy = 'centroid'")  # type: ignore[assignment]
    decides_alone: bool
    has_conditions: bool
    has_decided: bool
    others: tuple[Any, ...] = Kept("set that of one robot, as in robots[0].policy = 'centroid'")  # type: ignore[assignment]
    timetable: Timetable | None = Kept("set the cycle, as in robots.cycle = Cycle(5)")  # type: ignore[assignment]
    first_cycle: Cycle = EVERY_STEP
    drive: Drive = Kept("give the drive when a group is added, as in world.add(…, drive='car')")  # type: ignore[assignment]
    lidar: Lidar | None = Kept("give the lidar when a group is added, as in world.add(…, lidar=Lidar())")  # type: ignore[assignment]
    time: npt.NDArray[np.float64]
    relations: dict[str, Relation]
    perceived_columns: dict[str, Floats]
    whole_lanes: npt.NDArray[np.int64]

    def __init__(
        self,
        name: str,
        number: int,
        team: str | None,
        agent_class: type[A],
        size: int,
        *,
        policy: Policy | Rule,
        awareness: Awareness,
        host: WorldHost,
        range_shape: str,
        drive: Drive,
        lidar: Lidar | None,
    ) -> None:
        self.name, self.number, self._team, self._range_shape = name, number, team, range_shape
        self.agent_class, self.first_size = agent_class, size
        self.bodies = Table(BODIES, size)
        self.bodies.member[:] = np.arange(size)
        begun = [field for field in BODIES if field.reset == "first"]
        self.members = Table([*begun, Field("arrived_at", np.int64, unit="ticks")], size)
        put(self, rules=(policy, awareness), others=(), timetable=None, drive=drive, lidar=lidar)
        if not isinstance(drive, Free):
            self.bodies.declare(Field("drive", shape=(len(drive.state),), reset="fill"))
        if lidar is not None:
            self.bodies.declare(lidar.field)
        self.columns = Columns(name, self.bodies, host.bind_again)
        self._agents: list[A] = []
        # The state of each policy that is not in the table.
        self._states: list[Any] = []
        self._due: DueArrays | None = None
        self.decides_alone = self.is_growing = self.has_conditions = False
        self.founders: list[Founders] = []
        self.drawn_ahead: tuple[tuple[Any, bytes], int, Starts] | None = None
        self.departed: WeakValueDictionary[int, A] = WeakValueDictionary()
        self.channels: dict[str, Channel] = {}
        if team is not None:
            self.channels[TEAMMATES] = Channel(TEAMMATES, self.bodies)
        self.readings: dict[str, Readings] = {}
        self.relations = {}
        self.host = host
        self.time = np.zeros(1)
        self.perceived_columns: dict[str, Floats] = {}
        self.set_policies((), [first_state(policy, size)])
        self.begin()

    def begin(self, *, has_decided: bool = False) -> None:
        """Make what is not in the table for the present agents.

        If they have decided in a step that failed, the next one carries their actions out.
        """
        self._perception = Perception(len(self), self.bodies.room)
        self.has_decided = has_decided
        # Room for the random numbers of the agents for whom the table has room.
        room, self._draws = _lanes(self.bodies.room), self.draws
        self._numbers, self.whole_lanes = np.zeros(TICKS_A_BLOCK * self._draws * room), np.zeros(room, np.int64)
        self.whole_lanes[: len(self)] = self.bodies.member
        self.bodies.last_rewards[:] = 0.0
        # Robots that do not decide at every step go on with their last action.
        if self.timetable is None and not has_decided:
            self.bodies.aim[:], self.bodies.distance[:] = 0.0, 0.0

    @property
    def numbers(self) -> Floats:
        """The random numbers of its policies of four ticks, shape (4, draws, lanes)."""
        shape = TICKS_A_BLOCK, self._draws, _lanes(len(self))
        return self._numbers[: math.prod(shape)].reshape(shape)

    @property
    def lanes(self) -> npt.NDArray[np.int64]:
        """The members whose random numbers these are, and 0 after the last agent, shape (lanes,)."""
        return self.whole_lanes[: _lanes(len(self))]

    @property
    def perception(self) -> Perception:
        """What the degree of awareness shows of who is near."""
        if self._perception.size != len(self):
            self._perception.fit(len(self))
        return self._perception

    @property
    def due(self) -> DueArrays | None:
        """The arrays with the robots that are due, once they are bound."""
        if self._due is not None and len(self._due.runs) != len(self):
            # Views of all rows for which there is room, or of the columns of the table.
            kept = ("runs", "chosen_heading", "chosen_distance")
            self._due = self._due._replace(**{name: getattr(self._due, name).base[: len(self)] for name in kept})
        return self._due

    @due.setter
    def due(self, due: DueArrays | None) -> None:
        self._due = due

    def restart(self, position: Floats, heading: Floats) -> None:
        """Put all agents back to the start of a run, in the arrays that the kernels read.

        Parameters
        ----------
        position, heading : ndarray, shape (members, 2), float64
            The start of each member; those of removed agents are ignored.
        """
        bodies = self.bodies
        rows = slice(None) if len(self) == len(self.members) else bodies.member
        bodies.position[:], bodies.heading[:] = position[rows], heading[rows]
        bodies.reset(self.members, rows)
        self.members.arrived_at[:] = 0
        for readings in self.readings.values():
            readings.forget()
        self.has_decided = False

    @property
    def action(self) -> Action:
        """The last decision."""
        return Action(self.bodies.aim, self.bodies.distance)

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
        radius: Numbers | None = None,
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
        sensing_range, awareness_range, speed, turn_limit, radius : float or array_like, shape (count,), optional
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
            "sensing_range": sensing_range, "awareness_range": awareness_range, "cycle": cycle, "radius": radius,
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

    # Type checkers would take it for leave to set anything.
    if not TYPE_CHECKING:

        def __setattr__(self, name: str, value: object) -> None:
            own = self.__dict__
            if "is_made" in own and not (name in own or name.startswith("_") or hasattr(type(self), name)):
                known = [one for one in dir(type(self)) if not one.startswith("_")]
                raise AttributeError(
                    f"{name}={checks.shown(value)}: a group has no such attribute; {checks.suggestion(name, known)}"
                    f"for a property of the agents use add_column({name!r}, …)"
                )
            _set(self, name, value)

    @property
    def sensors(self) -> Sensors:
        """The sensors by channel: ``robots.sensors["teammates"] = Sensor(field_of_view=2.0)``."""
        return Sensors(self, self.host.set_sensor)

    @property
    def position(self) -> Floats:
        """The positions, shape (n, 2) [length]. To move an agent, set its own `position`."""
        return readonly(self.bodies.position)

    @property
    def heading(self) -> Floats:
        """The directions, shape (n, 2): unit vectors."""
        return readonly(self.bodies.heading)

    @property
    def identity(self) -> npt.NDArray[np.int64]:
        """The `unique_id` of each agent, shape (n,)."""
        return readonly(self.bodies.identity)

    @property
    def radius(self) -> Floats:
        """The radius of each body, shape (n,) [length]. It cannot be changed."""
        return readonly(self.bodies.radius)

    @property
    def bumps(self) -> Integers:
        """How often the way of each has become blocked by another body, shape (n,); see `World`."""
        return readonly(self.bodies.bumps)

    @property
    def drive_state(self) -> Mapping[str, Floats]:
        """What the drive keeps of each agent, such as wheel speeds, shape (n,) each; see `Drive.state`."""
        numbers = enumerate(self.drive.state)
        return MappingProxyType({name: readonly(self.bodies.drive[:, number]) for number, name in numbers})

    @property
    def active(self) -> npt.NDArray[np.bool_]:
        """Whether each agent takes part, shape (n,). Set the `active` of one agent."""
        return readonly(self.bodies.active)

    policy: Setting[Policy | Rule, PolicyLike] = _setting("The policy of all agents.", lambda group, _: group.rules[0])
    awareness: Setting[Awareness, AwarenessLike] = _setting(
        "What they perceive of teammates.", lambda group, _: group.rules[1]
    )
    sensing_range: Setting[Floats, Numbers] = _setting(
        "Distance within which each senses targets, shape (n,) [length]."
    )
    awareness_range: Setting[Floats, Numbers] = _setting(
        "Distance within which each senses teammates, shape (n,) [length]."
    )
    speed: Setting[Floats, Numbers] = _setting("The largest distance of a step of each, shape (n,) [length].")
    turn_limit: Setting[Floats, Numbers] = _setting(
        "The largest angle that each can turn in a step, shape (n,) [rad].",
        lambda group, _: readonly(limit_of_turn(group.bodies.turn_cosine, group.bodies.turn_sine)),
    )
    cycle: Setting[Cycle, CycleLike] = _setting(
        "When they sense and decide.", lambda group, _: group.timetable.cycle() if group.timetable else EVERY_STEP
    )

    @property
    def members_so_far(self) -> int:
        """The number of agents ever in the group; the next member has this number."""
        return len(self.members)

    @property
    def policies(self) -> list[Any]:
        """All policies of the group's robots; that of the group is the first."""
        return [self.rules[0], *self.others]

    @property
    def states(self) -> list[Any]:
        """The states of `policies`, with rows as in `agents`."""
        return [self._state(index) for index in range(len(self._states))]

    @property
    def policy_state(self) -> Any:
        """The state of the policy of the group."""
        return self._state(0)

    def _state(self, index: int) -> Any:
        kept = self._states[index]
        return PolicyState(*(self.bodies[name] for name in columns_of_state(index))) if kept is IN_TABLE else kept

    def is_in_table(self, index: int) -> bool:
        """Whether the state of a policy, given by its index in `policies`, is in columns of `bodies`."""
        return self._states[index] is IN_TABLE

    def set_state(self, index: int, state: Any) -> None:
        """Replace the state of a policy, given by its index in `policies`; in place if it has the same shape."""
        names, is_moved = columns_of_state(index), True
        self._states += [None] * (index + 1 - len(self._states))
        self._states[index] = IN_TABLE if has_rows(state, len(self)) else state
        if state is not IN_TABLE and self._states[index] is not IN_TABLE:
            self.bodies.drop(*names)
        elif state is not IN_TABLE:
            is_moved = False
            for name, array in zip(names, state, strict=True):
                if name in self.bodies and self.bodies[name].shape == array.shape:
                    self.bodies[name][:] = array
                else:
                    self.bodies.declare(Field(name, array.dtype, array.shape[1:]), array)
                    is_moved = True
        policy = self.policies[index]
        if is_moved and isinstance(policy, Policy) and policy.shows:
            self.host.bind_again()

    def set_policies(self, policies: Sequence[Any], states: Sequence[Any]) -> None:
        """Let robots have these further policies; `states` are those of all, the group's policy first."""
        for index in range(len(states), len(self._states)):
            self.bodies.drop(*columns_of_state(index))
        del self._states[len(states) :]
        put(self, others=tuple(policies))
        for index, state in enumerate(states):
            self.set_state(index, state)

    def reach(self, channel: str) -> Floats:
        """Return the array of the ranges of a channel, if its sensor has none of its own [length]."""
        return self.bodies.awareness_range if channel == TEAMMATES else self.bodies.sensing_range

    @property
    def needs_timetable(self) -> bool:
        """Whether at some step not all robots decide, or not all by the policy of the group."""
        return self.timetable is not None or self.has_conditions

    def policy_of(self, row: int) -> Any:
        """Return the policy of one robot."""
        return self.rules[0] if self.timetable is None else self.policies[self.timetable.policy[row]]

    @property
    def decided_at(self) -> Integers:
        """The tick at which each robot last decided, shape (n,); −1 before its first decision."""
        if self.timetable is not None:
            return self.timetable.decided_at.copy()
        tick = int(self.time[0])
        return np.where(self.members.arrived_at[self.bodies.member] < tick, tick - 1, -1)

    @property
    def is_compiled(self) -> bool:
        """Whether the group decides in kernels, without Python."""
        if self.decides_alone or not decides_in_kernel(self.rules[0]):
            return False
        return all(map(decides_in_kernel, self.others))

    @property
    def is_sound(self) -> bool:
        """Whether the actions of all policies need no check."""
        return self.is_compiled and all(policy.is_sound for policy in self.policies)

    @property
    def draws(self) -> int:
        """The most random numbers that a policy needs per decision."""
        return max(policy.draws if isinstance(policy, Policy) else 0 for policy in self.policies)

    @property
    def inputs(self) -> int:
        """The width of the situation vector that policies read; 0 for none."""
        return max(policy.inputs if isinstance(policy, Policy) else 0 for policy in self.policies)

    @property
    def reads_teammates(self) -> bool:
        """Whether a decision reads the lists of teammates or of relayed targets."""
        return not self.is_compiled or any(policy.reads_teammates for policy in self.policies)

    def neighbours(self, channel: str) -> NeighbourList:
        """Return what the sensor of a channel shows now, whatever the degree of awareness shows."""
        self.host.find_neighbours()
        return filled(self.room(channel))

    def room(self, channel: str) -> NeighbourList:
        """Return the arrays behind `neighbours`, including the unused room."""
        return self.relations[channel].room if channel in self.relations else self.perception.nothing

    @property
    def percept(self) -> Percept:
        """The present percept, as views that the next step overwrites."""
        self.host.perceive(self)
        return self.perceived

    @property
    def perceived(self) -> Percept:
        """The percept of the last time that the group perceived."""
        shown = self.room(TEAMMATES) if self.awareness.shows_teammates else self.perception.shown
        names = tuple(name for name in self.channels if name not in OWN_FIELDS)
        percept = self.percept_of(self.room(TARGETS), filled(shown), filled(self.perception.relayed), names)
        return percept._replace(
            sensing_range=self.sensing_range, awareness_range=self.awareness_range, targets=filled(percept.targets),
            channels=channels_of(names, map(filled, percept.channels)),
        )  # fmt: skip

    def percept_of(
        self, targets: NeighbourList, teammates: NeighbourList, relayed: NeighbourList, channels: tuple[str, ...]
    ) -> Percept:
        """Return a percept that shows these neighbours, and the arrays of further channels."""
        bodies = self.bodies
        moved = bodies.moved if self.timetable is None else self.timetable.travelled
        body = (bodies.heading, moved, bodies.speed, bodies.sensing_range, bodies.awareness_range)
        others = channels_of(channels, map(self.room, channels))
        return Percept(
            *body, targets, teammates, relayed, self.perception.situation, others, self.time,
            bodies.reward, bodies.ended, bodies.identity,
            columns_of(tuple(self.perceived_columns), self.perceived_columns.values()),
            np.zeros((len(bodies), 0)) if self.lidar is None else bodies.lidar,
        )  # fmt: skip

    def noise(self, tick: int) -> Floats:
        """Return the policy's random numbers for a tick, shape (draws, n)."""
        return self.numbers[tick % TICKS_A_BLOCK, :, : len(self.bodies)]


def sizes_of(team: Sequence[Group]) -> tuple[int, int]:
    """Return the number of agents of some groups, with those that have left and without."""
    return sum(len(group.members) for group in team), sum(map(len, team))


def team_of(groups: Sequence[Group], group: Group) -> list[Group]:
    """Return the groups of a group's team, itself included; none without a team."""
    return [other for other in groups if other.team == group.team] if group.team is not None else []
