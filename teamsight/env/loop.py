"""One compiled call that steps many worlds and shows what follows: observations and facts.

Each world makes its step by the same entry as `World.run`, so results are equal to the last bit. A world has arrays of
its own, or its state is a row of a block; then a built world makes its step, into which the row is copied and from
which it is copied back.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Sensing
from teamsight.agents.engine.loop import count_active, count_observers
from teamsight.agents.engine.records import (
    HISTORY_COLUMNS,
    GroupArrays,
    RelationArrays,
    WorldArrays,
    group_at,
    relation_at,
    world_at,
)
from teamsight.agents.recording.transitions import count_sensing
from teamsight.core.kernel import Entry, Packed, Record, array_at, call, inlined, kernel
from teamsight.env.actions import GRID, HEADING, VECTOR
from teamsight.world.motion import is_action, move_at

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: What was done with a world: its step is made; nothing, since it waits; nothing, since its step needs Python; the loop
#: stopped within the step; the step is made, but there was no room to show it.
DONE, WAITS, NEEDS_PYTHON, UNFINISHED, UNSEEN = range(5)
#: See `RowArrays`.
LOAD, KEEP, END = range(3)


class SightArrays(NamedTuple):
    """The record of one world of an environment: where its actions go, and what is shown of it.

    Attributes
    ----------
    world : Packed of WorldArrays
        The record of the world.
    robots : Packed of GroupArrays
        The robots.
    targets, teammates : Packed of RelationArrays or None
        What they sense as targets, and their teammates in range.
    team : list of Packed of RelationArrays
        What all groups of their team sense as targets.
    roles : ndarray, shape (relations,), int64
        For each relation of the world: 1 if it counts in the observed fraction, 2 if it is one of teammates.
    everybody : int
        The number of targets that count.
    state : ndarray, shape (robots, 1, 3), float64
        The state of `Steered`, into which actions are written.
    perceive, percept : Entry or None, Packed of Sensing
        The kernel of the percept, and its record; see `Observation.perceive`.
    room : int
        The number of entries that `perceive` can write.
    show, seen : Entry, Packed
        The kernel that writes the observations, and its record; see `Observation.seen`.
    of_robots : ndarray, shape (robots, facts), float64
        The facts of the robots; see `Facts`.
    shown : ndarray, shape (facts, worlds, robots), float64
        Those of all worlds, into which they are copied: whoever reads a fact of all robots reads it in one piece.
    number : int
        The number of the world there.
    of_world : ndarray, shape (facts,), float64
        The facts of the world.
    kept_start, kept_index : ndarray, shape (robots + 1,) and (kept,), int64
        The targets that each robot sensed after the last step, as in `RelationArrays.true_index`.
    before, after : ndarray, shape (bodies,), int64
        The number of robots of the team that sense each body, after the last step and now.
    is_new : ndarray, shape (1,), int64
        Whether nothing is known of the last step: at the start, and after bodies have come or left.
    last_rewards : ndarray, shape (robots, 2), float64
        As in `Group`.
    """

    world: Packed[WorldArrays]
    robots: Packed[GroupArrays]
    targets: Packed[RelationArrays] | None
    teammates: Packed[RelationArrays] | None
    team: list[Packed[RelationArrays]]
    roles: Annotated[Integers, "relations"]
    everybody: int
    state: Annotated[Floats, "robots", 1, 3]
    perceive: Entry | None
    percept: Packed[Sensing]
    room: int
    show: Entry
    seen: Packed[Any]
    of_robots: Annotated[Floats, "robots", "facts"]
    shown: Annotated[Floats, "facts", "worlds", "robots"]
    number: int
    of_world: Annotated[Floats, "world facts"]
    kept_start: Annotated[Integers, "robots + 1"]
    kept_index: Annotated[Integers, "kept"]
    before: Annotated[Integers, "bodies"]
    after: Annotated[Integers, "bodies"]
    is_new: Annotated[Integers, 1]
    last_rewards: Annotated[Floats, "robots", 2]


class BlockArrays(NamedTuple):
    """The record of a built world that makes the steps of those whose states are the rows of a block.

    Attributes
    ----------
    sight : Packed of SightArrays
        The built world.
    rows, stride : int
        The address of the first row, and the bytes from one to the next.
    spans : ndarray, shape (spans, 3), int64
        The parts of a row, one after the other, each from a multiple of 8 bytes on: the address of an array of the
        built world; the bytes of it, or of an element if only some are used; and the address of their number, or 0.
        The spans of numbers come before those that they are of.
    shown : ndarray, shape (words, 3), int64
        The words of records that say where the built world is shown: the address of each, its value for the first
        world, and its change from world to world.
    log : ndarray, shape (worlds, steps, relations, columns, parts), uint16
        For each step of an episode its row of the history, in parts of 16 bits.
    """

    sight: Packed[SightArrays]
    rows: int
    stride: int
    spans: Annotated[Integers, "spans", 3]
    shown: Annotated[Integers, "shown words", 3]
    log: Annotated[npt.NDArray[np.uint16], "worlds", "steps", "relations", "columns", "log parts"]


class StartArrays(NamedTuple):
    """The record of the starts of episodes.

    Attributes
    ----------
    block : Packed of BlockArrays
        The worlds.
    template : int
        The address of the row with which each begins, but for what follows; 0 if the built world itself has begun.
    see : ndarray, shape (phases, 2), int64
        What searches for neighbours: the addresses of entries and of their records.
    next, last : ndarray, shape (1,), int64
        The first of the worlds that is to begin, and the one after the last; the former is counted up.
    worlds, starts : ndarray, shape (worlds,), int64
        The rows that begin, and the start of each.
    key, position, heading : ndarray, shape (starts, 2) and (starts, bodies, 2)
        The key of the noise of each, and where its bodies are.
    here : ndarray, shape (2,), uint64
        The key of the built world.
    groups : list of Packed of GroupArrays
        Its groups.
    """

    block: Packed[BlockArrays]
    template: int
    see: Annotated[Integers, "phases", 2]
    next: Annotated[Integers, 1]
    last: Annotated[Integers, 1]
    worlds: Annotated[Integers, "worlds"]
    starts: Annotated[Integers, "worlds"]
    key: Annotated[npt.NDArray[np.uint64], "starts", 2]
    position: Annotated[Floats, "starts", "bodies", 2]
    heading: Annotated[Floats, "starts", "bodies", 2]
    here: Annotated[npt.NDArray[np.uint64], 2]
    groups: list[Packed[GroupArrays]]


class RowArrays(NamedTuple):
    """The record of one row of a block.

    Attributes
    ----------
    block : Packed of BlockArrays
        The block.
    number : int
        The row.
    what : int
        What is done: `LOAD` copies it into the built world, which is then shown where its world is; `KEEP` copies it
        back; `END` does so after a step, which is logged.
    """

    block: Packed[BlockArrays]
    number: int
    what: int


class BatchArrays(NamedTuple):
    """The record of many worlds.

    Attributes
    ----------
    run : Entry
        The compiled loop of a world.
    sights : ndarray, shape (worlds,), int64
        The address of the record `SightArrays` of each world, or 0 for a row of the block.
    block : Packed of BlockArrays or None
        The block; None if all worlds have arrays of their own.
    form : int
        The form of the actions; see `ActionForm`.
    table : ndarray, shape (actions, 2), float64
        The actions of the grid.
    given : ndarray, shape (worlds, robots, parts), float64
        The actions.
    steering : ndarray, shape (worlds, robots, 3), float64
        The same for `Steered`, written by the call.
    quiet_until : ndarray, shape (worlds,), int64
        The tick from which a step of each world needs Python: an event is due, or the history is full.
    status : ndarray, shape (worlds,), int64
        Before the call, `WAITS` for worlds that are left out; after it, what was done.
    next : ndarray, shape (1,), int64
        The world from which the call goes on.
    """

    run: Entry
    sights: Annotated[Integers, "worlds"]
    block: Packed[BlockArrays] | None
    form: int
    table: Annotated[Floats, "actions", 2]
    given: Annotated[Floats, "worlds", "robots", "parts"]
    steering: Annotated[Floats, "worlds", "robots", 3]
    quiet_until: Annotated[Integers, "worlds"]
    status: Annotated[Integers, "worlds"]
    next: Annotated[Integers, 1]


SIGHT = Record(SightArrays)
BLOCK, START, ROW = Record(BlockArrays), Record(StartArrays), Record(RowArrays)
BATCH = Record(BatchArrays)

# For kernels: from the address of a record to its arrays.
sight_at: Any = SIGHT.at
block_at, start_at, row_at = BLOCK.at, START.at, ROW.at
batch_at: Any = BATCH.at

_WORD = 8

# The columns of `rewards.OF_ROBOTS` and `rewards.OF_WORLDS`.
_SENSED, _GAINED, _LOST, _ALONE, _ALONE_GAINED, _ALONE_LOST, _TEAM = range(7)
_SHARE, _NEIGHBOURS, _TRAVELLED, _ACTIVE, _REWARD, _ENDED = range(9, 15)
_COUNTS, _TEAMMATES = 1, 2
# Lengths of directions; squares of others would lose digits.
_SHORTEST, _LONGEST = 1e-100, 1e100


@kernel
def _write_targets(sight: Any) -> None:
    """Compare the targets that each robot sensed before with those that it senses now, both in ascending order."""
    relation = relation_at(sight.targets)
    start, index, rows = relation.true_start, relation.true_index, relation.rows
    old_start, old_index, before, after = sight.kept_start, sight.kept_index, sight.before, sight.after
    for i in range(sight.of_robots.shape[0]):
        facts = sight.of_robots[i]
        k = start[i]
        old = old_start[i]
        while k < start[i + 1] or old < old_start[i + 1]:
            is_now = k < start[i + 1] and (old >= old_start[i + 1] or index[k] <= old_index[old])
            was_then = old < old_start[i + 1] and (k >= start[i + 1] or old_index[old] <= index[k])
            body = rows[index[k]] if is_now else rows[old_index[old]]
            is_alone = is_now and after[body] == 1
            was_alone = was_then and before[body] == 1
            facts[_SENSED] += is_now
            facts[_GAINED] += is_now and not was_then
            facts[_LOST] += was_then and not is_now
            facts[_ALONE] += is_alone
            facts[_ALONE_GAINED] += is_alone and not was_alone
            facts[_ALONE_LOST] += was_alone and not is_alone
            if is_now:
                facts[_SHARE] += 1.0 / after[body]
            k += is_now
            old += was_then


@kernel
def _keep_targets(sight: Any) -> None:
    """Keep what is sensed now, for the comparison after the next step."""
    for body in range(sight.after.shape[0]):
        sight.before[body] = sight.after[body]
    if sight.targets != 0:
        relation = relation_at(sight.targets)
        for i in range(relation.true_start.shape[0]):
            sight.kept_start[i] = relation.true_start[i]
        for k in range(relation.true_start[relation.true_start.shape[0] - 1]):
            sight.kept_index[k] = relation.true_index[k]


@kernel
def _write_bodies(sight: Any) -> None:
    """Write the neighbours of each robot, how far it went, and whether it is active."""
    move = move_at(group_at(sight.robots).move)
    for i in range(sight.of_robots.shape[0]):
        facts = sight.of_robots[i]
        facts[_NEIGHBOURS] = 0.0
        if sight.teammates != 0:
            start = relation_at(sight.teammates).neighbours.start
            facts[_NEIGHBOURS] = start[i + 1] - start[i]
        x = move.moved[i, 0]
        y = move.moved[i, 1]
        facts[_TRAVELLED] = min(math.sqrt(x * x + y * y) / move.speed[i], 1.0) if move.speed[i] > 0.0 else 0.0
        facts[_ACTIVE] = 1.0
        facts[_REWARD] = sight.last_rewards[i, 0]
        facts[_ENDED] = sight.last_rewards[i, 1]
        if move.active.shape[0] > 0 and not move.active[i]:
            facts[_ACTIVE] = 0.0


@kernel
def _write_world(sight: Any) -> None:
    """Write the facts of the world, from the last row of its history."""
    world = world_at(sight.world)
    row = world.progress[0].row
    facts = sight.of_world
    for fact in range(facts.shape[0]):
        facts[fact] = 0.0
    facts[1] = sight.everybody
    if world.present.shape[1] > HISTORY_COLUMNS:
        facts[1] = 0.0
    for r in range(sight.roles.shape[0]):
        numbers = world.history[row - 1, r] if row > 0 else world.present[r]
        if sight.roles[r] == _COUNTS:
            facts[0] += numbers[2]
            if world.present.shape[1] > HISTORY_COLUMNS:
                relation = relation_at(world.relations[r])
                for g in range(relation.counted.shape[0]):
                    facts[1] += count_active(relation.counted[g])
        elif sight.roles[r] == _TEAMMATES:
            facts[2] += numbers[0]
            facts[3] = max(facts[3], numbers[1])
            facts[4] += count_observers(world.relations[r])


@kernel
def _write_facts(sight: Any) -> None:
    count_sensing(sight.team, sight.after)
    if sight.is_new[0] != 0:
        _keep_targets(sight)
        sight.is_new[0] = 0
    sensed = 0
    gained = 0
    lost = 0
    for body in range(sight.after.shape[0]):
        sensed += sight.after[body] > 0
        gained += sight.after[body] > 0 and sight.before[body] == 0
        lost += sight.after[body] == 0 and sight.before[body] > 0
    for i in range(sight.of_robots.shape[0]):
        facts = sight.of_robots[i]
        for fact in range(_TEAM):
            facts[fact] = 0.0
        facts[_TEAM] = sensed
        facts[_TEAM + 1] = gained
        facts[_TEAM + 2] = lost
        facts[_SHARE] = 0.0
    if sight.targets != 0:
        _write_targets(sight)
    _write_bodies(sight)
    for fact in range(sight.shown.shape[0]):
        for i in range(sight.shown.shape[2]):
            sight.shown[fact, sight.number, i] = sight.of_robots[i, fact]
    _write_world(sight)
    _keep_targets(sight)


@kernel
def _show(address: int) -> int:
    """Write the observations and the facts of a world; return `UNSEEN` if a buffer of the percept is too small."""
    sight = sight_at(address)
    if sight.perceive != 0 and call(sight.perceive, sight.percept) > sight.room:
        return UNSEEN
    call(sight.show, sight.seen)
    _write_facts(sight)
    return DONE


@kernel
def _steer_one(batch: Any, given: Any, steering: Any) -> bool:
    """Write an action for `Steered`; return whether it can be carried out. NaN cannot."""
    if batch.form == HEADING:
        for part in range(3):
            steering[part] = given[part]
        if not is_action(given[0], given[1], given[2]):
            # Any direction is good, but a unit vector is carried out to the last bit.
            length = math.sqrt(given[0] * given[0] + given[1] * given[1])
            steering[0] = given[0] / length if length > _SHORTEST else 0.0
            steering[1] = given[1] / length if length > _SHORTEST else 0.0
        # A distance that is infinite would be limited by the speed, but is a mistake.
        return bool(abs(given[0]) < _LONGEST and abs(given[1]) < _LONGEST and abs(given[2]) < math.inf)
    if batch.form == GRID:
        if not 0.0 <= given[0] < batch.table.shape[0]:
            return False
        steering[0] = batch.table[int(given[0]), 0]
        steering[1] = batch.table[int(given[0]), 1]
        return True
    if batch.form == VECTOR:
        steering[0] = given[0]
        steering[1] = given[1]
    else:
        steering[0] = given[0] * math.pi
        # Halved first: a half is exact, whatever the number.
        steering[1] = 0.5 * given[1] + 0.5
    return bool(abs(given[0]) <= 1.0 and abs(given[1]) <= 1.0)


@kernel
def _find_bad_action(batch: Any) -> int:
    """Write all actions; return 1 + the index of the first that cannot be carried out, or 0."""
    robots = batch.steering.shape[1]
    for w in range(batch.status.shape[0]):
        if batch.status[w] != WAITS:
            for i in range(robots):
                if not _steer_one(batch, batch.given[w, i], batch.steering[w, i]):
                    return int(w * robots + i + 1)
    return 0


@inlined
def _copy(source: int, target: int, size: int) -> None:
    words = size // _WORD
    here = array_at(source, words, np.int64)
    there = array_at(target, words, np.int64)
    for word in range(words):
        there[word] = here[word]
    if size % _WORD != 0:
        first = array_at(source, size, np.uint8)
        second = array_at(target, size, np.uint8)
        for byte in range(words * _WORD, size):
            second[byte] = first[byte]


@kernel
def _load(block: Any, row: int) -> None:
    """Copy the row at an address into the built world."""
    spans = block.spans
    for s in range(spans.shape[0]):
        size = spans[s, 1]
        if spans[s, 2] != 0:
            size *= array_at(spans[s, 2], 1, np.int64)[0]
        _copy(row, spans[s, 0], size)
        row += (size + _WORD - 1) // _WORD * _WORD


@kernel
def _keep(block: Any, row: int) -> None:
    """Copy the state of the built world into the row at an address."""
    spans = block.spans
    for s in range(spans.shape[0]):
        size = spans[s, 1]
        if spans[s, 2] != 0:
            size *= array_at(spans[s, 2], 1, np.int64)[0]
        _copy(spans[s, 0], row, size)
        row += (size + _WORD - 1) // _WORD * _WORD


@kernel
def _show_at(block: Any, w: int) -> None:
    """Let the built world be shown in the arrays of world `w`."""
    for word in range(block.shown.shape[0]):
        array_at(block.shown[word, 0], 1, np.int64)[0] = block.shown[word, 1] + w * block.shown[word, 2]


@kernel
def _end_step(block: Any, w: int) -> None:
    """Log the step that the built world has made for world `w`, and keep its state."""
    world = world_at(sight_at(block.sight).world)
    log = block.log[w, world.progress[0].tick - 1]
    for r in range(log.shape[0]):
        for column in range(log.shape[1]):
            number = world.history[world.progress[0].row - 1, r, column]
            for part in range(log.shape[2]):
                log[r, column, part] = number >> (16 * part) & 0xFFFF
    _keep(block, block.rows + w * block.stride)


@kernel
def _make_step(batch: Any, w: int, address: int) -> int:
    """Make a step of world `w`, which is in the arrays of a record, and show it."""
    sight = sight_at(address)
    progress = world_at(sight.world).progress[0]
    for i in range(sight.state.shape[0]):
        for part in range(3):
            sight.state[i, 0, part] = batch.steering[w, i, part]
    progress.steps = 1
    if call(batch.run, sight.world) != 0:
        return UNFINISHED
    return int(_show(address))


@kernel
def _step_row(batch: Any, w: int) -> int:
    block = block_at(batch.block)
    _load(block, block.rows + w * block.stride)
    _show_at(block, w)
    # The built world has no history, but for the present step.
    world_at(sight_at(block.sight).world).progress[0].row = 0
    status = _make_step(batch, w, block.sight)
    if status == DONE:
        _end_step(block, w)
    return int(status)


def _find_bad(address: int) -> int:
    return int(_find_bad_action(batch_at(address)))


def _step_all(address: int) -> int:
    """Make a step of all worlds; return 1 + the number of a row of the block whose step Python has to complete at once.

    Else return −1 if a world with arrays of its own needs Python, as `status` says, or 0.
    """
    batch = batch_at(address)
    for w in range(batch.next[0], batch.status.shape[0]):
        if batch.status[w] == WAITS:
            continue
        if batch.sights[w] == 0:
            batch.status[w] = _step_row(batch, w)
            if batch.status[w] != DONE:
                batch.next[0] = w + 1
                return int(w + 1)
        elif world_at(sight_at(batch.sights[w]).world).progress[0].tick >= batch.quiet_until[w]:
            batch.status[w] = NEEDS_PYTHON
        else:
            batch.status[w] = _make_step(batch, w, batch.sights[w])
    for w in range(batch.status.shape[0]):
        if batch.status[w] > WAITS:
            return -1
    return 0


def _show_one(address: int) -> int:
    return int(_show(address))


def _begin_rows(address: int) -> int:
    """Begin episodes in rows of a block; return 1 + the number of one that Python has to complete, or 0."""
    start = start_at(address)
    block = block_at(start.block)
    while start.next[0] < start.last[0]:
        w = start.worlds[start.next[0]]
        k = start.starts[start.next[0]]
        start.next[0] += 1
        if start.template != 0:
            _load(block, start.template)
            start.here[0] = start.key[k, 0]
            start.here[1] = start.key[k, 1]
            at = 0
            for g in range(start.groups.shape[0]):
                move = move_at(group_at(start.groups[g]).move)
                for i in range(move.position.shape[0]):
                    for part in range(2):
                        move.position[i, part] = start.position[k, at + i, part]
                        move.heading[i, part] = start.heading[k, at + i, part]
                at += move.position.shape[0]
        _show_at(block, w)
        for phase in range(start.see.shape[0]):
            if call(start.see[phase, 0], start.see[phase, 1]) != 0:
                return int(w + 1)
        if _show(block.sight) != DONE:
            return int(w + 1)
        _keep(block, block.rows + w * block.stride)
    return 0


def _move_row(address: int) -> int:
    row = row_at(address)
    block = block_at(row.block)
    if row.what == LOAD:
        _load(block, block.rows + row.number * block.stride)
        _show_at(block, row.number)
    elif row.what == KEEP:
        _keep(block, block.rows + row.number * block.stride)
    else:
        _end_step(block, row.number)
    return 0


FIND_BAD, STEP_ALL, SHOW, BEGIN_ROWS, MOVE_ROW = map(
    Entry, (_find_bad, _step_all, _show_one, _begin_rows, _move_row)
)
