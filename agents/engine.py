"""The engine: puts a world's groups together for the compiled loop, calls it, and makes room where it ran out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents import decisions, membership
from teamsight.agents.experience import ExperienceLog
from teamsight.agents.fit import check_fit
from teamsight.agents.layout import BAD_ACTION, DONE, EXPERIENCE, GROUP, GROW_PERCEPT, GROW_RELATION, RELATION, WORLD
from teamsight.agents.relation import Relation
from teamsight.agents.rollout import BEGIN_STEP, END_STEP, RUN, SEE
from teamsight.agents.views import Trail

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.group import Group
    from teamsight.agents.history import Stretch
    from teamsight.agents.model import World
    from teamsight.kernel import Entry

# About a quarter of a second's work.
_BODY_STEPS_A_CALL = 4_000_000


class Engine:
    """What stands between a `World` and the compiled loop.

    Attributes
    ----------
    is_bound : bool
        Whether the records describe the groups as they are.
    is_seen : bool
        Whether the sightings are those of the present positions.
    looks : int
        How often sightings were found between steps.
    stretch : Stretch
        Where steps are recorded.
    trails : list of Trail
        The positions kept.
    logs : list of ExperienceLog
        The experience kept.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._sensed: list[tuple[Group, Group]] = []
        self._every = 0
        self.relations: list[Relation] = []
        self.is_bound = self.is_seen = self._is_recorded = False
        self.looks = 0
        self.trails: list[Trail] = []
        self._experienced: list[Group] = []
        self.logs: list[ExperienceLog] = []
        self.stretch: Stretch = world._history.begin([])

    def senses(self, observers: Group, observed: Group) -> None:
        """Let one group sense another from now on."""
        for group in (observers, observed):
            if group not in self._world.groups:
                raise ValueError(f"senses({observers!r}, {observed!r}): both groups must have been added to this world")
        if (observers, observed) not in self._sensed:
            self._sensed.append((observers, observed))

    def prepare(self) -> None:
        """Make everything ready for a step: records, buffers and sightings of the present positions."""
        if not self.is_bound:
            self._connect()
            self._bind()
            self.is_bound, self.is_seen = True, False
        if not self.is_seen:
            self._call(SEE)
            self.is_seen, self._is_recorded = True, False
            self.looks += 1

    def perceive(self, group: Group) -> None:
        """Bring a group's percept up to the present positions."""
        self.prepare()
        while not group.perception.perceive(group.awareness):
            self._bind_groups()

    def run(self, steps: int) -> None:
        """Make `steps` steps in one compiled call; all policies have kernels."""
        self._make_room(steps)
        self._world_record["steps"] = steps
        self._call(RUN)

    def step(self) -> None:
        """Make one step."""
        world = self._world
        if all(group.is_compiled for group in world.groups):
            self.run(1)
            return
        self._make_room(1)
        self._call(BEGIN_STEP)
        for group in world.groups:
            if not group.is_compiled:
                decisions.decide(group, world.tick, world.key)
        self._call(END_STEP)

    @property
    def longest_call(self) -> int:
        """How many steps to make in one call: so many that calls cost nothing, so few that Ctrl-C is heard at once."""
        return max(_BODY_STEPS_A_CALL // max(sum(map(len, self._world.groups)), 1), 1)

    def record_positions(self, every: int) -> None:
        """Keep positions each `every` steps, from now on."""
        self._every = every
        self.is_bound = False

    def record_experience(self, group: Group) -> None:
        """Keep what the robots of a group meet, from now on."""
        if group not in self._world.groups:
            raise ValueError(f"record_experience({group!r}): the group must have been added to this world")
        if group not in self._experienced:
            self._experienced.append(group)
            self.is_bound = False

    def forget(self) -> None:
        """Begin to record anew."""
        self.is_bound = self.is_seen = self._is_recorded = False
        self.trails, self.logs = [], []
        self.stretch = self._world._history.begin([])

    def present(self, name: str) -> float:
        """Return a column of the history as it would be for the present positions."""
        self.prepare()
        if self._is_recorded:
            return float(self.stretch.columns(self.stretch.rows - 1)[name][0])
        seen: dict[int, npt.NDArray[np.bool_]] = {}
        edges = robots = 0
        for relation in self.relations:
            if relation.kind == "mates":
                edges += len(relation.graph.index)
                robots += len(relation.observers)
            elif relation.observers.team is not None:
                met = np.zeros(len(relation.everyone), bool)
                met[relation.graph.index] = True
                for group in relation.observed:
                    first = relation.first[group.number]
                    part = met[first : first + len(group)]
                    seen[group.number] = seen.get(group.number, False) | part
        if name == "mean_neighbours":
            return edges / robots if robots else float("nan")
        total = sum(map(len, seen.values()))
        return sum(int(part.sum()) for part in seen.values()) / total if total else float("nan")

    def observers_of(self, agent: Body) -> list[Any]:
        """Return the agents that have this one in sensing range."""
        found = []
        for relation in self.relations:
            if relation.kind == "targets" and agent.group.number in relation.first:
                index = relation.first[agent.group.number] + agent.row
                edges = np.flatnonzero(relation.graph.index == index)
                rows = np.searchsorted(relation.graph.start, edges, side="right") - 1
                found += [relation.observers.agents[row] for row in rows]
        return found

    def _connect(self) -> None:
        """Make the relations: who senses whom, and who is aware of whom."""
        world = self._world
        self.relations = []
        for group in world.groups:
            group.relations = {}
            sensed = [observed for observers, observed in self._sensed if observers is group]
            team = membership.team_of(world.groups, group)
            for kind, observed, reach in (
                ("targets", sensed, group.sensing_range),
                ("mates", team, group.awareness_range),
            ):
                if observed:
                    group.relations[kind] = Relation(kind, group, observed, reach, world.arena)
                    self.relations.append(group.relations[kind])
            check_fit(group, team)
        self.stretch = world._history.begin(self.relations)

    def _bind(self) -> None:
        """Write all records."""
        world = self._world
        bodies = sum(map(len, world.groups))
        self._met = {self._side(group): np.zeros(bodies, np.int64) for group in world.groups}
        self._relation_records = np.zeros(len(self.relations), RELATION)
        for where in range(len(self.relations)):
            self._bind_relation(where)
        self._group_records = np.zeros(len(world.groups), GROUP)
        self._bind_groups()
        records = np.zeros(1, WORLD)
        self._world_record = records[0]
        self._address = records.ctypes.data
        self._kept = records
        record = self._world_record
        record["key"], record["tick"], record["bodies"] = world.key.ctypes.data, world.tick, bodies
        record["groups"], record["group_count"] = self._group_records.ctypes.data, len(world.groups)
        record["relations"], record["relation_count"] = self._relation_records.ctypes.data, len(self.relations)
        record["every"] = self._every
        if self._every:
            self.trails.append(Trail(world.groups, self._every, world.tick))
        self._begin_logs()
        self._bind_logs()
        record["logs"], record["log_count"] = self._log_records.ctypes.data, len(self._log_records)

    def _begin_logs(self) -> None:
        """Begin to keep experience in new arrays: who is in a group, or on its team, may have changed."""
        groups = self._world.groups
        teams = [membership.team_of(groups, group) for group in self._experienced]
        begun = [
            ExperienceLog(group, sum(map(len, team))) for group, team in zip(self._experienced, teams, strict=True)
        ]
        self.logs = [log for log in self.logs if log.rows] + begun
        self._log_records = np.zeros(len(begun), EXPERIENCE)

    def _logs_in_use(self) -> list[tuple[ExperienceLog, Any]]:
        first = len(self.logs) - len(self._log_records)
        return list(zip(self.logs[first:], self._log_records, strict=True))

    def _bind_logs(self) -> None:
        bodies = sum(map(len, self._world.groups))
        for log, record in self._logs_in_use():
            log.bind(record, self._world.groups, self.relations, bodies)

    def _bind_relation(self, where: int) -> None:
        relation = self.relations[where]
        first_row, row = {}, 0
        for group in self._world.groups:
            first_row[group.number] = row
            row += len(group)
        relation.bind(self._relation_records[where], self._met[self._side(relation.observers)], first_row)

    def _bind_groups(self) -> None:
        for group, record in zip(self._world.groups, self._group_records, strict=True):
            group.bind(record, self._world.arena, membership.team_of(self._world.groups, group))

    @staticmethod
    def _side(group: Group) -> str | int:
        """All groups that are on a team count together what they observe."""
        return group.number if group.team is None else "teams"

    def _make_room(self, steps: int) -> None:
        self.stretch.make_room(steps)
        record = self._world_record
        record["history"], record["row"] = self.stretch.raw.ctypes.data, self.stretch.rows
        if self._every:
            trail = self.trails[-1]
            trail.make_room(steps // self._every + 1)
            record["trail"], record["trail_row"] = trail.raw.ctypes.data, trail.rows
        moved = [log.make_room(steps) for log, _ in self._logs_in_use()]
        if any(moved):
            self._bind_logs()

    def _call(self, entry: Entry) -> None:
        """Call the loop until it is done, making room whenever it asks for it."""
        record = self._world_record
        while (status := entry(self._address)) != DONE:
            where, need = int(record["where"]), int(record["need"])
            if status == BAD_ACTION:
                self._read_back()
                policy = type(self._world.groups[where].policy).__name__
                name = self._world.groups[where].name
                raise ValueError(
                    f"{policy}: an action of {name} at tick {self._world.tick} is not finite, or its heading no unit "
                    "vector; check the policy with check_policy(), and a degree of awareness of your own for readings "
                    "that are NaN"
                )
            # Noise, percepts and sightings are pure: what was interrupted is begun again.
            self._grow(status, where, need)
        self._read_back()

    def _grow(self, status: int, where: int, need: int) -> None:
        """Make room and bind again, keeping what the loop has got to."""
        assert status in (GROW_RELATION, GROW_PERCEPT)
        if status == GROW_RELATION:
            self.relations[where].grow(need)
            self._bind_relation(where)
        else:
            self._world.groups[where].perception.grow(need)
        self._bind_groups()
        self._keep_log_rows()
        self._bind_logs()

    def _read_back(self) -> None:
        record = self._world_record
        self._world.tick = int(record["tick"])
        if record["history"]:
            self._is_recorded = self._is_recorded or int(record["row"]) > self.stretch.rows
            self.stretch.rows = int(record["row"])
            self.stretch.sum_up()
        if self._every and record["trail"]:
            self.trails[-1].rows = int(record["trail_row"])
        self._keep_log_rows()

    def _keep_log_rows(self) -> None:
        for log, record in self._logs_in_use():
            log.rows = int(record["row"])
