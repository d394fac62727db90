"""A group: agents of one class that share a policy, a degree of awareness and, agent by agent, abilities."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.awareness.binding import perceive_entry, situate_entry
from teamsight.agents.awareness.perception import Perception
from teamsight.agents.columns.attribute import install, is_free
from teamsight.agents.columns.column import Column, Columns
from teamsight.agents.engine.neighbours import Relation
from teamsight.agents.engine.records import GROUP
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.policies.compiled import DECISION, CompiledPolicy, bind_decision, check_memory
from teamsight.policies.interface import Action, Percept, Policy
from teamsight.policies.percept_of_one import PerceptOfOne
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.motion import limit_of_turn, motion
from teamsight.world.noise import LANES, TICKS_A_BLOCK, Stream, stream_number
from teamsight.world.starts import Founders

if TYPE_CHECKING:
    import mesa

    from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]


class Host(Protocol):
    """What groups and their agents ask of the world that they are in; see `teamsight.agents.host`."""

    def adjust(self, group: Group, **changes: Any) -> None: ...
    def adjust_one(self, agent: Any, name: str, value: float) -> None: ...
    def place(self, agent: Any, position: npt.ArrayLike) -> None: ...
    def turn(self, agent: Any, heading: Floats) -> None: ...
    def remove(self, agent: Any, leave: Callable[[], None]) -> None: ...
    def look(self) -> tuple[int, int]: ...
    def perceive(self, group: Group) -> None: ...
    def decide(self, agent: Any, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]: ...
    def observers_of(self, agent: Any) -> list[Any]: ...


class Decision(Protocol):
    """A decision of a group whose policy is Python, while it is being made; see `Deliberation`."""

    def decide(self) -> Action: ...
    def memory(self) -> Any: ...
    def policy_decides(self, row: int, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]: ...


class Group:
    """Agents of one class that share a policy and a degree of awareness.

    Attributes
    ----------
    name : str
        The group's name in its world.
    number : int
        Its place among the groups of its world.
    team : str or None
        Groups of the same team are teammates.
    agents : list of mesa.Agent
        The agents, one for each row of the arrays.
    bodies : Bodies
        The arrays behind `position`, `heading`, `speed` and `turn_limit`. What is written into them is not checked.
    ranges : tuple of two ndarray, shape (n,), float64
        The arrays behind `sensing_range` and `awareness_range`, likewise.
    rules : tuple
        The policy and the degree of awareness; `World.adjust` changes them.
    columns : mapping of str to Column
        The user's own columns, shape (n, …) each; see `add_column`.
    memory : object
        What they remember; rows as in `agents`.
    action : Action
        What they decided last.
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
        self.relations: dict[str, Relation] = {}
        self.host = host
        self.begin(first_memory(policy, len(bodies)))

    def begin(self, memory: Any) -> None:
        """Make the buffers anew, as wide as the group is now, and remember this; see `first_memory`."""
        size = len(self.bodies)
        self.memory = memory
        self.draws = self.policy.draws if isinstance(self.policy, Policy) else 0
        self.action = Action(np.zeros((size, 2)), np.zeros(size))
        self.lanes = -(-max(size, 1) // LANES) * LANES
        self._noise = np.zeros((TICKS_A_BLOCK, self.draws, self.lanes))
        self._noise_identity = np.zeros(self.lanes, np.int64)
        self._noise_identity[:size] = self.bodies.member
        self.perception = Perception(size)
        # While a step is being made, the decision under way; and, after a step that failed once its policies with
        # kernels had decided, that they have: their memory is one decision ahead, and `action` holds it.
        self.deliberation: Decision | None = None
        self.has_decided = False

    def restart(self, position: Floats, heading: Floats) -> None:
        """Put all agents back to the start of a run, in the arrays that the kernels read.

        Parameters
        ----------
        position, heading : ndarray, shape (founders, 2), float64
            The start of each founder; agents that have been removed are left out.
        """
        bodies, first = self.bodies, self.first_abilities
        rows = slice(None) if len(self) == self.founders.size else bodies.member
        bodies.position[:], bodies.heading[:], bodies.moved[:] = position[rows], heading[rows], 0.0
        bodies.speed[:] = first.speed[rows]
        bodies.turn_cosine[:], bodies.turn_sine[:] = first.turn_cosine[rows], first.turn_sine[rows]
        self.ranges[0][:], self.ranges[1][:] = first.sensing_range[rows], first.awareness_range[rows]
        self.action.heading[:], self.action.distance[:] = 0.0, 0.0
        self.deliberation, self.has_decided = None, False

    def __len__(self) -> int:
        return len(self.bodies)

    def __iter__(self) -> Iterator[mesa.Agent]:
        return iter(self.agents)

    def __getitem__(self, row: int) -> mesa.Agent:
        return self.agents[row]

    def __repr__(self) -> str:
        return f"<Group {self.name!r}: {len(self)} agents, {type(self.policy).__name__}, {self.awareness}>"

    @property
    def policy(self) -> Any:
        """What decides for them; what is set takes effect as by `World.adjust`."""
        return self.rules[0]

    @policy.setter
    def policy(self, value: Any) -> None:
        self.host.adjust(self, policy=value)

    @property
    def awareness(self) -> Awareness:
        """What they perceive of teammates; what is set takes effect as by `World.adjust`."""
        return self.rules[1]

    @awareness.setter
    def awareness(self, value: Awareness | str) -> None:
        self.host.adjust(self, awareness=value)

    @property
    def sensing_range(self) -> Floats:
        """How far each senses targets, shape (n,) [length]; what is set takes effect as by `World.adjust`."""
        return readonly(self.ranges[0])

    @sensing_range.setter
    def sensing_range(self, value: npt.ArrayLike) -> None:
        self.host.adjust(self, sensing_range=value)

    @property
    def awareness_range(self) -> Floats:
        """How far each senses teammates, shape (n,) [length]; what is set takes effect as by `World.adjust`."""
        return readonly(self.ranges[1])

    @awareness_range.setter
    def awareness_range(self, value: npt.ArrayLike) -> None:
        self.host.adjust(self, awareness_range=value)

    @property
    def speed(self) -> Floats:
        """The farthest each can go a step, shape (n,) [length]; what is set takes effect as by `World.adjust`."""
        return readonly(self.bodies.speed)

    @speed.setter
    def speed(self, value: npt.ArrayLike) -> None:
        self.host.adjust(self, speed=value)

    @property
    def turn_limit(self) -> Floats:
        """The farthest each can turn a step, shape (n,) [rad]; what is set takes effect as by `World.adjust`."""
        return readonly(limit_of_turn(self.bodies.turn_cosine, self.bodies.turn_sine))

    @turn_limit.setter
    def turn_limit(self, value: npt.ArrayLike) -> None:
        self.host.adjust(self, turn_limit=value)

    def add_column(self, name: str, fill: Any = 0.0) -> Column:
        """Give the agents a property of the user's own, which is saved and restored with the world.

        It is also an attribute of each agent: after ``robots.add_column("battery", 1.0)``, ``robot.battery -= 0.1``.

        Parameters
        ----------
        name : str
            A new name, which the agents do not have yet.
        fill : object or array_like, shape (n, …)
            The value for all, or for each. Its type is that of the column: 0 for whole numbers, 0.0 for any.

        Returns
        -------
        Column
            Used like an array of shape (n, …); it stays valid when agents leave and states are restored.

        Raises
        ------
        TypeError
            If the name is no text.
        ValueError
            If there is a column or another attribute of this name, or `fill` is of another length.
        """
        if not isinstance(name, str) or not name:
            raise TypeError(f"name={name!r}: must be a text, such as 'battery'")
        if name in self.columns:
            raise ValueError(f"name={name!r}: the group {self.name!r} has this column; take another name")
        if not all(is_free(agent, name) for agent in self.agents):
            raise ValueError(f"name={name!r}: the agents of {self.name!r} have this attribute; take another name")
        value = np.asarray(fill)
        if value.dtype.kind in "US":
            # An array of texts would cut off longer ones.
            value = value.astype(object)
        if value.ndim and len(value) != len(self):
            raise ValueError(f"fill: has the shape {value.shape}; give one value, or {len(self)}, one for each agent")
        install(self, name)
        return self.columns.create(name, np.array(value if value.ndim else np.full(len(self), value)))

    @property
    def position(self) -> Floats:
        """Where the agents are, shape (n, 2) [length]; to move one, set its own `position`."""
        return readonly(self.bodies.position)

    @property
    def heading(self) -> Floats:
        """Which way they face, shape (n, 2): unit vectors."""
        return readonly(self.bodies.heading)

    @property
    def identity(self) -> npt.NDArray[np.int64]:
        """Who they are, shape (n,): their `unique_id` in the model."""
        return readonly(self.bodies.identity)

    @property
    def is_compiled(self) -> bool:
        """Whether the group can run without Python."""
        kernel_decides = isinstance(self.policy, CompiledPolicy) and type(self.policy).decide is CompiledPolicy.decide
        return kernel_decides and not self.decides_alone

    def sightings(self, kind: str) -> NeighbourList:
        """Return who is truly within range: `targets` or `teammates`."""
        return self.relations[kind].sightings if kind in self.relations else self.perception.nothing

    def buffers(self, kind: str) -> NeighbourList:
        """Return the whole arrays behind `sightings`."""
        return self.relations[kind].buffers if kind in self.relations else self.perception.nothing

    @property
    def percept(self) -> Percept:
        """What the group knows now, as views that the next step overwrites."""
        teammates = self.sightings("teammates") if self.awareness.shows_teammates else filled(self.perception.shown)
        return self._percept(self.sightings("targets"), teammates, filled(self.perception.relayed))

    def _percept(self, targets: NeighbourList, teammates: NeighbourList, relayed: NeighbourList) -> Percept:
        bodies = self.bodies
        body = (bodies.heading, bodies.moved, bodies.speed, self.sensing_range, self.awareness_range)
        return Percept(*body, targets, teammates, relayed, self.perception.situation)

    def noise(self, tick: int) -> Floats:
        """Return the numbers that the policy is handed at this tick, shape (draws, n)."""
        return self._noise[tick % TICKS_A_BLOCK, :, : len(self)]

    def bind(self, record: Any, arena: Arena, team: list[Group]) -> None:
        """Write where everything is into a record of kind `GROUP`."""
        perception = self.perception
        perception.bind(self, team)
        teammates = self.buffers("teammates") if self.awareness.shows_teammates else perception.shown
        buffers = self._percept(self.buffers("targets"), teammates, perception.relayed)
        self._move = motion(arena, self.bodies, self.action.heading, self.action.distance)
        self._decision = np.zeros(1, DECISION)
        self._kept: list[npt.NDArray[Any]] = []
        record["decide"] = record["decision"] = 0
        if self.is_compiled and not self.has_decided:
            self._kept = bind_decision(
                self._decision[0], self.policy, buffers, self.memory, self._noise[0], self.action
            )
            record["decide"], record["decision"] = self.policy.entry().address, self._decision.ctypes.data
        record["sound"] = self.is_compiled and self.policy.is_sound
        perceive = perceive_entry(self.awareness)
        arrays = {"identity": self._noise_identity, "noise": self._noise, "position": self.bodies.position}
        for name, array in (*arrays.items(), ("scene", perception.scene), ("move", self._move.record)):
            record[name] = array.ctypes.data
        record["size"], record["lanes"], record["draws"] = len(self), self.lanes, self.draws
        record["stream"], record["noise_block"] = stream_number(Stream.POLICY, self.number), -1
        record["perceive"], record["room"] = perceive.address if perceive else 0, perception.room
        record["situate"] = situate_entry(self.awareness).address if perception.is_situated else 0
        record["advance"] = self._move.entry.address
        assert set(record.dtype.names) == set(GROUP.names or ())


def team_of(groups: list[Group], group: Group) -> list[Group]:
    """Return the groups that are teammates of a group, itself included; empty for one that is on no team."""
    return [other for other in groups if other.team == group.team] if group.team is not None else []


def first_memory(policy: Any, size: int) -> Any:
    """Return what `size` agents under a policy remember before their first decision.

    Raises
    ------
    TypeError, ValueError
        If a policy with a kernel returns none that the kernel can read.
    """
    memory = policy.start(size) if isinstance(policy, Policy) else None
    if isinstance(policy, CompiledPolicy):
        check_memory(policy, memory, size)
    return memory


def readonly(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a view that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view
