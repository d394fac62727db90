"""The engine: binds the arrays of a world for the compiled loop, makes its steps, and asks policies in Python."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import protected
from teamsight.agents.awareness.interface import perceive_entry, situate_entry
from teamsight.agents.channel import TEAMMATES, leave
from teamsight.agents.decisions import give_timetables, is_every_step
from teamsight.agents.engine import loop
from teamsight.agents.engine.binding import SHOW_COLUMNS, Binding, can_fail, has_bodies, move_entry
from teamsight.agents.engine.contacts import RECORD_BUMPS
from teamsight.agents.engine.detection import DETECT, KEEP_REPORTS, SHOW_LATE, delay_of, keeping_of
from teamsight.agents.engine.interactions import (
    BAD_HEADING,
    BAD_POSITION,
    BAD_REWARD,
    BAD_SCORE,
    BAD_SPEED,
    RAISED,
    entries_needed,
)
from teamsight.agents.engine.records import DONE, report
from teamsight.agents.engine.relation import Relation, needs_detection
from teamsight.agents.group import Group, sizes_of, team_of
from teamsight.agents.recording.history import Trail
from teamsight.agents.recording.transitions import RECORD_AFTER, RECORD_BEFORE, TransitionLogs
from teamsight.agents.resolve import check_channels, check_fit, put_rows, take_rows
from teamsight.agents.sensing.lidar import MEASURE
from teamsight.agents.sensing.sensor import BODIES, Sensor, sense_entry
from teamsight.agents.world_data import DECIDE
from teamsight.core import checks
from teamsight.core.elementary import atan2
from teamsight.core.interrupts import deferred
from teamsight.core.kernel import plain
from teamsight.core.kernel.report import REPORT
from teamsight.policies.actions import check_action, check_answer
from teamsight.policies.interface import Action, Percept, Policy, turned
from teamsight.policies.percept_of_one import PerceptOfOne, percept_of_group_of_one, percept_of_one, percept_of_rows
from teamsight.world.contact import contact_entry
from teamsight.world.motion import WRONG_DRIVE, is_watched
from teamsight.world.noise import Stream, generator, stream_number, uniforms
from teamsight.world.occlusion import GATHER_BODIES, gathering

if TYPE_CHECKING:
    from teamsight.agents.engine.records import Phase, Watcher
    from teamsight.agents.recording.history import Stretch
    from teamsight.agents.world_data import WorldData
    from teamsight.core.kernel import Entry
    from teamsight.policies.interface import Action

Key = npt.NDArray[np.uint64]
Integers = npt.NDArray[np.int64]
Rule = Callable[[PerceptOfOne, np.random.Generator], tuple[float, float]]


class Deliberation:
    """A decision of a group while it is being made.

    Parameters
    ----------
    group : Group
        The group that decides.
    tick : int
        The present tick.
    key : ndarray, shape (2,), uint64
        The key of the world's noise.
    noise : ndarray, shape (draws, n), float64, optional
        The group's random numbers for this tick, if they have been drawn.
    rows : ndarray, shape (k,), int64, optional
        The robots that decide, by ascending rows; by default all.

    Attributes
    ----------
    rows : ndarray, shape (k,), int64
        The robots that decide.
    """

    def __init__(
        self,
        group: Group,
        tick: int,
        key: Key,
        noise: npt.NDArray[np.float64] | None = None,
        rows: Integers | None = None,
    ) -> None:
        self.group, self.tick, self.key = group, tick, key
        self.rows = np.arange(len(group)) if rows is None else rows
        self._noise = noise
        self._percept: Percept | None = None
        self._given: dict[int, PerceptOfOne] = {}
        # The decisions of all deciding robots of a policy, by its index: each robot's place in them, and the decision.
        self._whole: dict[int, tuple[dict[int, int], Action, Any]] = {}
        # The rows that used a policy, each with its new state; None for that of such a decision.
        self._decided: dict[int, Any] = {}

    @property
    def percept(self) -> Percept:
        """What the whole group perceives, as arrays that cannot be written to."""
        if self._percept is None:
            self._percept = protected(self.group.perceived)
        return self._percept

    @property
    def noise(self) -> npt.NDArray[np.float64]:
        """The policy's random numbers, shape (draws, n)."""
        if self._noise is None:
            group = self.group
            stream = stream_number(Stream.POLICY, group.number)
            self._noise = uniforms(self.key, stream, self.tick, group.bodies.member, group.draws)
        return self._noise

    def decide(self) -> Action:
        """Return the action of the robots that decide."""
        group = self.group
        if group.decides_alone:
            name = f"{type(group._agents[0]).__name__}.decide" if group._agents else ""
            return self._of_each(self.rows, [group._agents[row].decide for row in self.rows], name)
        action = Action(np.zeros((len(self.rows), 2)), np.zeros(len(self.rows)))
        for index, policy in enumerate(group.policies):
            places = np.flatnonzero(self._choices == index)
            rows = self.rows[places]
            if not len(rows):
                continue
            if isinstance(policy, Policy):
                self._decided |= dict.fromkeys(rows.tolist())
                _, made, _ = self._decision_of_all(index)
            else:
                made = self._of_each(rows, [policy] * len(rows), _name(policy))
            action.heading[places], action.distance[places] = made
        return action

    def states(self) -> list[Any]:
        """Return the states of all policies after this decision."""
        group, size = self.group, len(self.group)
        states = group.states
        whole = [row for row, part in self._decided.items() if part is None]
        for index, (places, _, after) in self._whole.items():
            rows = np.array([row for row in whole if row in places], np.int64)
            if len(rows) == size:
                states[index] = after
            elif len(rows):
                kept = np.array([places[int(row)] for row in rows])
                states[index] = put_rows(states[index], rows, take_rows(after, kept, len(places)), size)
        for row, part in self._decided.items():
            if part is not None:
                index = self._choice(row)
                states[index] = put_rows(states[index], np.array([row]), part[0], size)
        return states

    def policy_decides(self, row: int, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn, distance) that a robot's policy decides on this percept.

        Policies that are callables for one robot are given `rng`.
        """
        group, index = self.group, self._choice(row)
        policy = group.policies[index]
        if not isinstance(policy, Policy):
            return check_answer(_name(policy), policy(percept, rng), row)
        if percept is self._given.get(row):
            # The usual case, an unchanged percept: one decision serves all that decide by this policy.
            places, action, _ = self._decision_of_all(index)
            self._decided[row] = None
            return _turn(percept.heading, action.heading[places[row]]), float(action.distance[places[row]])
        self._check_situation(row, percept)
        own, rows = percept_of_group_of_one(percept), np.array([row])
        before = take_rows(group.states[index], rows, len(group))
        action, after = _ask(policy, own, before, np.ascontiguousarray(self.noise[: policy.draws, rows]))
        self._decided[row] = (after,)
        return _turn(percept.heading, action.heading[0]), float(action.distance[0])

    @property
    def _choices(self) -> Integers:
        """The policy of each robot that decides, by its index."""
        table = self.group.timetable
        return np.zeros(len(self.rows), np.int64) if table is None else table.policy[self.rows]

    def _choice(self, row: int) -> int:
        table = self.group.timetable
        return 0 if table is None else int(table.policy[row])

    def _check_situation(self, row: int, percept: PerceptOfOne) -> None:
        """Refuse changed neighbour lists if the policy reads the situation, which was computed from the old ones."""
        given = self._given.get(row)
        if given is None or not self.group.inputs:
            return
        names = ("targets", "teammates", "relayed")
        changed = [name for name in names if getattr(percept, name) is not getattr(given, name)]
        if changed and percept.situation is given.situation:
            raise ValueError(
                f"percept.{changed[0]}: was changed, but {_name(self.group.policy)} reads percept.situation, which was "
                f"not; change both, as in percept._replace({changed[0]}=…, situation=…)"
            )

    def _decision_of_all(self, index: int) -> tuple[dict[int, int], Action, Any]:
        """Return the decision of all deciding robots of a policy; see `_whole`."""
        if index not in self._whole:
            group, size = self.group, len(self.group)
            rows = self.rows[self._choices == index]
            percept, state, policy = self.percept, group.states[index], group.policies[index]
            noise = self.noise[: policy.draws]
            if len(rows) < size:
                percept, state = protected(percept_of_rows(percept, rows)), take_rows(state, rows, size)
                noise = np.ascontiguousarray(noise[:, rows])
            action, after = _ask(policy, percept, state, noise)
            self._whole[index] = {row: place for place, row in enumerate(rows.tolist())}, action, after
        return self._whole[index]

    def _of_each(self, rows: Integers, rules: list[Rule], name: str) -> Action:
        group, percept = self.group, self.percept
        stream = stream_number(Stream.CALLABLE, group.number)
        self._given |= {int(row): percept_of_one(percept, row) for row in rows}
        answers = np.zeros((len(rows), 2))
        for place, (row, rule) in enumerate(zip(rows.tolist(), rules, strict=True)):
            rng = generator(self.key, stream, self.tick, int(group.bodies.member[row]))
            answers[place] = check_answer(name, rule(self._given[row], rng), row)
        return Action(turned(percept.heading[rows], answers[:, 0]), answers[:, 1])


class Carried:
    """Actions that the next step carries out, and the states that follow; a step that fails undoes both."""

    def __init__(self, deliberation: Deliberation) -> None:
        self._group, self._states = deliberation.group, deliberation.states()
        table = deliberation.group.timetable
        self._kept = table.kept() if table is not None else None

    def end(self, *, is_made: bool) -> None:
        """Set the new states if the step was made, else put the timetable back."""
        table = self._group.timetable
        if is_made:
            for index, state in enumerate(self._states):
                self._group.set_state(index, state)
        elif table is not None and self._kept is not None:
            table.put_back(self._kept)


def carry(deliberation: Deliberation, action: Action) -> Carried:
    """Write the actions of a group for the next step."""
    group, carried = deliberation.group, Carried(deliberation)
    heading, distance = group.action
    if group.due is not None and group.timetable is not None:
        heading, distance = group.due.chosen_heading, group.due.chosen_distance
    heading[deliberation.rows], distance[deliberation.rows] = action
    return carried


def due_rows(group: Group) -> Integers | None:
    """Return the rows of the robots that decide in this step; None for all."""
    if group.timetable is None or group.due is None:
        return None
    runs = group.due.runs[: group.due.number[0]]
    return np.concatenate([np.arange(0), *(np.arange(first, last) for first, last, _ in runs.tolist())])


def _ask(policy: Any, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> tuple[Action, Any]:
    name = _name(policy)
    try:
        answer = policy.decide(percept, state, noise)
    except ValueError as error:
        if "read-only" not in str(error):
            raise
        raise ValueError(f"{name}.decide writes into its percept ({error}); copy the array first") from error
    if not isinstance(answer, tuple) or isinstance(answer, Action) or len(answer) != 2:
        raise TypeError(f"{name}.decide returned {type(answer).__name__}; it must return (action, state)")
    action, after = answer
    check_action(name, action, len(percept.heading))
    return Action(*action), after


def _name(policy: Any) -> str:
    return str(getattr(policy, "__name__", type(policy).__name__))


def _turn(heading: npt.NDArray[np.float64], aim: npt.NDArray[np.float64]) -> float:
    """Return the angle from a heading to an aim [rad]; 0 for the aim (0, 0), which keeps the heading."""
    x, y = aim
    ahead, left = heading
    return plain(atan2)(y * ahead - x * left, x * ahead + y * left) if x or y else 0.0


def kernels_needed(data: WorldData, recorded: Sequence[Entry] = ()) -> Callable[[], list[Entry]]:
    """Return a function that lists the kernels for the steps of a world; it does not keep the world alive."""
    known = weakref.ref(data)

    def entries() -> list[Entry]:
        world = known()
        return _entries_of(world, recorded) if world is not None else []

    return entries


def _entries_of(data: WorldData, recorded: Sequence[Entry]) -> list[Entry]:
    groups = data.groups
    found = [loop.RUN, loop.SEARCH, loop.RECORD, loop.RECORD_PRESENT, *recorded]
    if data.solid:
        found += [contact_entry(data.contact, data.arena), RECORD_BUMPS]
    for group in groups:
        found += [move_entry(data, group), *_entries_of_group(group)]
        found += [relation.search.entry for relation in group.relations.values()]
        sensors = (channel.sensor or Sensor() for channel in group.channels.values())
        sensing = [sense_entry(sensor) for sensor in sensors if needs_detection(sensor, data.arena)]
        found += [DETECT, *sensing] if sensing else []
    has_lidar = any(group.lidar is not None for group in groups)
    if _bodies_block_sight(data) or (has_lidar and has_bodies(data)):
        found.append(GATHER_BODIES)
    if has_lidar:
        found.append(MEASURE)
    if any(delay_of(group) for group in groups):
        found.append(SHOW_LATE)
    if any(keeping_of(group, team_of(groups, group)) for group in groups):
        found.append(KEEP_REPORTS)
    if data.interactions:
        found += entries_needed(data.interactions)
        found += [one.interaction.entry(one.kinds) for one in data.interactions]
    if can_fail(data):
        found += [loop.COPY, loop.CALL_OWN]
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


def _is_users(part: object) -> bool:
    return not type(part).__module__.startswith("teamsight.")


def _endless(phase: str, of: Any) -> ValueError:
    """Return the exception for a degree of awareness or a sensor that asks for more room on every call."""
    if phase == "perceive":
        what, kernel, kind = f"awareness={of.awareness!r} of {of.name}", "perceive", "awareness"
    else:
        what, kernel, kind = _sensor_of(of), "sense", "sensor"
    return ValueError(f"{what}: {kernel} asks for more room on every call; check it with check_{kind}()")


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


def _bodies_block_sight(data: WorldData) -> bool:
    channels = (channel for group in data.groups for channel in group.channels.values())
    return any(channel.sensor is not None and channel.sensor.occluded == BODIES for channel in channels)


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
        if team := teams[group.number]:
            group.awareness.check_team(*sizes_of(team))
        check_channels(group, group.policy)
    relations: list[Relation] = []
    bodies = gathering([group.bodies for group in data.groups], data.arena) if _bodies_block_sight(data) else None
    for group in data.groups:
        if TEAMMATES in group.channels:
            group.channels[TEAMMATES].observed = teams[group.number]
        # First what is sensed, in the order of declarations, and then the team.
        channels = sorted(group.channels.values(), key=lambda channel: channel.name == TEAMMATES)
        group.relations = {channel.name: Relation(channel, group, data, bodies) for channel in channels}
        relations += group.relations.values()
    return relations


#: How often in one step a degree of awareness may ask for larger buffers; each time they grow by a quarter.
MOST_GROWTH = 8


# Work for about a quarter of a second.
_BODY_STEPS_A_CALL = 4_000_000


#: Called, if set, with the engine of a world of this thread before its kernels are made ready.
PREPARING: ContextVar[Callable[[Engine], object] | None] = ContextVar("preparing", default=None)


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
            if (show := PREPARING.get()) is not None:
                show(self)
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
        raise _endless("perceive", group)

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
        self._data.check_group(group, "record_transitions({})")
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
                        raise self._fail(phase, need, has_decided=phases is not binding.see)
                    self._grow(phase, need)
                    place = phase.name, phase.of, int(binding.progress["tick"][0])
                    grown = place, grown[1] + 1 if grown[0] == place else 1
                    if grown[1] > MOST_GROWTH:
                        raise _endless(phase.name, phase.of)
            finally:
                self._read_back()
            if phases is binding.run:
                report(binding)
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
        elif phase.name == "contact":
            phase.of.grow(need)
        else:
            phase.of.grow(need, detection=phase.name == "detect")
            self._binding.rebind(self.relations.index(phase.of))

    def _stopped(self, phases: list[Phase]) -> tuple[Phase, int] | None:
        """Carry out phases; return the one that has stopped, and what it returned, if one has."""
        for phase in phases:
            if (status := phase.entry(phase.record)) != DONE:
                if phases is self._binding.run:
                    phase = self._binding.phases[self._binding.progress["halted"][0]]
                return phase, status
        return None

    def _fail(self, phase: Phase, status: int, *, has_decided: bool) -> ValueError:
        """Return the exception for a step that cannot be made; the decided actions are kept, and carried out next.

        A move before a sensor that failed has been undone.
        """
        self.is_bound = False
        data, tick = self._data, int(self._binding.progress["tick"][0])
        # Groups after one with an action that cannot be carried out have not decided.
        for group in data.groups[: phase.of.number + 1] if phase.name == "decide" else data.groups:
            group.has_decided = has_decided and group.is_compiled
        if phase.name == "interact":
            return bad_interaction(data, phase)
        if status == loop.RAISED:
            parts = data.arena, data.contact, *(group.drive for group in data.groups)
            own = " or ".join(type(part).__name__ for part in parts if _is_users(part))
            return ValueError(
                f"{own}: a kernel raised an exception at tick {tick}, which is printed above; check it with "
                "check_drive(), check_contact() or check_arena(). To continue, restore() a state or reset()"
            )
        if phase.name == "contact":
            return ValueError(
                f"contact={type(data.contact).__name__}: meet returned a way that is not finite, or a heading that is "
                f"no unit vector, at tick {tick}; check it with check_contact(). To continue, restore() a state or "
                "reset()"
            )
        if phase.name == "detect":
            observed = len(phase.of.everyone)
            return ValueError(
                f"{_sensor_of(phase.of)}: sense has written a wrong list for tick {int(data.moment[0])}: `start` must "
                f"ascend from 0 to at most the number returned, indices lie in {-observed} … {observed - 1}, and "
                "offsets and distances finite; check the sensor with check_sensor(). To continue, set another one"
            )
        if phase.name == "decide":
            return ValueError(
                f"{type(phase.of.policy).__name__}: an action of {phase.of.name} at tick {tick} is not finite, or its "
                "heading is not a unit vector; check the policy with check_policy(), and a degree of awareness of your "
                "own with check_awareness(). To continue, give the group another policy, restore() a state or reset()"
            )
        if status <= -WRONG_DRIVE:
            return ValueError(
                f"drive={type(phase.of.drive).__name__}: carry returned for an agent of {phase.of.name} at tick {tick} "
                "a way that is not finite or longer than its speed, or no turn; check it with check_drive(). To "
                "continue, restore() a state or reset()"
            )
        return ValueError(
            f"{data.arena}: confine left an agent of {phase.of.name} outside at tick {tick}; check the arena with "
            "check_arena()"
        )

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
