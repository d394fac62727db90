"""The engine: puts a world's groups together for the compiled loop, calls it, and makes room where it ran out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.agents.engine import present
from teamsight.agents.engine.connect import connect
from teamsight.agents.engine.failures import check_places, failure, insatiable
from teamsight.agents.engine.loop import BEGIN_STEP, END_STEP, RUN, SEE
from teamsight.agents.engine.neighbours import Relation
from teamsight.agents.engine.python_policies import Deliberation
from teamsight.agents.engine.records import BAD_ACTION, DONE, GROUP, GROW_RELATION, OUTSIDE, RELATION, WORLD
from teamsight.agents.group import Group, team_of
from teamsight.agents.recording.trajectory import Trail
from teamsight.agents.recording.transition_logs import ExperienceLogs
from teamsight.agents.timeline import DECIDE
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.world.motion import is_watched

if TYPE_CHECKING:
    from teamsight.agents.recording.history import Stretch
    from teamsight.core.kernel import Entry
    from teamsight.policies.interface import Action

# About a quarter of a second's work.
_BODY_STEPS_A_CALL = 4_000_000
# How often one percept gets the room that it asked for, and a quarter more, before it is taken for one that never ends.
_MOST_GROWTH = 8


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
    experience : ExperienceLogs
        The experience kept.
    """

    def __init__(self, data: WorldData) -> None:
        self._data = data
        self._sensed: list[tuple[Group, Group]] = []
        self._every = 0
        self.relations: list[Relation] = []
        self.is_bound = self.is_seen = self._is_recorded = False
        self._phase = 0
        self.looks = 0
        self.trails: list[Trail] = []
        self.experience = ExperienceLogs()
        self.stretch: Stretch = data.history.begin([])

    def senses(self, observers: Group, observed: Group) -> None:
        """Let one group sense another from now on."""
        for group in (observers, observed):
            if group not in self._data.groups:
                shown = f"senses({checks.shown(observers)}, {checks.shown(observed)})"
                raise ValueError(f"{shown}: both groups must have been added to this world")
        if (observers, observed) not in self._sensed:
            self._sensed.append((observers, observed))
            self.is_bound = False

    def leave_out(self, group: Group) -> None:
        """Undo what was said of a group that could not be added."""
        self._sensed = [pair for pair in self._sensed if group not in pair]
        self.experience.leave_out(group)
        self.is_bound = False

    def prepare(self) -> None:
        """Make everything ready for a step: records, buffers and sightings of the present positions."""
        if not self.is_bound:
            with deferred():
                self.relations = connect(self._data, self._sensed)
                self.stretch = self._data.history.begin(self.relations)
                self._bind()
                self.is_bound, self.is_seen = True, False
        if not self.is_seen:
            self._call(SEE)
            self.is_seen, self._is_recorded = True, False
            self.looks += 1

    def perceive(self, group: Group) -> None:
        """Bring a group's percept up to the present positions."""
        self.prepare()
        for _ in range(_MOST_GROWTH):
            if group.perception.perceive(group.awareness):
                return
            self._bind_groups()
        raise insatiable(group)

    def run(self, steps: int) -> None:
        """Make at most `steps` steps in one compiled call; all policies have kernels.

        After a step that failed it makes that one only, on the decisions that stand.
        """
        resumed = any(group.has_decided for group in self._data.groups)
        if resumed:
            steps = 1
        self._make_room(steps)
        # A step whose sightings had no room is completed first.
        self._world_record["steps"] = steps - self._phase
        self._call(RUN)
        if resumed:
            self._decide_again()

    def step(self) -> None:
        """Make one step."""
        data = self._data
        if all(group.is_compiled for group in data.groups):
            self.run(1)
            return
        self._make_room(1)
        if self._phase:
            self._call(END_STEP)
            return
        self._call(BEGIN_STEP)
        deciding = [group for group in data.groups if not group.is_compiled]
        try:
            actions = self._decide(deciding)
            with deferred():
                for group, action in zip(deciding, actions, strict=True):
                    group.action.heading[:], group.action.distance[:] = action
                memories = [group.deliberation.memory() for group in deciding]  # type: ignore[union-attr]
                tick = data.timeline.tick
                try:
                    self._call(END_STEP)
                finally:
                    if data.timeline.tick > tick or self._phase:
                        for group, memory in zip(deciding, memories, strict=True):
                            group.memory = memory
        finally:
            for group in deciding:
                group.deliberation = None
        self._decide_again()

    def _decide(self, groups: list[Group]) -> list[Action]:
        """Let the policies decide that are Python."""
        data = self._data
        for group in groups:
            group.deliberation = Deliberation(group, data.timeline.tick, data.key, group.noise(data.timeline.tick))
        with data.timeline.calling(DECIDE):
            return [group.deliberation.decide() for group in groups]  # type: ignore[union-attr]

    def _decide_again(self) -> None:
        """From now on let all policies with kernels decide that had decided in a step that failed."""
        for group in self._data.groups:
            if group.has_decided:
                group.has_decided = False
                self.is_bound = False

    @property
    def longest_call(self) -> int:
        """How many steps to make in one call: so many that calls cost nothing, so few that Ctrl-C is heard at once."""
        return max(_BODY_STEPS_A_CALL // max(sum(map(len, self._data.groups)), 1), 1)

    def record_positions(self, every: int) -> None:
        """Keep positions each `every` steps, from now on."""
        self._every = every
        self.is_bound = False

    def record_experience(self, group: Group) -> None:
        """Keep what the robots of a group meet, from now on."""
        if group not in self._data.groups:
            raise ValueError(f"record_experience({checks.shown(group)}): the group must have been added to this world")
        if self.experience.record(group):
            self.is_bound = False

    def forget(self, *, is_kept: bool = False) -> None:
        """Begin to record anew.

        Parameters
        ----------
        is_kept : bool
            Whether all arrays are where they were, so that the records need not be written again.
        """
        # Trails and logs begin with the binding.
        self.is_bound = self.is_bound and is_kept and not (self._every or self.experience.is_on)
        self.is_seen = self._is_recorded = False
        self._phase = 0
        if self.is_bound:
            for name in ("tick", "phase", "history", "row"):
                self._world_record[name] = 0
            self._group_records["noise_block"] = -1
            for met in self._met.values():
                met[:] = 0
            self.stretch = self._data.history.begin_like(self.stretch)
            return
        self.trails = []
        self.experience.forget()
        self.stretch = self._data.history.begin([])

    @property
    def extras(self) -> tuple[int, int, bool]:
        """What was asked for besides running: how many groups sense others, and what is recorded."""
        return len(self._sensed), self._every, self.experience.is_on

    def adapt(self) -> None:
        """Let the next step follow from another arena and other ranges, which were written into the arrays."""
        # Cells are as wide as the range.
        if any(relation.search.has_cells for relation in self.relations):
            self.is_bound = False

    def present(self, name: str) -> float:
        """Return a column of the history as it would be for the present positions."""
        self.prepare()
        if self._is_recorded:
            return float(self.stretch.columns(self.stretch.rows - 1)[name][0])
        return {"observed": present.observed_share, "mean_neighbours": present.mean_neighbours}[name](self.relations)

    def _bind(self) -> None:
        """Write all records."""
        data = self._data
        bodies = sum(map(len, data.groups))
        self._met = {self._side(group): np.zeros(bodies, np.int64) for group in data.groups}
        self._relation_records = np.zeros(len(self.relations), RELATION)
        for where in range(len(self.relations)):
            self._bind_relation(where)
        self._group_records = np.zeros(len(data.groups), GROUP)
        self._bind_groups()
        records = np.zeros(1, WORLD)
        self._world_record = records[0]
        self._address = records.ctypes.data
        self._kept = records
        record = self._world_record
        record["key"], record["tick"], record["bodies"] = data.key.ctypes.data, data.timeline.tick, bodies
        record["groups"], record["group_count"] = self._group_records.ctypes.data, len(data.groups)
        record["relations"], record["relation_count"] = self._relation_records.ctypes.data, len(self.relations)
        record["every"], record["phase"] = self._every, self._phase
        self._kept_places = np.zeros((bodies if is_watched(data.arena) else 0, 6))
        record["kept"] = self._kept_places.ctypes.data if is_watched(data.arena) else 0
        if self._every:
            self.trails.append(Trail(data.groups, self._every, data.timeline.tick))
        self.experience.begin(data.groups)
        self.experience.bind(data.groups, self.relations)
        record["logs"], record["log_count"] = self.experience.records.ctypes.data, len(self.experience.records)

    def _bind_relation(self, where: int) -> None:
        relation = self.relations[where]
        first_row, row = {}, 0
        for group in self._data.groups:
            first_row[group.number] = row
            row += len(group)
        relation.bind(self._relation_records[where], self._met[self._side(relation.observers)], first_row)

    def _bind_groups(self) -> None:
        for group, record in zip(self._data.groups, self._group_records, strict=True):
            group.bind(record, self._data.arena, team_of(self._data.groups, group))

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
        if self.experience.make_room(steps):
            self.experience.bind(self._data.groups, self.relations)

    def _call(self, entry: Entry) -> None:
        """Call the loop until it is done, making room whenever it asks for it.

        Ctrl-C is raised afterwards, when the world is where its last completed step has left it.
        """
        record, grown = self._world_record, ((0, 0, 0), 0)
        with deferred():
            try:
                while (status := entry(self._address)) != DONE:
                    where, need, tick = (int(record[name]) for name in ("where", "need", "tick"))
                    if status in (BAD_ACTION, OUTSIDE):
                        raise self._fail(status, where)
                    # Noise, percepts and sightings are pure: what was interrupted is begun again.
                    self._grow(status, where, need)
                    place = status, where, tick
                    grown = place, grown[1] + 1 if grown[0] == place else 1
                    if grown[1] > _MOST_GROWTH:
                        raise insatiable(self._data.groups[where])
            finally:
                self._read_back()
            if entry is RUN or entry is END_STEP:
                self._check_places()

    def _fail(self, status: int, where: int) -> ValueError:
        """Return what is to be raised when a step cannot be made; its decisions stand."""
        groups = self._data.groups
        for group in groups if status == OUTSIDE else groups[: where + 1]:
            group.has_decided = group.is_compiled
        self.is_bound = False
        return failure(self._data, status, where, int(self._world_record["tick"]))

    def _check_places(self) -> None:
        try:
            check_places(self._data)
        except ValueError:
            # So that no further step is made: whoever prepares one meets the same error.
            self.is_bound = False
            raise

    def _grow(self, status: int, where: int, need: int) -> None:
        """Make room and bind again, keeping what the loop has got to."""
        if status == GROW_RELATION:
            self.relations[where].grow(need)
            self._bind_relation(where)
        else:
            self._data.groups[where].perception.grow(need)
        self._bind_groups()
        self.experience.read_back()
        self.experience.bind(self._data.groups, self.relations)

    def _read_back(self) -> None:
        record = self._world_record
        self._data.timeline.set(int(record["tick"]))
        # 1 only when there was no room for sightings: the step is then completed by the next call.
        self._phase = int(record["phase"])
        if record["history"]:
            self._is_recorded = self._is_recorded or int(record["row"]) > self.stretch.rows
            self.stretch.rows = int(record["row"])
            self.stretch.sum_up()
        if self._every and record["trail"]:
            self.trails[-1].rows = int(record["trail_row"])
        self.experience.read_back()
