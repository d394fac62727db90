"""A group: agents of one class that share a policy and a degree of awareness, stored as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Protocol

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.awareness.perception import Perception
from teamsight.agents.channel import TARGETS, TEAMMATES, Channel, Sensors
from teamsight.agents.columns import Column, Columns, install, is_free
from teamsight.agents.engine.readings import Readings
from teamsight.agents.engine.relation import Relation
from teamsight.agents.sensing.sensor import Sensor
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.policies.channels import OWN_FIELDS, channels_of
from teamsight.policies.compiled import CompiledPolicy, check_state
from teamsight.policies.interface import Action, Percept, Policy
from teamsight.policies.percept_of_one import PerceptOfOne
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.motion import limit_of_turn
from teamsight.world.noise import LANES, TICKS_A_BLOCK
from teamsight.world.starts import Founders

Floats = npt.NDArray[np.float64]


class Host(Protocol):
    """The operations of a world on its groups and agents; `WorldHost` implements them, and imports this file."""

    def adjust(self, group: Group, **changes: Any) -> None: ...
    def adjust_one(self, agent: Any, name: str, value: float) -> None: ...
    def place(self, agent: Any, position: npt.ArrayLike) -> None: ...
    def turn(self, agent: Any, heading: Floats) -> None: ...
    def remove(self, agent: Any, leave: Callable[[], None]) -> None: ...
    def find_neighbours(self) -> tuple[int, int]: ...
    def perceive(self, group: Group) -> None: ...
    def decide(self, agent: Any, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]: ...
    def observers_of(self, agent: Any) -> list[Any]: ...
    def is_observed(self, agent: Any) -> bool: ...
    def set_sensor(self, channel: Channel, sensor: Sensor | None) -> None: ...


def _setting(name: str, get: Callable[[Group], Any], doc: str) -> Any:
    """Return a property of groups. Setting it is an adjustment by `World.adjust`."""

    def set_(group: Group, value: Any) -> None:
        group.host.adjust(group, **{name: value})

    return property(get, set_, doc=f"{doc} A new value takes effect as by `World.adjust`.")


class Group:
    """Agents of one class that share a policy and a degree of awareness.

    Attributes
    ----------
    name : str
        The group's name in its world.
    number : int
        Its index among the groups of its world.
    team : str or None
        Groups of the same team are teammates.
    agents : list of mesa.Agent
        The agents, one for each row of the arrays.
    bodies : Bodies
        The arrays behind `position`, `heading`, `speed` and `turn_limit`. Values written into them are not checked.
    ranges : tuple of two ndarray, shape (n,), float64
        The arrays behind `sensing_range` and `awareness_range`; not checked either.
    rules : tuple
        The policy and the degree of awareness; `World.adjust` changes them.
    channels : dict of str to Channel
        What the group senses, by name; `World.senses` declares it.
    readings : dict of str to Readings
        What sensors with a delay have measured and not yet delivered, by channel.
    columns : mapping of str to Column
        The user's own columns, shape (n, …) each; see `add_column`.
    policy_state : object
        The state of the policy; rows as in `agents`.
    action : Action
        The last decision.
    numbers : ndarray, shape (4, draws, lanes), float64
        The policy's random numbers of four ticks.
    members : ndarray, shape (lanes,), int64
        The members whose random numbers these are: `Bodies.member`, and 0 after the last agent.
    """

    def __init__(
        self,
        name: str,
        number: int,
        team: str | None,
        bodies: Bodies,
        ranges: tuple[Floats, Floats],
        policy: Any,
        awareness: Awareness,
        host: Host,
    ) -> None:
        self.name, self.number, self.team = name, number, team
        self.bodies = bodies
        self.ranges = ranges
        self.rules = policy, awareness
        self.columns = Columns(name)
        self.agents: list[mesa.Agent] = []
        self.decides_alone = False
        self.founders: Founders
        self.first_abilities: Abilities
        self.channels: dict[str, Channel] = {} if team is None else {TEAMMATES: Channel(TEAMMATES)}
        self.readings: dict[str, Readings] = {}
        self.relations: dict[str, Relation] = {}
        self.host = host
        self.begin(first_state(policy, len(bodies)))

    def begin(self, state: Any) -> None:
        """Make new buffers for the present size, and set the state of the policy; see `first_state`."""
        size = len(self.bodies)
        self.policy_state = state
        self.draws = self.policy.draws if isinstance(self.policy, Policy) else 0
        self.action = Action(np.zeros((size, 2)), np.zeros(size))
        lanes = -(-max(size, 1) // LANES) * LANES
        self.numbers = np.zeros((TICKS_A_BLOCK, self.draws, lanes))
        self.members = np.zeros(lanes, np.int64)
        self.members[:size] = self.bodies.member
        self.perception = Perception(size)
        # After a failed step: whether the kernel had decided; the next step then carries out `action`.
        self.has_decided = False

    def restart(self, position: Floats, heading: Floats) -> None:
        """Put all agents back to the start of a run, in the arrays that the kernels read.

        Parameters
        ----------
        position, heading : ndarray, shape (founders, 2), float64
            The start of each founder; those of removed agents are ignored.
        """
        bodies, first = self.bodies, self.first_abilities
        rows = slice(None) if len(self) == self.founders.size else bodies.member
        bodies.position[:], bodies.heading[:], bodies.moved[:] = position[rows], heading[rows], 0.0
        bodies.speed[:] = first.speed[rows]
        bodies.turn_cosine[:], bodies.turn_sine[:] = first.turn_cosine[rows], first.turn_sine[rows]
        self.ranges[0][:], self.ranges[1][:] = first.sensing_range[rows], first.awareness_range[rows]
        self.action.heading[:], self.action.distance[:] = 0.0, 0.0
        for readings in self.readings.values():
            readings.forget()
        self.has_decided = False

    def __len__(self) -> int:
        return len(self.bodies)

    def __iter__(self) -> Iterator[mesa.Agent]:
        return iter(self.agents)

    def __getitem__(self, row: int) -> mesa.Agent:
        return self.agents[row]

    def __repr__(self) -> str:
        return f"<Group {self.name!r}: {len(self)} agents, {type(self.policy).__name__}, {self.awareness}>"

    @property
    def sensors(self) -> Sensors:
        """The sensors by channel: ``robots.sensors["teammates"] = Sensor(field_of_view=2.0)``."""
        return Sensors(self.channels, self.host.set_sensor)

    policy = _setting("policy", lambda group: group.rules[0], "The policy of all agents.")
    awareness = _setting("awareness", lambda group: group.rules[1], "What they perceive of teammates.")
    sensing_range = _setting(
        "sensing_range", lambda group: readonly(group.ranges[0]),
        "Distance within which each senses targets, shape (n,) [length].",
    )  # fmt: skip
    awareness_range = _setting(
        "awareness_range", lambda group: readonly(group.ranges[1]),
        "Distance within which each senses teammates, shape (n,) [length].",
    )  # fmt: skip
    speed = _setting(
        "speed", lambda group: readonly(group.bodies.speed),
        "The largest distance that each can move in a step, shape (n,) [length].",
    )  # fmt: skip
    turn_limit = _setting(
        "turn_limit", lambda group: readonly(limit_of_turn(group.bodies.turn_cosine, group.bodies.turn_sine)),
        "The largest angle that each can turn in a step, shape (n,) [rad].",
    )  # fmt: skip

    def add_column(self, name: str, fill: Any = 0.0) -> Column:
        """Add a property of your own, which is saved and restored with the world.

        It is also an attribute of each agent: after ``robots.add_column("battery", 1.0)``, ``robot.battery -= 0.1``.

        Parameters
        ----------
        name : str
            A name that is not yet an attribute of the agents.
        fill : object or array_like, shape (n, …)
            One value, or one for each agent. It determines the column's type: 0 for integers, 0.0 for floats.

        Returns
        -------
        Column
            Used like an array of shape (n, …). It stays valid when agents are removed and states are restored.

        Raises
        ------
        TypeError, ValueError
            If the name is not a string, or the name of a column or another attribute; or if `fill` has another length.
        """
        if not isinstance(name, str) or not name:
            raise TypeError(f"name={name!r}: must be a string, such as 'battery'")
        if name in self.columns:
            raise ValueError(f"name={name!r}: the group {self.name!r} has this column; take another name")
        if not all(is_free(agent, name) for agent in self.agents):
            raise ValueError(f"name={name!r}: the agents of {self.name!r} have this attribute; take another name")
        value = np.asarray(fill)
        if value.dtype.kind in "US":
            # An array of strings would truncate longer ones.
            value = value.astype(object)
        if value.ndim and len(value) != len(self):
            raise ValueError(f"fill: has the shape {value.shape}; give one value, or {len(self)}, one for each agent")
        install(self, name)
        return self.columns.create(name, np.array(value if value.ndim else np.full(len(self), value)))

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
    def is_compiled(self) -> bool:
        """Whether the group decides in a kernel, without Python."""
        kernel_decides = isinstance(self.policy, CompiledPolicy) and type(self.policy).decide is CompiledPolicy.decide
        return kernel_decides and not self.decides_alone

    @property
    def inputs(self) -> int:
        """The width of the situation vector that the policy reads; 0 for none."""
        return self.policy.inputs if isinstance(self.policy, Policy) else 0

    @property
    def is_sound(self) -> bool:
        """Whether the policy's actions need no check."""
        return self.is_compiled and self.policy.is_sound

    @property
    def reads_teammates(self) -> bool:
        """Whether a decision reads the lists of teammates or of relayed targets."""
        return not self.is_compiled or self.policy.reads_teammates

    def neighbours(self, channel: str) -> NeighbourList:
        """Return what the sensor of a channel shows, whatever the degree of awareness shows."""
        return filled(self.room(channel))

    def room(self, channel: str) -> NeighbourList:
        """Return the arrays behind `neighbours`, including the unused room."""
        return self.relations[channel].room if channel in self.relations else self.perception.nothing

    @property
    def percept(self) -> Percept:
        """The present percept, as views that the next step overwrites."""
        teammates = self.neighbours(TEAMMATES) if self.awareness.shows_teammates else filled(self.perception.shown)
        names = tuple(name for name in self.channels if name not in OWN_FIELDS)
        percept = self.percept_of(self.room(TARGETS), teammates, filled(self.perception.relayed), names)
        return percept._replace(
            targets=filled(percept.targets), channels=channels_of(names, map(filled, percept.channels))
        )

    def percept_of(
        self, targets: NeighbourList, teammates: NeighbourList, relayed: NeighbourList, channels: tuple[str, ...]
    ) -> Percept:
        """Return a percept that shows these neighbours, and the arrays of further channels."""
        bodies = self.bodies
        body = (bodies.heading, bodies.moved, bodies.speed, self.sensing_range, self.awareness_range)
        others = channels_of(channels, map(self.room, channels))
        return Percept(*body, targets, teammates, relayed, self.perception.situation, others)

    def noise(self, tick: int) -> Floats:
        """Return the policy's random numbers for a tick, shape (draws, n)."""
        return self.numbers[tick % TICKS_A_BLOCK, :, : len(self)]


def team_of(groups: list[Group], group: Group) -> list[Group]:
    """Return the groups of a group's team, itself included; none without a team."""
    return [other for other in groups if other.team == group.team] if group.team is not None else []


def first_state(policy: Any, size: int) -> Any:
    """Return the state of a policy for `size` agents before their first decision.

    Raises
    ------
    TypeError, ValueError
        If the policy has a kernel that cannot read the state.
    """
    state = policy.start(size) if isinstance(policy, Policy) else None
    if isinstance(policy, CompiledPolicy):
        check_state(policy, state, size)
    return state


def readonly(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a read-only view."""
    view = array.view()
    view.flags.writeable = False
    return view
