"""The engine: binds the arrays of a world for the compiled loop, and makes its steps by calls of the loop."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.agents.awareness.interface import perceive_entry, situate_entry
from teamsight.agents.channel import TEAMMATES, leave
from teamsight.agents.decisions import give_timetables, is_every_step
from teamsight.agents.engine import loop
from teamsight.agents.engine.binding import SHOW_COLUMNS, Binding, can_fail
from teamsight.agents.engine.detection import DETECT, SHOW_LATE, delay_of
from teamsight.agents.engine.interactions import (
    BAD_HEADING,
    BAD_POSITION,
    BAD_REWARD,
    BAD_SCORE,
    BAD_SPEED,
    BEGIN,
    INTERACT,
    NOTE_MOVED,
    RAISED,
    RECORD_SCORES,
)
from teamsight.agents.engine.python_policies import Deliberation, carry, due_rows
from teamsight.agents.engine.records import DONE
from teamsight.agents.engine.relation import Relation, needs_detection
from teamsight.agents.engine.watching import report
from teamsight.agents.events.timeline import DECIDE
from teamsight.agents.group import Group, team_of
from teamsight.agents.recording.history import Trail
from teamsight.agents.recording.transitions import RECORD_AFTER, RECORD_BEFORE, TransitionLogs
from teamsight.agents.resolve import check_channels, check_fit
from teamsight.agents.sensing.sensor import Sensor, sense_entry
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.kernel.report import REPORT
from teamsight.world.motion import advance_entry, is_watched

if TYPE_CHECKING:
    from teamsight.agents.engine.records import Phase
    from teamsight.agents.engine.watching import Watcher
    from teamsight.agents.recording.history import Stretch
    from teamsight.agents.world_data import WorldData
    from teamsight.core.kernel import Entry
    from teamsight.policies.interface import Action


def kernels_needed(data: WorldData, recorded: Sequence[Entry] = ()) -> Callable[[], list[Entry]]:
    """Return a function that lists the kernels for the steps of a world; it does not keep the world alive."""
    known = weakref.ref(data)

    def entries() -> list[Entry]:
        world = known()
        return _entries_of(world, recorded) if world is not None else []

    return entries


def _entries_of(data: WorldData, recorded: Sequence[Entry]) -> list[Entry]:
    groups = data.groups
    found = [loop.RUN, loop.SEARCH, loop.RECORD, loop.RECORD_PRESENT, advance_entry(data.arena), *recorded]
    for group in groups:
        found += _entries_of_group(group)
        found += [relation.search.entry for relation in group.relations.values()]
        sensors = (channel.sensor or Sensor() for channel in group.channels.values())
        sensing = [sense_entry(sensor) for sensor in sensors if needs_detection(sensor, data.arena)]
        found += [DETECT, *sensing] if sensing else []
    if any(delay_of(group) for group in groups):
        found.append(SHOW_LATE)
    if data.interactions:
        found += [BEGIN, NOTE_MOVED, INTERACT, RECORD_SCORES]
        found += [one.interaction.entry(one.kinds) for one in data.interactions]
    if can_fail(data):
        found.append(loop.COPY)
    if any(group.perceived_columns for group in groups):
        found.append(SHOW_COLUMNS)
    if data.watchers:
        found += [loop.WATCH, *(watcher.entry for watcher in data.watchers)]
    return list(dict.fromkeys(found))


def _entries_of_group(group: Group) -> list[Entry]:
    """Return the kernels of a policy and a degree of awareness."""
    entries = [loop.PERCEIVE]
    if group.needs_timetable or not group.is_sound:
        entries.append(loop.DECIDE_DUE if group.needs_timetable else loop.DECIDE)
    if group.is_compiled:
        entries += [policy.entry() for policy in group.policies]
    if group.reads_teammates and (perceive := perceive_entry(group.awareness)) is not None:
        entries.append(perceive)
    if group.inputs:
        entries.append(situate_entry(group.awareness))
    return entries


def bad_action(group: Group, tick: int) -> ValueError:
    """Return the exception for an action that cannot be carried out."""
    return ValueError(
        f"{type(group.policy).__name__}: an action of {group.name} at tick {tick} is not finite, or its heading is not "
        "a unit vector; check the policy with check_policy(), and a degree of awareness of your own with "
        "check_awareness(). To continue, give the group another policy, restore() a state or reset()"
    )


def outside(data: WorldData, group: Group, tick: int) -> ValueError:
    """Return the exception for an arena that an agent has left."""
    return ValueError(
        f"{data.arena}: confine left an agent of {group.name} outside at tick {tick}; check the arena with "
        "check_arena()"
    )


def endless_growth(group: Group) -> ValueError:
    """Return the exception for a degree of awareness that asks for more room on every call."""
    return ValueError(
        f"awareness={group.awareness!r}: perceive asks for more room on every call, for {group.name}; check the degree "
        "with check_awareness()"
    )


def endless_sensor(relation: Relation) -> ValueError:
    """Return the exception for a sensor that asks for more room on every call."""
    return ValueError(
        f"{_sensor_of(relation)}: sense asks for more room on every call; check the sensor with check_sensor()"
    )


def bad_sensing(relation: Relation, tick: int) -> ValueError:
    """Return the exception for a sensor whose list cannot be read."""
    observed = len(relation.everyone)
    return ValueError(
        f"{_sensor_of(relation)}: sense has written a wrong list for tick {tick}: `start` must ascend from 0 to at "
        f"most the number returned, indices lie in {-observed} … {observed - 1}, and offsets and distances finite; "
        "check the sensor with check_sensor(). To continue, set another one"
    )


def _sensor_of(relation: Relation) -> str:
    group = relation.observers
    return f"sensors[{relation.name!r}]={group.channels[relation.name].sensor!r} of {group.name}"


def bad_interaction(data: WorldData, phase: Phase) -> ValueError:
    """Return the exception for an interaction that has left something wrong."""
    placed, turn = phase.of, phase.record.value
    progress, found = turn.progress[0], turn.interaction.value.found
    x, y = found.tolist()
    cure = "check the interaction with check_interaction(). To continue, restore() a state or reset()"
    if progress["what"] == RAISED:
        return ValueError(
            f"{placed.name}: its kernel raised an exception at tick {int(progress['tick'])}, which is printed above; "
            f"{cure}"
        )
    if progress["what"] == BAD_SCORE:
        score = placed.interaction.scores[int(progress["where"])]
        return ValueError(f"{placed.name}: the score {score!r} is {x:g}; scores must be finite; {cure}")
    role = placed.interaction.roles[int(progress["where"])]
    wrong = {
        BAD_POSITION: f"at ({x:g}, {y:g}), which is outside {data.arena}; write positions inside the arena only",
        BAD_HEADING: f"with the heading ({x:g}, {y:g}); headings must be unit vectors",
        BAD_SPEED: f"with the speed {x:g}; speeds must be finite and at least 0",
        BAD_REWARD: f"with the reward {x:g}; rewards must be finite",
    }[int(progress["what"])]
    agent = placed.roles[role]._agents[int(progress["body"])]
    return ValueError(f"{placed.name}: its kernel left {agent!r} at tick {int(progress['tick'])} {wrong}; {cure}")


def check_places(data: WorldData) -> None:
    """Raise if an agent is outside a user-defined arena; others are not checked.

    Raises
    ------
    ValueError
        Naming the group and the position.
    """
    arena = data.arena
    if not is_watched(arena):
        return
    for group in data.groups:
        inside = np.asarray(arena.contains(group.bodies.position))
        if not inside.all():
            place = tuple(group.bodies.position[int(np.argmin(inside))].tolist())
            raise ValueError(
                f"{arena}: an agent of {group.name} is at {place}, which is outside according to contains(); check "
                "confine and place() of the arena with check_arena()"
            )


def connect(data: WorldData) -> list[Relation]:
    """Return the relations of a world, and set those of each group.

    Raises
    ------
    ValueError
        If an agent is outside the arena, or a policy needs what its group does not perceive. No group is changed then.
    """
    check_places(data)
    teams = {group.number: team_of(data.groups, group) for group in data.groups}
    for group in data.groups:
        check_fit(group, teams[group.number])
        check_channels(group, group.policy)
    relations: list[Relation] = []
    for group in data.groups:
        if TEAMMATES in group.channels:
            group.channels[TEAMMATES].observed = teams[group.number]
        # First what is sensed, in the order of declarations, and then the team.
        channels = sorted(group.channels.values(), key=lambda channel: channel.name == TEAMMATES)
        group.relations = {channel.name: Relation(channel, group, data) for channel in channels}
        relations += group.relations.values()
    return relations


#: How often in one step a degree of awareness may ask for larger buffers; each time they grow by a quarter.
MOST_GROWTH = 8


# Work for about a quarter of a second.
_BODY_STEPS_A_CALL = 4_000_000


class Engine:
    """Runs a world in compiled code, step by step or many steps in one call.

    Attributes
    ----------
    is_bound : bool
        Whether the records describe the groups as they are.
    is_seen : bool
        Whether the neighbour lists are those of the present positions.
    fits : int
        How often the records have followed a change of the number of agents.
    searches : int
        The number of neighbour searches between steps.
    stretch : Stretch
        The history of the steps since groups last changed.
    trails : list of Trail
        The recorded positions.
    transitions : TransitionLogs
        The recorded transitions.
    deliberations : dict of Group to Deliberation
        During a step: the decisions of the groups with Python policies.
    """

    def __init__(self, data: WorldData) -> None:
        self._data = data
        self._every = 0
        # Whether bodies have moved in a step for which there was no room; the next call completes it.
        self._has_moved = False
        self.relations: list[Relation] = []
        self.is_bound = self._is_recorded = False
        self._binding: Binding
        self.trails: list[Trail] = []
        self.transitions = TransitionLogs()
        self.stretch: Stretch = data.history.begin([])
        self.is_seen = False
        # Whether the watchers have seen the present positions, and whether the records hold those that there are.
        self._is_watched, self._has_watchers = False, True
        self.searches = self.fits = 0
        self.deliberations: dict[Group, Deliberation] = {}

    def leave_out(self, group: Group) -> None:
        """Forget a group that could not be added."""
        for other in self._data.groups:
            leave(other.channels, group)
        self.transitions.groups = [other for other in self.transitions.groups if other is not group]
        self.is_bound = False

    def _plan(self) -> None:
        """Let the report of compilations know which kernels are needed."""
        recorded = [loop.LEAVE_TRAIL] * bool(self._every)
        recorded += [RECORD_BEFORE, RECORD_AFTER] * bool(self.transitions.groups)
        REPORT.plan(kernels_needed(self._data, recorded))

    def prepare(self) -> None:
        """Prepare a step: bind the records and search for neighbours, where either is out of date."""
        if not self.is_bound:
            with deferred():
                self.relations = connect(self._data)
                give_timetables(self._data)
                self.stretch = self._data.history.begin(
                    self.relations, self._data.score_names, is_open=self._data.is_open
                )
                trail = None
                if self._every:
                    trail = Trail(self._data.groups, self._every, self._data.timeline.tick)
                    self.trails.append(trail)
                partakers = [group for one in self._data.interactions for group in one.groups]
                self.transitions.begin(self._data.groups, partakers)
                self._plan()
                self._binding = Binding(self._data, self.relations, self.stretch, trail, self.transitions.in_use)
                self._binding.progress["phase"] = self._binding.searching if self._has_moved else 0
                self.is_bound, self.is_seen, self._has_watchers = True, False, True
        if not self._has_watchers:
            self._plan()
            self._binding.rebind_watchers()
            self._has_watchers = True
        if self.is_seen:
            return
        self._data.moment[0] = self._data.timeline.tick + self._has_moved
        self._call(self._binding.see)
        self.is_seen, self._is_recorded, self._is_watched = True, False, False
        self.searches += 1

    def watch(self, watcher: Watcher) -> None:
        """Call a watcher after each step, from now on."""
        self._data.watchers.append(watcher)
        self._is_watched = False
        self.rewatch()

    def unwatch(self, watcher: Watcher) -> None:
        """Call a watcher no longer."""
        self._data.watchers[:] = [other for other in self._data.watchers if other is not watcher]
        self.rewatch()

    def rewatch(self) -> None:
        """Bind the watchers again before the next step."""
        self._has_watchers = False

    def look(self) -> bool:
        """Let the watchers see what has changed between steps; return whether one of them has something to report."""
        if not self._data.watchers:
            return False
        for watcher in list(self._data.watchers):
            watcher.tidy()
        if not any(watcher.sees_changes for watcher in self._data.watchers):
            return False
        self.prepare()
        if self._is_watched:
            return False
        with deferred():
            self._is_watched = True
            self._call(self._binding.look)
            return report(self._binding)

    def perceive(self, group: Group) -> None:
        """Update the percept of a group to the present positions."""
        self.prepare()
        if group.timetable is not None:
            group.timetable.travel(self._data.timeline.tick)
        self._binding.show_columns()
        for _ in range(MOST_GROWTH):
            if group.perception.perceive(group.awareness):
                return
            self._binding.rebind()
        raise endless_growth(group)

    def run(self, steps: int) -> None:
        """Make at most `steps` steps in one compiled call; all policies have kernels.

        If the last step failed, only that step is made again, with the actions already decided.
        """
        resumed = any(group.has_decided for group in self._data.groups)
        if resumed:
            steps = 1
        self._make_room(steps)
        self._binding.progress["steps"] = steps
        self._call(self._binding.run)
        if resumed:
            self._decide_again()

    def step(self) -> None:
        """Make one step in which a policy is Python."""
        data = self._data
        self._make_room(1)
        if self._has_moved:
            self._end_step()
            return
        self._call(self._binding.begin)
        deciding = [group for group in data.groups if not group.is_compiled]
        try:
            actions = self._decide(deciding)
            with deferred():
                carried = [carry(self.deliberations[group], one) for group, one in zip(deciding, actions, strict=True)]
                tick = data.timeline.tick
                try:
                    self._binding.progress["phase"] = self._binding.deciding
                    self._end_step()
                finally:
                    is_made = data.timeline.tick > tick or self._has_moved
                    for one in carried:
                        one.end(is_made=is_made)
        finally:
            self.deliberations = {}
        self._decide_again()

    def _end_step(self) -> None:
        self._binding.progress["steps"] = 1
        self._call(self._binding.run)

    def _decide(self, groups: list[Group]) -> list[Action]:
        """Return the actions of the groups with Python policies."""
        tick, key = self._data.timeline.tick, self._data.key
        self.deliberations = {
            group: Deliberation(group, tick, key, group.noise(tick), due_rows(group)) for group in groups
        }
        with self._data.timeline.calling(DECIDE):
            return [deliberation.decide() for deliberation in self.deliberations.values()]

    def _decide_again(self) -> None:
        """Let all kernels decide again in the next step, once the actions of a failed step were carried out."""
        for group in self._data.groups:
            if group.has_decided:
                group.has_decided = False
                self.is_bound = False
                if group.timetable is not None:
                    group.timetable.go_on(self._data.key, self._data.timeline.tick - 1)

    @property
    def longest_call(self) -> int:
        """The number of steps per call: enough to make calls cheap, few enough to respond to Ctrl-C."""
        return max(_BODY_STEPS_A_CALL // max(sum(map(len, self._data.groups)), 1), 1)

    def record_positions(self, every: int) -> None:
        """Record positions each `every` steps, from now on."""
        self._every = every
        self.is_bound = False

    def record_transitions(self, group: Group) -> None:
        """Record the transitions of a group, from now on."""
        if group not in self._data.groups:
            raise ValueError(f"record_transitions({checks.shown(group)}): the group must have been added to this world")
        if not is_every_step(group):
            raise ValueError(
                f"record_transitions({group.name}): takes a decision of each robot at every step, and their cycle is "
                f"{checks.shown(group.cycle)}; set {group.name}.cycle = Cycle()"
            )
        if group not in self.transitions.groups:
            self.transitions.groups.append(group)
            self.is_bound = False

    def resize(self, group: Group, *, is_moved: bool = False) -> None:
        """Adapt to agents that came to a group or left it; `is_moved` says whether columns of its table were moved."""
        data = self._data
        if self.is_bound and not is_moved and self._binding.follow(group):
            self.is_seen, self.fits = False, self.fits + 1
            if data.watchers:
                self.rewatch()
        else:
            group.begin(has_decided=group.has_decided)
            self.is_bound = False
        data.is_open = True

    def forget(self, *, is_kept: bool = False) -> None:
        """Start all recording anew; if the arrays are kept, the records are still valid."""
        # Binding begins trails and logs, so with either it is done again.
        self.is_bound = self.is_bound and is_kept and not (self._every or self.transitions.groups)
        self.is_seen = self._is_recorded = False
        self._has_moved = False
        if self.is_bound:
            self._binding.rewind()
            self._has_watchers = not self._data.watchers
            self.stretch = self._data.history.begin_like(self.stretch)
            return
        self.trails = []
        self.transitions.forget()
        self.stretch = self._data.history.begin([])

    @property
    def extras(self) -> tuple[Any, int, bool]:
        """The channels of all groups, and what is recorded; `ReusedWorlds` compares them."""
        channels = [channel for group in self._data.groups for channel in group.channels.values()]
        declared = tuple((channel.name, len(channel.observed), channel.sensor) for channel in channels)
        return declared, self._every, bool(self.transitions.groups)

    def adapt(self) -> None:
        """Adapt to a new arena size and new ranges, which have been written into the arrays."""
        # The width of cells is the range.
        if any(relation.search.has_cells for relation in self.relations):
            self.is_bound = False

    def present(self, name: str) -> float:
        """Return `observed` or `mean_degree` for the present positions."""
        self.prepare()
        return self.stretch.reading(name, self._is_recorded)

    def _make_room(self, steps: int) -> None:
        stretch, trail = self.stretch, self.trails[-1] if self._every else None
        is_moved = stretch.steps.make_room(steps, most_spare=None) or stretch is not self._binding.stretch
        if trail:
            is_moved = trail.kept.make_room(steps // self._every + 1, most_spare=None) or is_moved
        if is_moved:
            self._binding.record_into(stretch, trail)
        if self.transitions.make_room(steps):
            self._binding.rebind_logs()

    def _call(self, phases: list[Phase]) -> None:
        """Carry out phases, enlarging the buffers that are full.

        Ctrl-C is raised afterwards, so that no step is left incomplete.
        """
        binding, grown = self._binding, (("", None, 0), 0)
        with deferred():
            try:
                while stopped := self._stopped(phases):
                    phase, need = stopped
                    if need < 0:
                        raise self._fail(phase, has_decided=phases is not binding.see)
                    self._grow(phase, need)
                    place = phase.name, phase.of, int(binding.progress["tick"][0])
                    grown = place, grown[1] + 1 if grown[0] == place else 1
                    if grown[1] > MOST_GROWTH:
                        raise endless_growth(phase.of) if phase.name == "perceive" else endless_sensor(phase.of)
            finally:
                self._read_back()
            if phases is binding.run:
                report(binding)
                self._check_places()

    def _stopped(self, phases: list[Phase]) -> tuple[Phase, int] | None:
        """Carry out phases; return the one that has stopped, and what it returned, if one has."""
        for phase in phases:
            if (status := phase.entry(phase.record)) != DONE:
                if phases is self._binding.run:
                    phase = self._binding.phases[self._binding.progress["halted"][0]]
                return phase, status
        return None

    def _fail(self, phase: Phase, *, has_decided: bool) -> ValueError:
        """Return the exception for a step that cannot be made; the decided actions are kept, and carried out next.

        A move before a sensor that failed has been undone.
        """
        self.is_bound = False
        data, tick = self._data, int(self._binding.progress["tick"][0])
        # Groups after one with an action that cannot be carried out have not decided.
        for group in data.groups[: phase.of.number + 1] if phase.name == "decide" else data.groups:
            group.has_decided = has_decided and group.is_compiled
        if phase.name == "detect":
            return bad_sensing(phase.of, int(data.moment[0]))
        if phase.name == "interact":
            return bad_interaction(data, phase)
        return bad_action(phase.of, tick) if phase.name == "decide" else outside(data, phase.of, tick)

    def _check_places(self) -> None:
        try:
            check_places(self._data)
        except ValueError:
            # The next `prepare` raises the same error, so no further step is made.
            self.is_bound = False
            raise

    def _grow(self, phase: Phase, need: int) -> None:
        """Enlarge a buffer and bind it; the loop continues where it stopped."""
        if phase.name == "perceive":
            phase.of.perception.grow(need)
            self._binding.rebind()
        else:
            phase.of.grow(need, detection=phase.name == "detect")
            self._binding.rebind(self.relations.index(phase.of))

    def _read_back(self) -> None:
        tick, _, phase, row, trail_row, *_ = self._binding.state.tolist()
        self._data.timeline.set(tick)
        self._data.time[0] = tick
        self._has_moved = phase > 0
        steps = self.stretch.steps
        if row > len(steps):
            self._is_recorded = True
            steps.count(row)
        if self._every:
            self.trails[-1].kept.count(trail_row)
