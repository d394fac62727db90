"""Binding: how a world is laid out in memory for the compiled loop. Read this file before the loop.

Records hold the addresses of arrays; `teamsight.agents.engine.records` defines their fields. This module fills them,
from the world down: the columns that policies read, groups (noise → percept → decision → motion), the neighbour
searches, the transition logs. Arrays can then be rewritten in place; after replacing one, bind again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import accumulate
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import (
    SENSING,
    TEAM_GROUP,
    Scene,
    Sensing,
    TeamGroup,
    perceive_entry,
    situate_entry,
)
from teamsight.agents.channel import TARGETS
from teamsight.agents.engine import loop
from teamsight.agents.engine.contacts import RECORD_BUMPS, BoundContacts
from teamsight.agents.engine.detection import (
    DETECT,
    KEEP_REPORTS,
    REPORTS,
    SHOW_LATE,
    Keeping,
    ReportsArrays,
    delay_of,
    forget_reports,
    is_checked,
    keeping_of,
    relays_of,
    reports_of,
)
from teamsight.agents.engine.due import bind_due, follow_due
from teamsight.agents.engine.interactions import BEGIN, RECORD_SCORES, BoundInteractions
from teamsight.agents.engine.records import (
    COPYING,
    GROUP,
    LOG,
    PROGRESS,
    RELATION,
    TRAIL,
    WATCHING,
    WORLD,
    Bound,
    CopyingArrays,
    GroupArrays,
    LogArrays,
    Phase,
    RelationArrays,
    TrailArrays,
    WatchingArrays,
    WorldArrays,
)
from teamsight.agents.engine.relation import counted_groups
from teamsight.agents.group import team_of
from teamsight.agents.recording.transitions import RECORD_AFTER, RECORD_BEFORE
from teamsight.agents.sensing.lidar import MEASURE, bound_lidar
from teamsight.core.contracts import is_own
from teamsight.core.kernel import Entry, Packed, Record, array_at
from teamsight.core.kernel.record import address_of
from teamsight.policies.channels import OF_BODIES
from teamsight.policies.compiled import pack_decision
from teamsight.policies.interface import Policy, PolicyState
from teamsight.policies.registry import label
from teamsight.world.limits import farthest_of
from teamsight.world.motion import advance_entry, intend_entry, is_watched, pack_move
from teamsight.world.noise import LANES, Stream, stream_number
from teamsight.world.occlusion import GATHER_BODIES, gathering
from teamsight.world.search import FAR_AWAY

if TYPE_CHECKING:
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.group import Group
    from teamsight.agents.recording.history import Stretch, Trail
    from teamsight.agents.recording.transitions import TransitionLog
    from teamsight.agents.world_data import WorldData
    from teamsight.policies.compiled import CompiledPolicy, Decision
    from teamsight.policies.interface import Action


Array = npt.NDArray[Any]
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_KINDS = {np.dtype(np.float64): 0, np.dtype(np.int64): 1, np.dtype(np.bool_): 2}


class SourceArrays(NamedTuple):
    """Where the values of a group's agents are: a column, or a field of the state of a policy.

    Attributes
    ----------
    values : int
        The address of that of the first agent.
    stride : int
        The number of elements from one agent to the next.
    kind : int
        0 for float64, 1 for int64, 2 for bool.
    row : int
        The row of `PerceivedArrays.values`.
    identity : ndarray, shape (n,), int64
        The agents.
    policy : int
        The index of the policy that shows it; −1 for a column.
    choice : ndarray, shape (n,) or (0,), int64
        The policy of each agent; empty if all have the first.
    """

    values: int
    stride: int
    kind: int
    row: int
    identity: Annotated[Integers, "n"]
    policy: int
    choice: Annotated[Integers, "choices"]


SOURCE = Record(SourceArrays)
source_at = SOURCE.at


class PerceivedArrays(NamedTuple):
    """The record of all columns that policies read: values by identity, and where they come from."""

    values: Annotated[npt.NDArray[np.float64], "columns", "identities"]
    sources: list[Packed[SourceArrays]]


PERCEIVED = Record(PerceivedArrays)
perceived_at = PERCEIVED.at


def _show(address: int) -> int:
    here = perceived_at(address)
    here.values[:] = np.nan
    for number in range(here.sources.shape[0]):
        source = source_at(here.sources[number])
        size = source.identity.shape[0]
        elements = size * source.stride
        for i in range(size):
            if source.policy >= 0 and source.policy != (source.choice[i] if source.choice.shape[0] > 0 else 0):
                continue
            at = i * source.stride
            if source.kind == 0:
                value = array_at(source.values, elements, np.float64)[at]
            elif source.kind == 1:
                value = np.float64(array_at(source.values, elements, np.int64)[at])
            else:
                value = np.float64(array_at(source.values, elements, np.bool_)[at])
            here.values[source.row, source.identity[i]] = value
    return 0


SHOW_COLUMNS = Entry(_show)


class Found(NamedTuple):
    """A column, or what a policy shows; `array` has a row for each agent, and its last part are the values."""

    name: str
    array: Array
    offset: int
    policy: int


def bind_columns(groups: list[Group]) -> tuple[Packed[PerceivedArrays] | None, list[Array]]:
    """Bind the columns that the policies of these groups read, and show them in the groups' percepts.

    Returns
    -------
    Packed of PerceivedArrays, or None
        The argument of `SHOW_COLUMNS`; None if no policy reads any.
    list of ndarray
        The arrays whose addresses it holds.

    Raises
    ------
    ValueError
        If a policy reads a column that no group has.
    """
    found = {group.number: list(_of_group(group)) for group in groups}
    have = list(dict.fromkeys(one.name for of_group in found.values() for one in of_group))
    read = {group.number: _read_by(group, have) for group in groups}
    names = list(dict.fromkeys(name for of_group in read.values() for name in of_group))
    for group in groups:
        own = {one.name for one in found[group.number]}
        found[group.number] += [
            Found(name, group.bodies[column], part, -1)
            for name, (column, part) in OF_BODIES.items() if name in names and name not in own
        ]  # fmt: skip
    if not names:
        for group in groups:
            group.perceived_columns = {}
        return None, []
    most = max(int(group.bodies.identity.max(initial=0)) for group in groups)
    values = np.full((len(names), most + 1), np.nan)
    for group in groups:
        group.perceived_columns = {name: values[names.index(name)] for name in read[group.number]}
    sources = [
        _source(group, one, names.index(one.name))
        for group in groups for one in found[group.number] if one.name in names
    ]  # fmt: skip
    kept = [one.array for of_group in found.values() for one in of_group]
    return PERCEIVED.pack(PerceivedArrays(values, sources)), kept


def _read_by(group: Group, have: Iterable[str]) -> list[str]:
    """Return the columns that the policies of a group read; a function of one robot reads all that users have added."""
    names: list[str] = []
    for policy in group.policies:
        if not isinstance(policy, Policy):
            names += have
            continue
        for name in policy.columns:
            if name not in have and name not in OF_BODIES:
                raise ValueError(
                    f"policy={label(policy)}: reads the column {name!r}, which no group has as one number for each "
                    f"agent, and no policy shows; add it: group.add_column({name!r}), or world.interact(…) with an "
                    f"interaction that keeps it. All agents have {', '.join(OF_BODIES)}"
                )
            names.append(name)
    return list(dict.fromkeys(names))


def _of_group(group: Group) -> Iterator[Found]:
    """Yield all that others can perceive of the agents of a group."""
    for name, array in group.columns.arrays().items():
        if array.ndim == 1 and array.dtype in _KINDS:
            yield Found(name, array, 0, -1)
    for number, name in enumerate(group.drive.state):
        shown = [one for policy in group.policies if isinstance(policy, Policy) for one in policy.shows]
        if name in (*group.columns, *OF_BODIES, *shown):
            raise ValueError(
                f"drive={group.drive}: keeps {name!r}, a column of {group.name!r}, or one that a policy shows, too; "
                "rename one"
            )
        yield Found(name, group.bodies.drive, number, -1)
    for index, (policy, state) in enumerate(zip(group.policies, group.states, strict=True)):
        if isinstance(policy, Policy) and policy.shows and isinstance(state, PolicyState):
            for field, name in enumerate(policy.shows):
                if name in group.columns:
                    raise ValueError(
                        f"policy={label(policy)}: shows {name!r}, which is a column of {group.name!r} too; rename one"
                    )
                yield Found(name, state.floats, field, index)


def _source(group: Group, found: Found, row: int) -> Packed[SourceArrays]:
    array, table = found.array, group.timetable
    choice = np.zeros(0, np.int64) if table is None else table.policy
    stride = int(np.prod(array.shape[1:]))
    address = address_of(array) + found.offset * array.itemsize
    return SOURCE.pack(SourceArrays(
        address, stride, _KINDS[array.dtype], row, group.bodies.identity, found.policy, choice
    ))  # fmt: skip


class Binding:
    """The records of a world.

    Attributes
    ----------
    world : Packed of WorldArrays
        The argument of the loop.
    progress : ndarray of `PROGRESS`, shape (1,)
        The state of the loop.
    state : ndarray, shape (k,), int64
        The same, element by element.
    stretch : Stretch
        The history into which steps are recorded.
    watching : Packed of WatchingArrays
        What watchers have returned.
    watchers : list of Watcher
        Those that the loop calls, in the order of their rows.
    phases : list of Phase
        A step. It can begin anew at the index `deciding`, if percepts are shown; and at `searching`, if bodies have
        moved.
    run, begin, see, look : list of Phase
        What makes steps; what shows percepts, which a step begins with; what searches for neighbours between steps; and
        what lets the watchers see what has changed since.
    """

    def __init__(
        self,
        data: WorldData,
        relations: list[Relation],
        stretch: Stretch,
        trail: Trail | None,
        logs: list[TransitionLog],
    ) -> None:
        self._data, self._relations, self._logs, self.stretch = data, relations, logs, stretch
        groups = data.groups
        self._is_open, self._room_of = data.is_open, [group.bodies.room for group in groups]
        rows = sum(self._room_of)
        self.progress = np.zeros(1, PROGRESS)
        self.state = self.progress.view(np.int64)
        self.progress["tick"] = data.timeline.tick
        self._met = {_side(relation): np.zeros(rows, np.int64) for relation in relations}
        self._body_rows = [
            np.zeros(sum(group.bodies.room for group in relation.observed), np.int64) for relation in relations
        ]
        self._number_bodies()
        # Listed when they are first needed.
        self._sizes: Sizes | Literal[False] | None = None
        self._relays = relays_of(groups, data.moment)
        lidars = [group for group in groups if group.lidar is not None]
        self._bodies = next((relation.bodies for relation in relations if relation.bodies is not None), None)
        if self._bodies is None and lidars and has_bodies(data):
            self._bodies = gathering([group.bodies for group in groups], data.arena)
        opaque = self._bodies.value.opaque if self._bodies else None
        self._lidars = [(group, bound_lidar(group, data, opaque if has_bodies(data) else None)) for group in lidars]
        self._reports: dict[tuple[int, Keeping], Packed[ReportsArrays]] = {}
        self._columns, self._shown_arrays = bind_columns(groups)
        self._group_records = [GROUP.pack(value) for value in self._groups()]
        self._relation_records = [RELATION.pack(self._relation(relation)) for relation in relations]
        self._log_records = [LOG.pack(self._log(log)) for log in logs]
        self._interactions = None
        if data.interactions:
            scores = stretch.steps.whole("scores")
            self._interactions = BoundInteractions(data, self._group_records, self.progress, scores)
        self._solid = None
        if data.solid:
            self._solid = BoundContacts(data, self.progress, stretch.steps.whole("scores"))
        written: list[Array] = []
        if can_fail(data):
            bodies_of = [group.bodies for group in groups]
            written = [array for one in bodies_of for array in (one.position, one.heading, one.moved)]
            written += [one.drive for one in bodies_of if "drive" in one]
            written += self._interactions.written if self._interactions else []
            written += [array for group in data.solid for array in (group.bodies.blocked, group.bodies.bumps)]
        # Interactions read positions before the step there, too.
        self._kept = self._interactions.before if self._interactions else []
        known = [id(array) for array, _ in self._kept]
        self._kept += [(array, array.copy()) for array in written if id(array) not in known]
        self._trail = None
        if trail:
            positions = trail.kept.whole("position")
            self._trail = TRAIL.pack(TrailArrays(self.progress, self._group_records, trail.every, positions))
        self._restore = self._copying(back=True) if written else None
        self.world: Packed[WorldArrays] = Packed(WORLD)
        self.watching = WATCHING.pack(WatchingArrays(self.progress, self._watchers(), True))
        self.run = [Phase("run", loop.RUN, self.world)]
        self.begin: list[Phase] = []
        self.see: list[Phase] = []
        self.look: list[Phase] = []
        self._assemble()

    def _copying(self, *, back: bool) -> Packed[CopyingArrays]:
        """Return the record that keeps what a step that fails must not have changed, or the one that restores it."""
        pairs = [(copy, array) if back else (array, copy) for array, copy in self._kept if array.nbytes]
        rows = [(address_of(array), address_of(copy), array.nbytes) for array, copy in pairs]
        return COPYING.pack(CopyingArrays(np.array(rows, np.int64).reshape(-1, 3)))

    def _assemble(self) -> None:
        """List the phases of a step, each with its present record."""
        interactions, solid = self._interactions, self._solid
        begin, decide, move, search = [], [], [], []
        if self._columns:
            begin.append(Phase("show columns", SHOW_COLUMNS, self._columns))
        before = [Phase("record before", RECORD_BEFORE, log) for log in self._log_records]
        if self._kept:
            move.append(Phase("keep", loop.COPY, self._copying(back=False)))
        if interactions and BEGIN in interactions.entries:
            move.append(Phase("begin", BEGIN, interactions.record))
        for group, record in zip(self._data.groups, self._group_records, strict=True):
            does = record.value
            begin.append(Phase("perceive", loop.PERCEIVE, record, group))
            if does.due or not does.is_sound:
                decide.append(Phase("decide", loop.DECIDE_DUE if does.due else loop.DECIDE, record, group))
            elif does.decide and does.decision:
                decide.append(Phase("decide", does.decide, does.decision, group))
            has_own = is_own(group.drive) or (is_watched(self._data.arena) and group not in self._data.solid)
            entry, argument = loop.guarded(does.advance, does.move, has_own)
            move.append(Phase("move", entry, argument, group))
            if solid:
                move += solid.phases(group)
            if interactions:
                move += interactions.phases(group)
        if solid:
            move += solid.phases(None)
        if interactions:
            move += interactions.phases(None)
        if self._bodies is not None:
            search.append(Phase("gather bodies", GATHER_BODIES, self._bodies))
        search += [Phase("measure", MEASURE, lidar, group) for group, lidar in self._lidars]
        for relation, found in zip(self._relations, self._relation_records, strict=True):
            search.append(Phase("search", loop.SEARCH, found, relation))
            if found.value.detection:
                search.append(Phase("detect", DETECT, found.value.detection, relation))
        search += [Phase("relay", SHOW_LATE, relay) for relay in self._relays.values()]
        search += [Phase("keep reports", KEEP_REPORTS, reports) for reports in self._reports.values()]
        end = [Phase("record after", RECORD_AFTER, log) for log in self._log_records]
        if interactions and RECORD_SCORES in interactions.entries:
            end.append(Phase("record scores", RECORD_SCORES, interactions.record))
        if solid:
            end.append(Phase("record bumps", RECORD_BUMPS, solid.record))
        end.append(Phase("record", loop.RECORD, self.world))
        if self._trail:
            end.append(Phase("leave trail", loop.LEAVE_TRAIL, self._trail))
        self.look.clear()
        if self.watchers:
            end.append(Phase("watch", loop.WATCH, self.watching))
            self.look.append(Phase("look", loop.WATCH, WATCHING.pack(self.watching.value._replace(is_step=False))))
        self.phases = [*begin, *decide, *before, *move, *search, *end]
        self.begin[:], self.see[:] = begin, [*search, Phase("record present", loop.RECORD_PRESENT, self.world)]
        self.deciding, self.searching = len(begin), len(begin + decide + before + move)
        data, stretch = self._data, self.stretch
        self.world.put(WorldArrays(
            data.moment, data.time, self.progress, self._group_records, self._relation_records,
            stretch.steps.whole("found"), stretch.present,
            np.array([(phase.entry.address, phase.record.address) for phase in self.phases]),
            self.searching - len(move), self._restore,
        ))  # fmt: skip

    def _groups(self) -> list[GroupArrays]:
        """Bind all groups, each with the groups of its team."""
        groups = self._data.groups
        self._team_records = teams = {
            group.number: TEAM_GROUP.pack(_team_group(group)) for group in groups if "teammates" in group.relations
        }
        # What is known late, by group and delay.
        late = {
            key: TEAM_GROUP.pack(teams[key[0]].value._replace(heading=relay.shown_heading, targets=relay.shown))
            for key, relay in ((key, packed.value) for key, packed in self._relays.items())
        }
        team_groups = [team_of(groups, group) for group in groups]
        known = {group.number: keeping_of(group, team) for group, team in zip(groups, team_groups, strict=True)}
        reports = self._keep_reports(teams | late, known, team_groups)
        records = []
        for group, others in zip(groups, team_groups, strict=True):
            delay, keeping = delay_of(group), known[group.number]
            team = [late.get((other.number, delay), teams[other.number]) for other in others]
            if keeping is not None:
                team = [reports[other.number, keeping[0]] for other in others]
            records.append(self._group(group, team))
        return records

    def _keep_reports(
        self, sensed: Mapping[Any, Packed[TeamGroup]], known: Mapping[int, tuple[Keeping, int] | None],
        team_groups: Sequence[list[Group]],
    ) -> dict[tuple[int, Keeping], Packed[TeamGroup]]:
        """Bind what keeps the reports of groups, and return the groups with them, by number and what is kept.

        Parameters
        ----------
        sensed : mapping to Packed of TeamGroup
            What is known of each group without hops: by its number, or number and delay.
        known : mapping of int to (Keeping, int) or None
            What the degree of each group needs.
        team_groups : sequence of list of Group
            The groups of the team of each group.
        """
        data, found = self._data, {}
        for group, team in zip(data.groups, team_groups, strict=True):
            needed = [one for other in team if (one := known[other.number]) is not None]
            for keeping in sorted({one for one, _ in needed}):
                memory = max(ticks for one, ticks in needed if one == keeping)
                key, targets = (group.number, keeping), group.relations.get(TARGETS)
                late = self._relays.get((group.number, keeping.delay))
                place = targets.place if targets else np.zeros(0, np.int64)
                value = reports_of(
                    group, keeping, memory, sensed[(group.number, keeping.delay) if late else group.number].value,
                    late.value.shown_place if late else place, data.moment, data.key,
                )  # fmt: skip
                if key in self._reports:
                    self._reports[key].put(value)
                else:
                    self._reports[key] = REPORTS.pack(value)
                found[key] = TEAM_GROUP.pack(value.group)
            forget_reports(group, [one for one, _ in needed])
        return found

    def _group(self, group: Group, team: list[Packed[TeamGroup]]) -> GroupArrays:
        """Bind a group: noise → percept → decision → motion."""
        perception = group.perception
        teammates = group.relations.get("teammates")
        perception.make_room(
            group.awareness,
            sum(len(other.value.sensing_range) for other in team),
            len(teammates.room.identity) if teammates else -1,
            group.inputs,
        )
        sensing = _sensing(group, team)
        perception.record = SENSING.pack(sensing)
        perceive = perceive_entry(group.awareness) if group.reads_teammates else None
        situate = situate_entry(group.awareness) if perception.is_situated else None
        due = decision = None
        if group.needs_timetable:
            due = None if group.has_decided else bind_due(group, self._data.key, partial(self._decide, group))
        elif group.is_compiled and not group.has_decided:
            decision = self._decide(group, group.rules[0], group.policy_state, group.action)
        return GroupArrays(
            self._data.key, self.progress["tick"],
            group.numbers, np.full(1, -1), group.lanes, stream_number(Stream.POLICY, group.number),
            perceive, situate, perception.record, perception.room,
            group.rules[0].entry() if decision else None, decision, due, group.is_sound,
            move_entry(self._data, group),
            pack_move(
                self._data.arena, group.bodies, group.bodies.aim, group.bodies.distance,
                arena_size=self._data.arena_size, has_inactive=group.has_conditions, drive=group.drive,
            ),
        )  # fmt: skip

    def _decide(self, group: Group, policy: CompiledPolicy, state: PolicyState, action: Action) -> Packed[Decision]:
        """Bind the kernel of a policy."""
        shown, relayed = group.perception.shown, group.perception.relayed
        if not policy.reads_teammates:
            shown = relayed = group.perception.nothing
        elif group.awareness.shows_teammates:
            shown = group.room("teammates")
        percept = group.percept_of(group.room("targets"), shown, relayed, policy.channels)
        return pack_decision(policy, percept, state, group.numbers, self.progress["tick"], action)

    def _relation(self, relation: Relation) -> RelationArrays:
        """Bind a neighbour search and the counters that follow it."""
        number = self._relations.index(relation)
        rows = self._body_rows[number][: len(relation.everyone)]
        bodies, search = sum(map(len, self._data.groups)), relation.search
        return RelationArrays(
            search.entry, search.record,
            self._group_records[relation.observers.number],
            [self._group_records[self._data.groups.index(group)] for group in relation.observed],
            search.x, search.y,
            relation.everyone, rows, self._met[_side(relation)][:bodies],
            search.room, relation.identity,
            relation.detection.record if relation.detection else None, *relation.true_lists,
            relation.conditions,
            [self._group_records[self._data.groups.index(group)] for group in counted_groups(self._relations)[number]],
        )  # fmt: skip

    @property
    def _first_body(self) -> dict[int, int]:
        """The index of the first agent of each group, by its number, among all bodies."""
        groups = self._data.groups
        first = accumulate([0, *map(len, groups)])
        return {group.number: number for group, number in zip(groups, first, strict=False)}

    def _number_bodies(self) -> None:
        """Number the bodies of the world, group by group."""
        first_body = self._first_body
        for relation, rows in zip(self._relations, self._body_rows, strict=True):
            at = 0
            for group in relation.observed:
                number = first_body[group.number]
                rows[at : at + len(group)] = np.arange(number, number + len(group))
                at += len(group)

    def follow(self, group: Group) -> bool:
        """Follow agents who have come to a group or left it, binding nothing again; return whether that was done."""
        if not self._is_open or group.bodies.room != self._room_of[self._data.groups.index(group)]:
            return False
        if self._sizes is None:
            self._sizes = self._made_sizes() if self._can_follow() else False
        if not self._sizes or not all(relation.has_wide_cells for relation in self._relations):
            return False
        self._sizes.follow(group)
        return True

    def _can_follow(self) -> bool:
        """Whether `follow` knows all that must change with the number of agents of a group."""
        data = self._data
        if self._logs or self._relays or self._reports or self._columns:
            return False
        if data.interactions or is_watched(data.arena) or data.solid:
            return False
        if self._trail or any(
            group.inputs or group.has_decided or group.awareness.spreads for group in data.groups
        ):
            return False
        if self._lidars:
            return False
        # A sensor keeps what it has measured, or has a range of its own.
        return not any(relation.detection or relation.has_own_range for relation in self._relations)

    def _made_sizes(self) -> Sizes:
        """List the words that depend on the sizes of groups, and let records show what they hold then."""
        groups, records = self._data.groups, self._group_records
        sizes = Sizes(groups, [record.value.block for record in records])
        for group, record in zip(groups, records, strict=True):
            team = team_of(groups, group)
            earlier = team[: team.index(group)] if team else []
            own, sensing = record.value, group.perception.record
            sizes.add(record.word("lanes"), [group], LANES)
            sizes.add_rows(own.move, group)
            if group.has_conditions:
                sizes.add(own.move.word("conditions"), [group])
            if "drive" in group.bodies:
                sizes.add(own.move.word("driven"), [group])
            sizes.add_rows(sensing, group)
            sizes.add(sensing.word("scene.first"), earlier)
            if own.due is not None:
                follow_due(group, own.due, sizes)
            elif own.decision is not None:
                sizes.add_rows(own.decision, group, is_decision=True)
            if (shown := self._team_records.get(group.number)) is not None:
                sizes.add_rows(shown, group)
                sizes.add(shown.word("first"), earlier)
                shown.follow(partial(_team_group, group))
            record.follow(partial(_with_lanes, own, group))
            sensing.follow(partial(_sensing, group, [self._team_records[one.number] for one in team]))
        for relation, bound, rows in zip(self._relations, self._relation_records, self._body_rows, strict=True):
            relation.follow(sizes, bound, rows)
            sizes.add(bound.word("bodies"), groups)
            bound.follow(partial(self._relation, relation))
        return sizes

    def _log(self, log: TransitionLog) -> LogArrays:
        """Bind the log of a group's transitions."""
        group, numbers = log.group, range(len(self._relations))
        sensing = [r for r in numbers if self._relations[r].name == TARGETS]
        own = [r for r in sensing if self._relations[r].observers is group]
        team = own
        if group.team is not None:
            team = [r for r in sensing if self._relations[r].observers.team == group.team]
        log.make_room_to_compare(
            max((len(self._relations[r].true_lists[1]) for r in own), default=0), sum(map(len, self._data.groups))
        )
        return LogArrays(
            self._group_records[self._data.groups.index(group)],
            self._relation_records[own[0]] if own else None,
            [self._relation_records[r] for r in team],
            situate_entry(group.awareness),
            SENSING.pack(group.perception.record.value._replace(situation=log.now)),
            log.now, log.row,
            log.steps.whole("situation"), log.steps.whole("action"), log.steps.whole("next_situation"),
            log.steps.whole("facts"),
            log.kept_start, log.kept_identity, log.before, log.after,
            group.bodies.last_rewards if log.has_rewards else np.zeros((0, 2)),
        )  # fmt: skip

    def _watchers(self) -> npt.NDArray[np.int64]:
        """Bind the watchers to the present records, and list their addresses."""
        data = self._data
        bound = Bound(
            data.groups, self._group_records, self._relations, self._relation_records, self._first_body, data.moment
        )
        # A policy in Python may add others in the middle of a step.
        self.watchers = list(data.watchers)
        rows = np.zeros((len(self.watchers), 4), np.int64)
        for row, watcher in zip(rows, self.watchers, strict=True):
            watcher.bind(bound)
            row[:3] = watcher.entry.address, watcher.record.address, watcher.sees_changes
        return rows

    def show_columns(self) -> None:
        """Show policies the columns that they read as they are now."""
        if self._columns:
            SHOW_COLUMNS(self._columns)

    def rebind_watchers(self) -> None:
        """Bind the watchers anew, after one came or went or arrays were replaced."""
        self.watching.update(watchers=self._watchers())
        self._assemble()

    def rebind(self, relation: int | None = None) -> None:
        """Write the records anew after arrays of neighbours, of one relation or of percepts, have grown."""
        self._sizes = None
        if relation is not None:
            self._relation_records[relation].put(self._relation(self._relations[relation]))
            for key, relay in relays_of(self._data.groups, self._data.moment).items():
                self._relays[key].put(relay.value)
        for group, value in zip(self._group_records, self._groups(), strict=True):
            group.put(value)
        self.rebind_logs()
        self.rebind_watchers()

    def rebind_logs(self) -> None:
        """Write the records of the logs anew."""
        for record, log in zip(self._log_records, self._logs, strict=True):
            record.put(self._log(log))

    def record_into(self, stretch: Stretch, trail: Trail | None) -> None:
        """Make the loop write into the present buffers of the history and of the positions."""
        self.stretch = stretch
        self.progress["row"] = len(stretch.steps)
        found, scores = stretch.steps.whole("found"), stretch.steps.whole("scores")
        if self.world.value.history is not found:
            self.world.update(history=found)
        if self._interactions:
            self._interactions.record.update(scores=scores)
        if self._solid:
            self._solid.record.update(scores=scores)
        if self._trail and trail:
            self.progress["trail_row"] = len(trail.kept)
            self._trail.update(trail=trail.kept.whole("position"))

    def rewind(self) -> None:
        """Begin again at tick 0 with the arrays as they are now."""
        self.state[:] = 0
        for group in self._group_records:
            group.value.block[:] = -1


def move_entry(data: WorldData, group: Group) -> Entry:
    """Return the kernel that moves a group; where bodies meet, it only says where each wants to go."""
    return intend_entry(group.drive) if group in data.solid else advance_entry(data.arena, group.drive)


def can_fail(data: WorldData) -> bool:
    """Whether a step can fail after bodies have moved: by a part of the user's, such as an arena, drive or sensor."""
    sensors = (channel.sensor for group in data.groups for channel in group.channels.values())
    own = any(sensor is not None and is_checked(sensor) for sensor in sensors)
    own = own or (bool(data.solid) and is_own(data.contact)) or any(is_own(group.drive) for group in data.groups)
    return own or is_watched(data.arena) or bool(data.interactions)


def has_bodies(data: WorldData) -> bool:
    """Whether an agent has a radius, so that rays can meet it."""
    return any(bool(group.bodies.radius.any()) for group in data.groups)


def _side(relation: Relation) -> str | int:
    """Relations of the same side count a body once that both detect: all that count are one side."""
    return "counted" if relation.counts else relation.observers.number


def _with_lanes(arrays: GroupArrays, group: Group) -> GroupArrays:
    return arrays._replace(noise=group.numbers, members=group.lanes)


def _team_group(group: Group) -> TeamGroup:
    teammates = group.relations["teammates"]
    return TeamGroup(
        teammates.first[group.number], group.bodies.identity, group.bodies.heading, group.bodies.sensing_range,
        group.room("targets"), group.room("teammates"), teammates.place, [],
        farthest_of(group.range_shape),
    )  # fmt: skip


def _sensing(group: Group, team: list[Packed[TeamGroup]]) -> Sensing:
    """The true surroundings of a group, and the arrays that its degree of awareness writes."""
    teammates = group.relations.get("teammates")
    work: tuple[Any, ...] = ()
    if group.awareness.spreads:
        robots = sum(len(other.value.identity) for other in team)
        work = np.zeros((robots, 4), np.int64), np.zeros((robots, 7))
    scene = Scene(
        group.bodies.heading, group.bodies.sensing_range, group.bodies.awareness_range, group.room("targets"),
        group.room("teammates"),
        teammates.place if teammates else np.zeros(0, np.int64),
        teammates.first[group.number] if teammates else 0, team, farthest_of(group.range_shape),
        *work,
    )  # fmt: skip
    perception, parameters = group.perception, np.ascontiguousarray(group.awareness.parameters, float)
    return Sensing(scene, parameters, perception.shown, perception.relayed, perception.situation)


class GroupOfSize(NamedTuple):
    """The record of a group: its columns with all room, and what depends on who is in it.

    Attributes
    ----------
    identity, member, last_rewards, aim, distance : ndarray, shape (room, …)
        As in `BODIES`.
    lanes : ndarray, shape (lanes,), int64
        `Group.whole_lanes`.
    block : ndarray, shape (1,), int64
        As in `GroupArrays`.
    forgets : bool
        Whether it decides at every step, so that nothing is left of the last action.
    """

    identity: Annotated[Integers, "room"]
    member: Annotated[Integers, "room"]
    last_rewards: Annotated[Floats, "room", 2]
    aim: Annotated[Floats, "room", 2]
    distance: Annotated[Floats, "room"]
    lanes: Annotated[Integers, "lanes"]
    block: Annotated[Integers, 1]
    forgets: bool


class RelationOfSize(NamedTuple):
    """The record of a relation: who is observed, with all room; see `RelationArrays`.

    Attributes
    ----------
    groups : ndarray, shape (k,), int64
        The indices of the observed groups.
    everyone, rows, x, y : ndarray, shape (observed, or lanes)
        As in `RelationArrays` and `Observed`.
    """

    groups: Annotated[Integers, "groups"]
    everyone: Annotated[Integers, "observed"]
    rows: Annotated[Integers, "observed"]
    x: Annotated[Floats, "lanes"]
    y: Annotated[Floats, "lanes"]


class SizesArrays(NamedTuple):
    """The record of the sizes of a world.

    Attributes
    ----------
    sizes : ndarray, shape (groups,), int64
        The present number of agents of each group.
    changed : ndarray, shape (1,), int64
        The index of the group whose agents have come or left.
    words : ndarray, shape (words, 2), int64
        The address of each word, and the number to a multiple of which it is rounded up.
    terms : ndarray, shape (words, groups), bool
        The groups whose sizes it adds up.
    groups, relations : list of Packed
        What else follows.
    """

    sizes: Annotated[Integers, "groups"]
    changed: Annotated[Integers, 1]
    words: Annotated[Integers, "words", 2]
    terms: Annotated[npt.NDArray[np.bool_], "words", "groups"]
    groups: list[Packed[GroupOfSize]]
    relations: list[Packed[RelationOfSize]]


_GROUP, _RELATION, _SIZES = Record(GroupOfSize), Record(RelationOfSize), Record(SizesArrays)
_group_at, _relation_at, _sizes_at = _GROUP.at, _RELATION.at, _SIZES.at


def _follow(address: int) -> int:
    here = _sizes_at(address)
    for w in range(here.words.shape[0]):
        total = 0
        for g in range(here.sizes.shape[0]):
            if here.terms[w, g]:
                total += here.sizes[g]
        unit = here.words[w, 1]
        array_at(here.words[w, 0], 1, np.int64)[0] = (total + unit - 1) // unit * unit
    changed = _group_at(here.groups[here.changed[0]])
    size = here.sizes[here.changed[0]]
    changed.block[0] = -1
    for i in range(changed.lanes.shape[0]):
        changed.lanes[i] = changed.member[i] if i < size else 0
    for i in range(size):
        changed.last_rewards[i, 0] = 0.0
        changed.last_rewards[i, 1] = 0.0
        if changed.forgets:
            changed.aim[i, 0] = 0.0
            changed.aim[i, 1] = 0.0
            changed.distance[i] = 0.0
    for r in range(here.relations.shape[0]):
        relation = _relation_at(here.relations[r])
        at = 0
        for place in range(relation.groups.shape[0]):
            number = relation.groups[place]
            first = 0
            for g in range(number):
                first += here.sizes[g]
            group = _group_at(here.groups[number])
            for i in range(here.sizes[number]):
                relation.everyone[at] = group.identity[i]
                relation.rows[at] = first + i
                at += 1
        for j in range(at, relation.x.shape[0]):
            relation.x[j] = FAR_AWAY
            relation.y[j] = FAR_AWAY
    return 0


FOLLOW = Entry(_follow)


class Sizes:
    """The words of the records of a world that follow the sizes of its groups.

    Parameters
    ----------
    groups : list of Group
        The groups of the world.
    blocks : list of ndarray
        The block of the random numbers of each; see `GroupArrays`.
    """

    def __init__(self, groups: Sequence[Group], blocks: Sequence[Integers]) -> None:
        self._groups = groups
        self._index = {group.number: index for index, group in enumerate(groups)}
        self._words: list[tuple[int, int]] = []
        self._terms: list[list[int]] = []
        self._of_groups = [
            _GROUP.pack(GroupOfSize(
                whole("identity"), whole("member"), whole("last_rewards"), whole("aim"), whole("distance"),
                group.whole_lanes, block, group.timetable is None,
            ))
            for group, block in zip(groups, blocks, strict=True) for whole in [group.bodies.whole]
        ]  # fmt: skip
        self._of_relations: list[Packed[RelationOfSize]] = []
        self._packed: Packed[SizesArrays] | None = None

    def add(self, address: int, groups: Iterable[Group], unit: int = 1) -> None:
        """Let a word be the sum of the sizes of some groups, rounded up to a multiple of `unit`."""
        self._words.append((address, unit))
        self._terms.append([self._index[group.number] for group in groups])

    def add_rows(self, packed: Packed[Any], group: Group, *, is_decision: bool = False) -> None:
        """Let a record have a row for each agent of a group; that of a decision has its random numbers too."""
        self.add(packed.word("n"), [group])
        if is_decision:
            self.add(packed.word("lanes"), [group], LANES)

    def add_relation(self, relation: Relation, rows: Integers) -> None:
        """Let the lists of who is observed follow; `rows` are those of `RelationArrays`, with all room."""
        groups = np.array([self._index[group.number] for group in relation.observed], np.int64)
        x, y = relation.search.lanes
        self._of_relations.append(_RELATION.pack(RelationOfSize(groups, relation.identities, rows, x, y)))

    def follow(self, group: Group) -> None:
        """Write all words anew, after agents have come to a group or left it."""
        sizes = [len(group) for group in self._groups]
        if self._packed is None:
            terms = np.zeros((len(self._terms), len(sizes)), np.bool_)
            for row, groups in zip(terms, self._terms, strict=True):
                row[groups] = True
            self._sizes, self._changed = np.array(sizes, np.int64), np.zeros(1, np.int64)
            words = np.array(self._words, np.int64).reshape(-1, 2)
            self._packed = _SIZES.pack(
                SizesArrays(self._sizes, self._changed, words, terms, self._of_groups, self._of_relations)
            )
        self._sizes[:], self._changed[0] = sizes, self._index[group.number]
        FOLLOW(self._packed)
