"""Interactions: their declaration in a world, their kernels in the compiled loop, their state, and their records."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import is_free
from teamsight.agents.engine.records import (
    DONE,
    FAILED,
    INTERACTION,
    INTERACTIONS,
    PARTAKER,
    ROLE,
    TURN,
    InteractionArrays,
    InteractionsArrays,
    PartakerArrays,
    Phase,
    RoleArrays,
    TurnArrays,
    group_at,
    interaction_at,
    interactions_at,
    partaker_at,
    role_at,
    turn_at,
)
from teamsight.agents.group import Group
from teamsight.agents.recording.history import COLUMNS
from teamsight.agents.resolve import layout
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.kernel import Entry, call, inlined, kernel
from teamsight.core.kernel.record import move as show
from teamsight.core.references import stable_name
from teamsight.world.contact import BUMPS
from teamsight.world.interaction import (
    COMPLETED,
    Interacting,
    InteractingBodies,
    Interaction,
    InteractionState,
    bodies_type,
    check_interaction_declarations,
    first_state,
    interacting_record,
    sizes_type,
)
from teamsight.world.motion import move_at
from teamsight.world.noise import LANES, TICKS_A_BLOCK, Stream, fill_block, key_within, stream_number
from teamsight.world.shapes import is_in_region

if TYPE_CHECKING:
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.world_data import WorldData
    from teamsight.core.kernel import Packed
    from teamsight.world.interaction import Kinds
    from teamsight.world.shapes import Region


#: What a kernel has left wrong: a position outside the arena, a heading that is no unit vector, a speed below 0 or not
#: finite, a reward that is not finite, a score that is not finite; or it has raised an exception.
BAD_POSITION, BAD_HEADING, BAD_SPEED, BAD_REWARD, BAD_SCORE, RAISED = range(1, 7)
#: What bodies get from interactions.
GIFTS = ("reward", "ended")


def _begin(address: int) -> int:
    """Begin the step of all that take part: nobody has moved yet, and those that decided have got nothing since."""
    world = interactions_at(address)
    tick = world.progress[0].tick
    for p in range(world.partakers.shape[0]):
        partaker = partaker_at(world.partakers[p])
        move = move_at(group_at(partaker.group).move)
        timed = partaker.decided_at.shape[0] > 0
        for i in range(move.position.shape[0]):
            move.moved[i, 0] = 0.0
            move.moved[i, 1] = 0.0
            partaker.last_rewards[i, 0] = 0.0
            partaker.last_rewards[i, 1] = 0.0
            if not timed or partaker.decided_at[i] == tick:
                partaker.reward[i] = 0.0
                partaker.ended[i] = False
    for number in range(world.interactions.shape[0]):
        here = interaction_at(world.interactions[number])
        for s in range(here.scores.shape[0]):
            here.scores[s] = 0.0
    return DONE


@kernel
def _draw(address: int, tick: int) -> None:
    """Show the kernel the random numbers of a tick."""
    here = interaction_at(address)
    block = tick // TICKS_A_BLOCK
    if here.block[0] != block:
        for r in range(here.roles.shape[0]):
            role = role_at(here.roles[r])
            if role.noise.shape[1] > 0:
                fill_block(role.noise, here.key, role.stream, tick, role.members)
        here.block[0] = block
    show(here.words, here.moves, tick % TICKS_A_BLOCK)


@inlined
def _fault(move: Any, i: int, region: Any, found: Any) -> int:
    """Return what is wrong with a body after a call; 0 for nothing. What is wrong is written to `found`."""
    found[0] = move.position[i, 0]
    found[1] = move.position[i, 1]
    if not is_in_region(region, found[0], found[1]):
        return BAD_POSITION
    x = move.heading[i, 0]
    y = move.heading[i, 1]
    if not abs(x * x + y * y - 1.0) < 1e-6:
        found[0] = x
        found[1] = y
        return BAD_HEADING
    if not 0.0 <= move.speed[i] < math.inf:
        found[0] = move.speed[i]
        return BAD_SPEED
    return 0


@kernel
def _accept(address: int, region: Any, found: Any, progress: Any, are_changed: bool) -> int:
    """Add what the bodies of a role got in a call; return `FAILED` if something is wrong with one of them."""
    role = role_at(address)
    partaker = partaker_at(role.partaker)
    move = move_at(group_at(partaker.group).move)
    for i in range(role.reward.shape[0]):
        what = _fault(move, i, region, found) if are_changed else 0
        if what == 0 and not abs(role.reward[i]) < math.inf:
            found[0] = role.reward[i]
            what = BAD_REWARD
        if what != 0:
            progress.what = what
            progress.body = i
            return FAILED
        partaker.reward[i] += role.reward[i]
        partaker.last_rewards[i, 0] += role.reward[i]
        if role.ended[i]:
            partaker.ended[i] = True
            partaker.last_rewards[i, 1] = 1.0
    return DONE


@kernel
def _set_moved(address: int) -> None:
    """Write the displacement of each body of a group in this step so far, by the rule of `motion`."""
    partaker = partaker_at(address)
    move = move_at(group_at(partaker.group).move)
    period_x = move.period[0]
    period_y = move.period[1]
    for i in range(move.position.shape[0]):
        step_x = move.position[i, 0] - partaker.before[i, 0]
        step_y = move.position[i, 1] - partaker.before[i, 1]
        if period_x > 0.0:
            step_x -= period_x * np.rint(step_x / period_x)
            step_y -= period_y * np.rint(step_y / period_y)
        move.moved[i, 0] = step_x
        move.moved[i, 1] = step_y


def _note_moved(address: int) -> int:
    _set_moved(address)
    return DONE


def _interact(address: int) -> int:
    """Call an interaction, and add up the rewards; return `FAILED` if it left something wrong."""
    call_ = turn_at(address)
    progress = call_.progress[0]
    here = interaction_at(call_.interaction)
    _draw(call_.interaction, progress.tick)
    here.words[here.turn] = call_.turn
    if here.gives != 0:
        for r in range(here.roles.shape[0]):
            role = role_at(here.roles[r])
            for i in range(role.reward.shape[0]):
                role.reward[i] = 0.0
                role.ended[i] = False
    if call(here.kernel, here.call) != COMPLETED:
        progress.what = RAISED
        return FAILED
    for s in range(here.scores.shape[0]):
        if not abs(here.scores[s]) < math.inf:
            here.found[0] = here.scores[s]
            progress.what = BAD_SCORE
            progress.where = s
            return FAILED
    if here.changes_bodies == 0 and here.gives == 0:
        return DONE
    for r in range(here.roles.shape[0]):
        if _accept(here.roles[r], here.region, here.found, progress, here.changes_bodies != 0) != DONE:
            progress.where = r
            return FAILED
        if here.moves_bodies != 0:
            _set_moved(role_at(here.roles[r]).partaker)
    return DONE


def _record_scores(address: int) -> int:
    world = interactions_at(address)
    for number in range(world.interactions.shape[0]):
        here = interaction_at(world.interactions[number])
        for s in range(here.scores.shape[0]):
            world.scores[world.progress[0].row, here.first_score + s] = here.scores[s]
    return DONE


BEGIN, NOTE_MOVED, INTERACT, RECORD_SCORES = map(Entry, (_begin, _note_moved, _interact, _record_scores))


Key = npt.NDArray[np.uint64]


class InteractionSaved(NamedTuple):
    """What changes of an interaction in a run; see `PlacedInteraction`."""

    described: tuple[Any, ...]
    state: InteractionState
    changes: dict[str, Any]


class PlacedInteraction:
    """An interaction in a world.

    Parameters
    ----------
    interaction : Interaction
        The interaction, as it is declared: with its parameters at the begin of a run.
    groups : tuple of Group
        The group of each role.
    nth : int
        Which of its class it is in its world, from 0; its random numbers depend on it.
    key : ndarray, shape (2,), uint64
        The key of the world's noise.

    Attributes
    ----------
    declared, interaction : Interaction
        The interaction as it is declared, and as it is now.
    changes : dict of str to object
        The fields that were changed since, by name.
    state : InteractionState
        Its state.
    """

    def __init__(self, interaction: Interaction, groups: tuple[Group, ...], nth: int, key: Key) -> None:
        # Any, because `replace` needs a dataclass, and one without fields need not be one.
        self.declared: Any = interaction
        self.interaction = interaction
        self.groups, self.nth = groups, nth
        self.changes: dict[str, Any] = {}
        self.parameters = np.array(interaction.parameters, float)
        self._first_parameters = tuple(self.parameters.tolist())
        self.scores = np.zeros(len(interaction.scores))
        self.key = np.zeros(2, np.uint64)
        self.block = np.full(1, -1)
        self.state = first_state(interaction, self.sizes)
        self.begin(key)

    @property
    def described(self) -> tuple[Any, ...]:
        """What it is and between whom; equal for the same interaction in a world that was built in the same way."""
        one, groups = self.declared, tuple(group.name for group in self.groups)
        return self.name, one.roles, groups, self._first_parameters, one.scores

    @property
    def name(self) -> str:
        """The name of its class, for errors."""
        return type(self.interaction).__name__

    @property
    def roles(self) -> dict[str, Group]:
        """The group of each role."""
        return dict(zip(self.interaction.roles, self.groups, strict=True))

    @property
    def sizes(self) -> Any:
        """The number of bodies of each role, as a NamedTuple."""
        return sizes_type(self.interaction.roles)(*map(len, self.groups))

    def begin(self, key: Key) -> None:
        """Begin to draw from the noise of a world with this key."""
        self.key[:] = key_within(key, f"interaction {stable_name(type(self.interaction))} {self.nth}")
        self.block[:] = -1

    def with_changes(self, changes: Mapping[str, Any]) -> Interaction:
        """Return the interaction with other values of these fields; see `take`.

        Raises
        ------
        ValueError
            If more than what the kernel reads in each step would differ.
        """
        changed: Interaction = replace(self.declared, **changes)
        for what in ("roles", "scores", "draws", "in_turn", "columns", "writes"):
            if getattr(changed, what) != getattr(self.declared, what):
                raise ValueError(f"{self.name}.{what}: cannot change in a run; build another world")
        if len(changed.parameters) != len(self.parameters):
            raise ValueError(f"{self.name}.parameters: their number cannot change in a run; build another world")
        begun = zip(first_state(changed, self.sizes), first_state(self.declared, self.sizes), strict=True)
        if not all(np.array_equal(new, old) for new, old in begun):
            raise ValueError(f"{self.name}.start: the state in which runs begin cannot change; build another world")
        return changed

    def take(self, changes: Mapping[str, Any]) -> None:
        """Let these fields have other values, and all others those that were declared; see `with_changes`."""
        self.interaction = replace(self.declared, **changes) if changes else self.declared
        self.changes = dict(changes)
        # In place, because the kernel reads it.
        self.parameters[:] = self.interaction.parameters

    def restart(self, state: InteractionState, *, is_kept: bool) -> None:
        """Go back to the start of a run; if arrays are kept, they are written instead of replaced."""
        if self.changes:
            self.take({})
        if is_kept and all(old.shape == new.shape for old, new in zip(self.state, state, strict=True)):
            for old, new in zip(self.state, state, strict=True):
                old[:] = new
        else:
            self.state = state

    def saved(self) -> InteractionSaved:
        """Return what changes in a run, as it is."""
        return InteractionSaved(self.described, self.state, self.changes)

    def put_back(self, saved: InteractionSaved) -> None:
        """Go back to what was saved."""
        self.state = saved.state
        self.take(saved.changes)

    @property
    def kinds(self) -> Kinds:
        """The columns of each role: name and type."""
        declared = self.interaction.columns
        return tuple(
            (role, tuple((name, group.columns.array(name).dtype.str) for of, name, _ in declared if of == role))
            for role, group in self.roles.items()
        )

    @property
    def arrays(self) -> list[npt.NDArray[Any]]:
        """The arrays that only its kernel writes: its state and its columns."""
        roles = self.roles
        return [*self.state, *(roles[role].columns.array(name) for role, name, _ in self.interaction.columns)]

    def bind(
        self, partakers: dict[int, Packed[PartakerArrays]], region: Region, first_score: int
    ) -> Packed[InteractionArrays]:
        """Return the record of the interaction; `partakers` are those of the groups, by number."""
        kinds, roles = self.kinds, []
        for role, group in enumerate(self.groups):
            size = len(group)
            lanes = -(-max(size, 1) // LANES) * LANES
            members = np.zeros(lanes, np.int64)
            members[:size] = group.bodies.member
            noise = np.zeros((TICKS_A_BLOCK, self.interaction.draws, lanes))
            stream = stream_number(Stream.INTERACTION, role)
            roles.append(RoleArrays(
                partakers[group.number], noise, members, stream, np.zeros(size), np.zeros(size, np.bool_)
            ))  # fmt: skip
        self.block[:] = -1
        writes = {*self.interaction.writes}
        call = interacting_record(kinds, self.interaction.writes).pack(self._call(kinds, partakers, roles))
        turn, moves = _words(call, roles)
        return INTERACTION.pack(InteractionArrays(
            self.interaction.entry(kinds), call, call.words, turn, moves, self.interaction.in_turn,
            "position" in writes, not writes.isdisjoint(("position", "heading", "speed")), not writes.isdisjoint(GIFTS),
            self.key, self.block, [ROLE.pack(role) for role in roles], self.scores, first_score, region, np.zeros(2),
        ))  # fmt: skip

    def _call(
        self, kinds: Kinds, partakers: dict[int, Packed[PartakerArrays]], roles: list[RoleArrays]
    ) -> Interacting:
        """Return the arguments of the kernel."""
        writes = self.interaction.writes
        record = interacting_record(kinds, writes)
        (bodies_kind, noise_kind) = (part.kind for part in (record.node.parts[0], record.node.parts[3]))
        bodies = []
        for (role, columns), group, written in zip(kinds, self.groups, roles, strict=True):
            own, before = group.bodies, partakers[group.number].value.before
            shown = InteractingBodies(
                own.position, own.heading, before, own.moved, own.speed, own.active, written.reward, written.ended,
                own.identity,
            )
            own_columns = (group.columns.array(name) for name, _ in columns)
            bodies.append(bodies_type(role, columns, writes)(*shown, *own_columns))
        noise = noise_kind(*(role.noise[0] for role in roles))
        return Interacting(bodies_kind(*bodies), self.state, self.parameters, noise, self.scores, -1)


def check_interactions(saved: Sequence[InteractionSaved], present: Sequence[PlacedInteraction]) -> None:
    """Refuse saved interactions that are not those of a world."""
    theirs, mine = [one.described for one in saved], [one.described for one in present]
    if theirs != mine:
        shown = [", ".join(f"{one[0]} of {' and '.join(one[2])} {one[3]}" for one in all_) for all_ in (theirs, mine)]
        raise ValueError(
            f"restore(…): the state is of a world with the interactions {shown[0] or 'none'}, and this one has "
            f"{shown[1] or 'none'}; restore it in a world built in the same way"
        )
    for one, other in zip(saved, present, strict=True):
        if one.changes:
            other.with_changes(one.changes)
        # The number of rows may depend on how many bodies there were.
        if [table.shape[1] for table in one.state] != [table.shape[1] for table in other.state]:
            raise ValueError(
                f"restore(…): the interaction {other.name} has the state {layout(one.state)}, and here "
                f"{layout(other.state)}; restore it in a world whose interactions have the same options"
            )


def _words(call: Packed[Any], roles: list[RoleArrays]) -> tuple[int, Integers]:
    """Return the word of `turn` in the record of a call, and how the words of the noise depend on the tick."""
    leaves = call.leaves
    turn = next(leaf.slot for leaf in leaves if leaf.path == "turn")
    noise = [leaf.slot for leaf in leaves if leaf.path.startswith("noise.")]
    moves = [(slot, call.words[slot], role.noise[0].nbytes) for slot, role in zip(noise, roles, strict=True)]
    return turn, np.array(moves, np.int64).reshape(-1, 3)


Integers = npt.NDArray[np.int64]


class BoundInteractions:
    """The records of all interactions of a world.

    Parameters
    ----------
    data : WorldData
        The world.
    group_records : list of Packed of GroupArrays
        The records of its groups, in their order.
    progress : ndarray of `PROGRESS`, shape (1,)
        The state of the loop.
    scores : ndarray, shape (steps, scores), float64
        As in `InteractionsArrays`.

    Attributes
    ----------
    record : Packed of InteractionsArrays
        The record of all; their scores follow each other.
    written : list of ndarray
        What interactions write besides positions, headings and motions.
    before : list of tuple of ndarray
        The positions of the groups that take part, and where those before the present step are kept.
    entries : list of Entry
        The phases that these interactions need.
    """

    def __init__(
        self, data: WorldData, group_records: list[Packed[Any]], progress: npt.NDArray[Any], scores: npt.NDArray[Any]
    ) -> None:
        # Only worlds with an interaction need it.
        from teamsight.world.shapes import region_of

        self._placed = data.interactions
        groups = {group.number: group for one in self._placed for group in one.groups}
        self._partakers = {number: _partaker(group, group_records[number]) for number, group in groups.items()}
        region, first, records = region_of(data.arena), 0, []
        for one in self._placed:
            records.append(one.bind(self._partakers, region, first))
            first += len(one.scores)
        self.record = INTERACTIONS.pack(InteractionsArrays(progress, records, list(self._partakers.values()), scores))
        self.entries = entries_needed(self._placed)
        self.before = [(groups[number].bodies.position, one.value.before) for number, one in self._partakers.items()]
        self.written = [array for one in self._placed for array in one.arrays]
        for group in groups.values():
            bodies = group.bodies
            writes = {name for one in self._placed if group in one.groups for name in one.interaction.writes}
            self.written += [bodies.speed] if "speed" in writes else []
            self.written += [] if writes.isdisjoint(GIFTS) else [bodies.reward, bodies.ended, bodies.last_rewards]

    def phases(self, group: Group | None) -> list[Phase]:
        """Return the phases that follow the move of a group; for None, those that follow all moves."""
        found = []
        if group is not None:
            if group.number not in self._partakers:
                return []
            if NOTE_MOVED in self.entries:
                found.append(Phase("note moved", NOTE_MOVED, self._partakers[group.number]))
        progress, records, *_ = self.record.value
        for placed, record in zip(self._placed, records, strict=True):
            if placed.interaction.in_turn is (group is not None):
                turns = [-1] if group is None else [role for role, one in enumerate(placed.groups) if one is group]
                found += [
                    Phase("interact", INTERACT, TURN.pack(TurnArrays(progress, record, turn)), placed) for turn in turns
                ]
        return found


def entries_needed(placed: Sequence[PlacedInteraction]) -> list[Entry]:
    """Return the entries of the phases that interactions need."""
    declared = [one.interaction for one in placed]
    entries = [INTERACT]
    # Without turns all have moved, and their moves have written how far.
    entries += [NOTE_MOVED] * any(one.in_turn for one in declared)
    entries += [RECORD_SCORES] * any(one.scores for one in declared)
    gives = any(name in GIFTS for one in declared for name in one.writes)
    return [BEGIN, *entries] if gives or len(entries) > 1 else entries


def _partaker(group: Group, record: Packed[Any]) -> Packed[PartakerArrays]:
    bodies, table = group.bodies, group.timetable
    decided_at = np.zeros(0, np.int64) if table is None else table.decided_at
    before = bodies.position.copy()
    return PARTAKER.pack(PartakerArrays(
        record, before, bodies.reward, bodies.ended, bodies.last_rewards, decided_at
    ))  # fmt: skip


def interact(data: WorldData, engine: Engine, interaction: Interaction, groups: dict[str, Group]) -> None:
    """Put an interaction into a world; see `World.interact`."""
    data.timeline.check_undecided("interact()")
    check_interaction_declarations(interaction)
    _check_groups(data, interaction, groups)
    _check_new(data, interaction, groups)
    _check_fit(data, interaction, groups)
    for role, name, fill in interaction.columns:
        _check_column(data, type(interaction).__name__, groups[role], name, fill)
    nth = sum(type(one.interaction) is type(interaction) for one in data.interactions)
    placed = PlacedInteraction(interaction, tuple(groups[role] for role in interaction.roles), nth, data.key)
    with deferred():
        for role, name, fill in interaction.columns:
            group = groups[role]
            if name not in group.columns:
                group.add_column(name, fill)
            group.columns.keep(name, type(interaction).__name__, group.members, fill)
        data.interactions.append(placed)
        engine.is_bound = False


def adjust_interaction(data: WorldData, interaction: Interaction, changes: Mapping[str, Any]) -> None:
    """Change the fields of an interaction; see `World.adjust`."""
    data.timeline.check_undecided("adjust()")
    name = type(interaction).__name__
    found = [one for one in data.interactions if interaction is one.declared or interaction is one.interaction]
    if not found:
        raise ValueError(f"adjust({name}): is not in this world now; give one of world.interactions")
    if not is_dataclass(interaction):
        raise TypeError(f"adjust({name}): has no fields to change; make it a dataclass, whose fields are its constants")
    known = [field.name for field in fields(interaction) if field.init]
    for field, value in changes.items():
        if field not in known:
            cure = f"{checks.suggestion(field, known)}{name} has {', '.join(known) or 'no fields'}"
            raise TypeError(f"adjust({name}): {field}={checks.shown(value)}: unknown; {cure}")
    # All is checked before anything changes.
    for one in found:
        changed = one.with_changes({**one.changes, **changes})
        check_interaction_declarations(changed)
        _check_fit(data, changed, one.roles)
    with deferred():
        for one in found:
            one.take({**one.changes, **changes})


def _check_fit(data: WorldData, interaction: Interaction, groups: Mapping[str, Group]) -> None:
    order = sorted(interaction.roles, key=lambda role: groups[role].number)
    interaction.check_fit(data.arena, tuple(order))


def _check_groups(data: WorldData, interaction: Interaction, groups: dict[str, Group]) -> None:
    """Refuse groups that are not those of the roles, one each, of this world."""
    name, roles = type(interaction).__name__, interaction.roles
    example = f"world.interact({name}(), {', '.join(f'{role}=…' for role in roles)})"
    for role in roles:
        if role not in groups:
            raise TypeError(f"{name}: has no group for the role {role!r}; give one for each role: {example}")
    for role, group in groups.items():
        if role not in roles:
            raise TypeError(f"{name}: has no role {role!r}, but {', '.join(map(repr, roles))}: {example}")
        data.check_group(group, f"{role}={{}}")
        first = next(other for other in groups if groups[other] is group)
        if first != role:
            raise ValueError(
                f"{name}: the group {group.name!r} has the roles {first!r} and {role!r}; give each role a group of its "
                "own, or declare one role"
            )


def _check_new(data: WorldData, interaction: Interaction, groups: dict[str, Group]) -> None:
    """Refuse an interaction that is there already, and scores that are columns of the history."""
    name = type(interaction).__name__
    for placed in data.interactions:
        if type(placed.interaction) is type(interaction) and placed.roles == groups:
            raise ValueError(
                f"{name}: is already between {', '.join(group.name for group in placed.groups)}; it would happen twice "
                "in each step. Leave one out, or give other groups"
            )
    for score in interaction.scores:
        if score in COLUMNS or score == BUMPS or score in data.score_names:
            raise ValueError(
                f"{name}.scores: {score!r} is already a column of world.recording.history; take another name, in a "
                "subclass if need be"
            )


def _check_column(data: WorldData, name: str, group: Group, column: str, fill: Any) -> None:
    """Refuse a column that the group cannot have, has with another type, or that another interaction keeps."""
    kind = np.asarray(fill).dtype
    if column in group.columns:
        array = group.columns.array(column)
        if array.dtype != kind or array.ndim != 1:
            raise ValueError(
                f"{name}.columns: {group.name} have a column {column!r} of {array.dtype} and shape {array.shape}; it "
                f"must be of {kind}, one for each agent: add_column({column!r}, {fill!r})"
            )
    elif not is_free(group, column):
        raise ValueError(f"{name}.columns: agents of {group.name!r} have the attribute {column!r}; take another name")
    for placed in data.interactions:
        # Each would take what the other has written for its own.
        if any(placed.roles[role] is group and column == other for role, other, _ in placed.interaction.columns):
            raise ValueError(
                f"{name}.columns: {column!r} of {group.name} is kept by {placed.name}; give this interaction another "
                f"group, make one interaction of both, or give the columns of one of them other names"
            )
