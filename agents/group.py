"""A group: agents of one class that share a policy, a degree of awareness and, agent by agent, abilities."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.awareness.compiled import SCENE, perceive_entry, situate_entry
from teamsight.agents.layout import GROUP
from teamsight.agents.relation import Relation
from teamsight.policies.compiled import DECISION, CompiledPolicy, bind_decision
from teamsight.policies.interface import Action, Percept, Sightings, no_sightings
from teamsight.world.bodies import Bodies
from teamsight.world.motion import motion
from teamsight.world.noise import LANES, TICKS_A_BLOCK, Stream, stream_number

if TYPE_CHECKING:
    import mesa

    from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]


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
        Where they are and how they can move.
    sensing_range, awareness_range : ndarray, shape (n,), float64
        How far each senses targets and teammates [length].
    policy : object
        What decides for them.
    awareness : Awareness
        What they perceive of teammates.
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
    ) -> None:
        self.name, self.number, self.team = name, number, team
        self.bodies = bodies
        self.sensing_range, self.awareness_range = ranges
        self.policy, self.awareness = policy, awareness
        self.agents: list[mesa.Agent] = []
        self.decides_alone = False
        self.plan: Any = None
        self.relations: dict[str, Relation] = {}
        self.begin()

    def begin(self) -> None:
        """Forget everything and make the buffers anew, as wide as the group is now."""
        size = len(self.bodies)
        self.memory: Any = self.policy.start(size) if hasattr(self.policy, "start") else None
        self.draws = int(getattr(self.policy, "draws", 0))
        self.action = Action(np.zeros((size, 2)), np.zeros(size))
        self.lanes = -(-max(size, 1) // LANES) * LANES
        self._noise = np.zeros((TICKS_A_BLOCK, self.draws, self.lanes))
        self._noise_identity = np.zeros(self.lanes, np.int64)
        self._noise_identity[:size] = self.bodies.member
        self.situation = np.zeros((size, 0), np.float32)
        self._nothing = self._shown = self._reports = no_sightings(size)
        self._room = 0
        self._situated_at: tuple[int, int] | None = None
        self.decided_at = -1
        self.policy_action = self.action

    def __len__(self) -> int:
        return len(self.bodies)

    def __iter__(self) -> Iterator[mesa.Agent]:
        return iter(self.agents)

    def __getitem__(self, row: int) -> mesa.Agent:
        return self.agents[row]

    def __repr__(self) -> str:
        return f"<Group {self.name!r}: {len(self)} agents, {type(self.policy).__name__}, {self.awareness}>"

    @property
    def position(self) -> Floats:
        """Where the agents are, shape (n, 2) [length]; to move one, set its `position`."""
        return _readonly(self.bodies.position)

    @property
    def heading(self) -> Floats:
        """Which way they face, shape (n, 2): unit vectors."""
        return _readonly(self.bodies.heading)

    @property
    def identity(self) -> npt.NDArray[np.int64]:
        """Who they are, shape (n,): their `unique_id` in the model."""
        return _readonly(self.bodies.identity)

    @property
    def is_compiled(self) -> bool:
        """Whether the group can run without Python."""
        return isinstance(self.policy, CompiledPolicy) and not self.decides_alone

    def sightings(self, kind: str) -> Sightings:
        """Return who is truly within range: `targets` or `mates`."""
        return self.relations[kind].sightings if kind in self.relations else self._nothing

    def _buffers_of(self, kind: str) -> Sightings:
        return self.relations[kind].buffers if kind in self.relations else self._nothing

    @property
    def percept(self) -> Percept:
        """What the group knows now, as views that the next step overwrites."""
        mates = self.sightings("mates") if self.awareness.shows_mates else _filled(self._shown)
        return self._percept(self.sightings("targets"), mates, _filled(self._reports))

    def _percept(self, targets: Sightings, mates: Sightings, reports: Sightings) -> Percept:
        bodies = self.bodies
        body = (bodies.heading, bodies.moved, bodies.speed, self.sensing_range, self.awareness_range)
        return Percept(*body, targets, mates, reports, self.situation)

    def noise(self, tick: int) -> Floats:
        """Return the numbers that the policy is handed at this tick, shape (draws, n)."""
        return self._noise[tick % TICKS_A_BLOCK, :, : len(self)]

    def grow(self, need: int) -> None:
        """Make room for this many entries in what the degree of awareness writes; bind again afterwards."""
        self._room = max(need + need // 4, 16)

    def situate(self, moment: tuple[int, int]) -> npt.NDArray[np.float32]:
        """Return the situation vectors of the present moment (`World.moment`), shape (n, width)."""
        if self._situated_at != moment:
            self._situations = np.zeros((len(self), self._width), np.float32)
            scene = self._scene.copy()
            scene[0]["situation"], scene[0]["width"] = self._situations.ctypes.data, self._width
            situate_entry(self.awareness)(scene.ctypes.data)
            self._situated_at = moment
        return self._situations

    def perceive(self) -> bool:
        """Bring the percept up to the present sightings; return whether there was room."""
        entry = perceive_entry(self.awareness)
        need = entry(self._scene.ctypes.data) if entry else 0
        if need > self._room:
            self.grow(need)
            return False
        if self._reads_situation:
            situate_entry(self.awareness)(self._scene.ctypes.data)
        return True

    def bind(self, record: Any, arena: Arena, team: list[Group]) -> None:
        """Write where everything is into a record of kind `GROUP`."""
        self._make_buffers(team)
        self._bind_scene(team)
        buffers = self._percept(
            self._buffers_of("targets"),
            self._mates_buffers(),
            self._reports,
        )
        self._buffers = buffers
        self._move = motion(arena, self.bodies, self.action.heading, self.action.distance)
        self._decision = np.zeros(1, DECISION)
        self._kept: list[npt.NDArray[Any]] = []
        record["decide"] = record["decision"] = 0
        if self.is_compiled:
            self._kept = bind_decision(
                self._decision[0], self.policy, buffers, self.memory, self._noise[0], self.action
            )
            record["decide"], record["decision"] = self.policy.entry().address, self._decision.ctypes.data
        perceive = perceive_entry(self.awareness)
        arrays = {"identity": self._noise_identity, "noise": self._noise, "position": self.bodies.position}
        for name, array in (*arrays.items(), ("scene", self._scene), ("move", self._move.record)):
            record[name] = array.ctypes.data
        record["size"], record["lanes"], record["draws"] = len(self), self.lanes, self.draws
        record["stream"], record["noise_block"] = stream_number(Stream.POLICY, self.number), -1
        record["perceive"], record["room"] = perceive.address if perceive else 0, self._room
        record["situate"] = situate_entry(self.awareness).address if self._reads_situation else 0
        record["advance"] = self._move.entry.address
        assert set(record.dtype.names) == set(GROUP.names or ())

    @property
    def _reads_situation(self) -> bool:
        return bool(getattr(self.policy, "inputs", 0))

    def _mates_buffers(self) -> Sightings:
        if self.awareness.shows_mates:
            return self._buffers_of("mates")
        return self._shown

    def _make_buffers(self, team: list[Group]) -> None:
        size = len(self)
        if type(self.awareness).perceive is not None and "mates" in self.relations:
            self._room = max(self._room, len(self.relations["mates"].identity))
            if not self.awareness.shows_mates:
                self._shown = _room_for(size, self._room)
            self._reports = _room_for(size, self._room)
        self._width = sum(self.awareness.width(max(sum(map(len, team)), 1)))
        # In a large team the vectors of a degree that shows everybody are huge: they wait until somebody asks.
        self.situation = np.zeros((size, self._width if self._reads_situation else 0), np.float32)
        self._situated_at = None

    def _bind_scene(self, team: list[Group]) -> None:
        scene = np.zeros(1, SCENE)
        mates = self.relations.get("mates")
        self._parameters = np.ascontiguousarray(self.awareness.parameters, float)
        self._place = mates.search.index if mates else np.zeros(0, np.int64)
        self._team = np.array([group._as_teammates(mates.first[group.number]) for group in team if mates], np.int64)
        self._team = self._team.reshape(-1, 8)
        sightings = {
            "targets": self._buffers_of("targets"),
            "mates": self._buffers_of("mates"),
            "shown": self._shown,
            "reports": self._reports,
        }
        self._seen = sightings
        arrays = {
            "heading": self.bodies.heading, "sensing_range": self.sensing_range, "place": self._place,
            "awareness_range": self.awareness_range, "team": self._team, "parameters": self._parameters,
            "situation": self.situation,
        }  # fmt: skip
        for kind, seen in sightings.items():
            arrays |= {f"{kind}_{name}": array for name, array in seen._asdict().items()}
        row = scene[0]
        for name, array in arrays.items():
            row[name] = array.ctypes.data
        row["size"], row["width"] = self.situation.shape
        row["first"] = mates.first.get(self.number, 0) if mates else 0
        row["team_groups"], row["parameter_count"] = len(self._team), len(self._parameters)
        row["shown_room"], row["reports_room"] = len(self._shown.distance), len(self._reports.distance)
        self._scene = scene

    def _as_teammates(self, first: int) -> list[int]:
        """Return the group's row of `Scene.team`."""
        arrays = (*self._buffers_of("targets"), self.bodies.heading, self.sensing_range)
        return [first, len(self), *(array.ctypes.data for array in arrays)]


def _room_for(size: int, room: int) -> Sightings:
    return Sightings(np.zeros(size + 1, np.int64), np.zeros(room, np.int64), np.zeros((room, 2)), np.zeros(room))


def _filled(buffers: Sightings) -> Sightings:
    edges = buffers.start[-1]
    return Sightings(buffers.start, buffers.identity[:edges], buffers.offset[:edges], buffers.distance[:edges])


def _readonly(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view
