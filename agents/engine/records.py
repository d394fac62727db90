"""The records of the compiled loop: how a world is laid out in memory; and watchers, which it calls after each step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Sensing
from teamsight.agents.engine.detection import DetectionArrays
from teamsight.agents.engine.due import DueArrays
from teamsight.core.kernel import Entry, Packed, Record
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies.compiled import Decision
from teamsight.world.motion import Move
from teamsight.world.search import Searching
from teamsight.world.shapes import Region

if TYPE_CHECKING:
    from teamsight.agents.engine.binding import Binding
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.group import Group
    from teamsight.core.kernel import Entry, Packed

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]


#: The columns of the history, and those where bodies can be inactive.
HISTORY_COLUMNS, CONDITIONAL_COLUMNS = 3, 5

#: What a phase returns: it is done, or it needs room for this many entries or more, or it cannot be carried out.
DONE, NO_ROOM, FAILED = 0, 1, -1

_PROGRESS = ("tick", "steps", "phase", "row", "trail_row", "halted", "stopped", "body", "what", "where")
PROGRESS = np.dtype([(name, np.int64) for name in _PROGRESS])
"""The state of the loop.

``steps`` are still to be made. ``phase`` is that from which the next one goes on: 0, or one after a move whose
neighbours there was no room for. ``row`` and ``trail_row`` are the next rows of the history and of the recorded
positions. ``halted`` is the phase at which the last call stopped. ``stopped`` is 1 if a watcher has stopped the loop
after a step. ``what`` is wrong after an interaction, with a ``body`` of the role of number ``where``, or with the score
of this number.
"""


class Phase(NamedTuple):
    """A phase of a step.

    Attributes
    ----------
    name : str
        What it does.
    entry, record
        The compiled function, and its argument.
    of : Group, Relation or PlacedInteraction, optional
        What it is about, if it can fail or need room.
    """

    name: str
    entry: Entry
    record: Packed[Any]
    of: Any = None


class PartakerArrays(NamedTuple):
    """The record of a group that takes part in an interaction.

    Attributes
    ----------
    group : Packed of GroupArrays
        Its record.
    before : ndarray, shape (n, 2), float64
        The positions before the present step [length]: what is kept for a step that fails.
    reward, ended : ndarray
        As in `BODIES`.
    last_rewards : ndarray, shape (n, 2), float64
        As in `BODIES`.
    decided_at : ndarray, shape (n,) or (0,), int64
        The tick at which each robot last decided; empty if all decide at every step.
    """

    group: Packed[Any]
    before: Annotated[Floats, "n", 2]
    reward: Annotated[Floats, "n"]
    ended: Annotated[Flags, "n"]
    last_rewards: Annotated[Floats, "n", 2]
    decided_at: Annotated[Integers, "timed"]


class RoleArrays(NamedTuple):
    """The record of a role of an interaction.

    Attributes
    ----------
    partaker : Packed of PartakerArrays
        Its group.
    noise : ndarray, shape (4, draws, lanes), float64
        The random numbers of four ticks.
    members : ndarray, shape (lanes,), int64
        The members to whom they belong.
    stream : int
        Their stream.
    reward, ended : ndarray, shape (n,)
        What the kernel writes in one call.
    """

    partaker: Packed[PartakerArrays]
    noise: Annotated[Floats, "ticks", "draws", "lanes"]
    members: Annotated[Integers, "lanes"]
    stream: int
    reward: Annotated[Floats, "n"]
    ended: Annotated[Flags, "n"]


class InteractionArrays(NamedTuple):
    """The record of an interaction.

    Attributes
    ----------
    kernel, call
        Its kernel, and the record of a call.
    words, turn, moves
        The words of that record; which one holds `turn`; and how those of the noise depend on the tick, see
        `teamsight.core.kernel.record`.
    in_turn : bool
        Whether it is called after the move of each of its groups.
    moves_bodies, changes_bodies, gives : bool
        Whether its kernel writes positions; positions, headings or speeds; and rewards or ends.
    key : ndarray, shape (2,), uint64
        The key of its noise.
    block : ndarray, shape (1,), int64
        The block of four ticks of the noise; −1 for none.
    roles : list of Packed of RoleArrays
        Its roles.
    scores : ndarray, shape (s,), float64
        The scores of this step.
    first_score : int
        The column of the first of them among those of the world.
    region : Region
        Where bodies must be.
    found : ndarray, shape (2,), float64
        What is wrong, after a call that left something wrong.
    """

    kernel: Entry
    call: Packed[Any]
    words: Annotated[Integers, ".words"]
    turn: int
    moves: Annotated[Integers, ".moves", 3]
    in_turn: bool
    moves_bodies: bool
    changes_bodies: bool
    gives: bool
    key: Annotated[npt.NDArray[np.uint64], 2]
    block: Annotated[Integers, 1]
    roles: list[Packed[RoleArrays]]
    scores: Annotated[Floats, "scores"]
    first_score: int
    region: Region
    found: Annotated[Floats, 2]


class TurnArrays(NamedTuple):
    """The record of a call of an interaction.

    Attributes
    ----------
    progress
        As in `WorldArrays`.
    interaction : Packed of InteractionArrays
        The interaction.
    turn : int
        The role whose turn it is; −1 for one that takes no turns.
    """

    progress: Annotated[npt.NDArray[Any], PROGRESS, 1]
    interaction: Packed[InteractionArrays]
    turn: int


class InteractionsArrays(NamedTuple):
    """The record of all interactions.

    Attributes
    ----------
    progress
        As in `WorldArrays`.
    interactions, partakers : list of Packed
        The interactions, and the groups that take part in one.
    scores : ndarray, shape (steps, scores), float64
        The scores of all interactions, for each step.
    """

    progress: Annotated[npt.NDArray[Any], PROGRESS, 1]
    interactions: list[Packed[InteractionArrays]]
    partakers: list[Packed[PartakerArrays]]
    scores: Annotated[Floats, "score rows", "scores"]


PARTAKER = Record(PartakerArrays)
ROLE = Record(RoleArrays)
INTERACTION = Record(InteractionArrays)
TURN = Record(TurnArrays)
INTERACTIONS = Record(InteractionsArrays)

partaker_at, role_at, interaction_at = PARTAKER.at, ROLE.at, INTERACTION.at
turn_at, interactions_at = TURN.at, INTERACTIONS.at


class GroupArrays(NamedTuple):
    """The record of a group: what it does in a step, in this order. An entry is 0 if there is nothing to do.

    Attributes
    ----------
    key : ndarray, shape (2,), uint64
        The key of the noise.
    tick : ndarray, shape (1,), int64
        The present tick.
    noise : ndarray, shape (4, draws, lanes), float64
        The policy's random numbers of four ticks.
    block : ndarray, shape (1,), int64
        The block of four ticks, tick // 4; −1 for none.
    members : ndarray, shape (lanes,), int64
        The members to whom the numbers belong; 0 after the last robot.
    stream : int
        The stream of the numbers.
    perceive, situate, sensing
        The kernels of the degree of awareness, and their record.
    room : int
        The number of entries that `perceive` can write.
    decide, decision
        The policy's kernel and its record.
    due
        The record of the robots that are due, if they are not all; then `decide` and `decision` are None.
    is_sound : bool
        Whether actions need no check.
    advance, move
        The motion and its record.
    """

    key: Annotated[npt.NDArray[np.uint64], 2]
    tick: Annotated[Integers, 1]
    noise: Annotated[Floats, "ticks", "draws", "lanes"]
    block: Annotated[Integers, 1]
    members: Annotated[Integers, "lanes"]
    stream: int
    perceive: Entry | None
    situate: Entry | None
    sensing: Packed[Sensing]
    room: int
    decide: Entry | None
    decision: Packed[Decision] | None
    due: Packed[DueArrays] | None
    is_sound: bool
    advance: Entry
    move: Packed[Move]


class Conditions(NamedTuple):
    """The condition of the observers of a relation; all empty if it never changes for observers and observed.

    Attributes
    ----------
    active, works : ndarray, shape (n,), bool
        Whether each observer is active, and whether its sensor works.
    full : ndarray, shape (n,), float64
        The range of each while both hold [length].
    reach : ndarray, shape (n,), float64
        The range with which the search is made: −1 for an observer that senses nobody.
    """

    active: Annotated[npt.NDArray[np.bool_], ".n"]
    works: Annotated[npt.NDArray[np.bool_], ".n"]
    full: Annotated[Floats, ".n"]
    reach: Annotated[Floats, ".n"]


class RelationArrays(NamedTuple):
    """The record of a relation: one group observes others.

    Attributes
    ----------
    find, search : Entry, Packed of Searching
        The search for neighbours, and its record.
    observers : Packed of GroupArrays
        The observing group.
    groups : list of Packed of GroupArrays
        The observed groups; their positions are copied to `x` and `y` before a search.
    everyone : ndarray, shape (observed,), int64
        The identities of the observed.
    rows : ndarray, shape (observed,), int64
        The index of each of them in `met`.
    met : ndarray, shape (bodies,), int64
        The step, counted from 1, in which each body of the world was last observed by the observers' side; or −1 − tick
        if that was between steps.
    neighbours : NeighbourList
        The result of the search; its identities are indices among the observed.
    identity : ndarray, shape (k,), int64
        The same neighbours by the identities of agents.
    detection : Packed of DetectionArrays or None
        What the sensor makes of them; None for a perfect sensor.
    true_start, true_index : ndarray, shape (n + 1,) and (k,), int64
        The indices of the agents that each observer detects: those of `neighbours`, or what the sensor leaves of them.
    conditions : Conditions
        Which observers sense, and how far.
    counted : list of Packed of GroupArrays
        Of the observed groups, those that are observed in no earlier relation that counts; none if this does not count.
    """

    find: Entry
    search: Packed[Searching]
    observers: Packed[GroupArrays]
    groups: list[Packed[GroupArrays]]
    x: Annotated[Floats, "observed"]
    y: Annotated[Floats, "observed"]
    everyone: Annotated[Integers, "observed"]
    rows: Annotated[Integers, "observed"]
    met: Annotated[Integers, "bodies"]
    neighbours: NeighbourList
    identity: Annotated[Integers, ".k"]
    detection: Packed[DetectionArrays] | None
    true_start: Annotated[Integers, "n + 1"]
    true_index: Annotated[Integers, ".true"]
    conditions: Conditions
    counted: list[Packed[GroupArrays]]


class LogArrays(NamedTuple):
    """The record of a log of transitions.

    Attributes
    ----------
    group, relation
        The recorded group, and the relation in which it senses targets; None if it senses none.
    team : list of Packed
        The relations in which its team senses targets.
    situate, sensing
        The kernel that writes situation vectors, and its record, which is the log's own.
    now : ndarray, shape (n, width), float32
        The vectors that it writes.
    row : ndarray, shape (1,), int64
        The next row of the four arrays that follow.
    kept_start, kept_identity
        The targets sensed before the move; as in `NeighbourList`.
    before, after : ndarray, shape (bodies,), int64
        The number of robots of the team that sense each body of the world, before and after the move.
    last_rewards : ndarray, shape (n, 2) or (0, 2), float64
        As in `BODIES`; empty if the group takes part in no interaction.
    """

    group: Packed[GroupArrays]
    relation: Packed[RelationArrays] | None
    team: list[Packed[RelationArrays]]
    situate: Entry
    sensing: Packed[Sensing]
    now: Annotated[npt.NDArray[np.float32], "n", "width"]
    row: Annotated[Integers, 1]
    situation: Annotated[npt.NDArray[np.float32], "steps", "n", "width"]
    action: Annotated[npt.NDArray[np.float32], "steps", "n", 2]
    next_situation: Annotated[npt.NDArray[np.float32], "steps", "n", "width"]
    facts: Annotated[npt.NDArray[np.float32], "steps", "n", "facts"]
    kept_start: Annotated[Integers, "n + 1"]
    kept_identity: Annotated[Integers, "kept"]
    before: Annotated[Integers, "bodies"]
    after: Annotated[Integers, "bodies"]
    last_rewards: Annotated[Floats, "rewarded", 2]


class WorldArrays(NamedTuple):
    """The record of a world.

    Attributes
    ----------
    moment : ndarray, shape (1,), int64
        The tick of the positions that sensors see.
    time : ndarray, shape (1,), float64
        The present tick, for percepts.
    progress : ndarray of `PROGRESS`, shape (1,)
        The state of the loop.
    groups, relations : list of Packed
        The world's parts.
    history : ndarray, shape (steps, relations, 3 or 5), int64
        For each step and relation: the number of neighbours, the most of one observer, and the number of bodies that
        the observers' side observes in no earlier relation. Where bodies can be inactive, also the number of active
        observers, and of active bodies in `RelationArrays.counted`.
    present : ndarray, shape (relations, 3 or 5), int64
        The same for the present positions, before the first recorded step.
    phases : ndarray, shape (phases, 2), int64
        The phases of a step: the addresses of an entry and of its record.
    move : int
        The first of the phases that move bodies. If a step can fail there or later, it keeps what they write.
    restore : Packed of CopyingArrays or None
        With this record that phase restores it; None if no step can fail.
    """

    moment: Annotated[Integers, 1]
    time: Annotated[Floats, 1]
    progress: Annotated[npt.NDArray[Any], PROGRESS, 1]
    groups: list[Packed[GroupArrays]]
    relations: list[Packed[RelationArrays]]
    history: Annotated[Integers, "steps", "relations", "columns"]
    present: Annotated[Integers, "relations", "columns"]
    phases: Annotated[Integers, "phases", 2]
    move: int
    restore: Packed[CopyingArrays] | None


class CopyingArrays(NamedTuple):
    """The record of arrays to copy.

    Attributes
    ----------
    arrays : ndarray, shape (arrays, 3), int64
        For each array its address, that of the copy, and its size in bytes.
    """

    arrays: Annotated[Integers, "arrays", 3]


class TrailArrays(NamedTuple):
    """The record of recorded positions.

    Attributes
    ----------
    progress
        As in `WorldArrays`.
    groups : list of Packed of GroupArrays
        All groups.
    every : int
        The number of steps from one recording to the next.
    trail : ndarray, shape (rows, bodies, 2), float64
        The recorded positions.
    """

    progress: Annotated[npt.NDArray[Any], PROGRESS, 1]
    groups: list[Packed[GroupArrays]]
    every: int
    trail: Annotated[Floats, "kept steps", "bodies", 2]


class WatchingArrays(NamedTuple):
    """The record of the watchers.

    Attributes
    ----------
    progress
        As in `WorldArrays`.
    watchers : ndarray, shape (watchers, 4), int64
        For each watcher: its entry, its record, whether it sees changes between steps, and what it returned last.
    is_step : bool
        Whether a step was made; else only those are called that see changes between steps.
    """

    progress: Annotated[npt.NDArray[Any], PROGRESS, 1]
    watchers: Annotated[Integers, "watchers", 4]
    is_step: bool


GROUP = Record(GroupArrays)
RELATION = Record(RelationArrays)
LOG = Record(LogArrays)
WORLD = Record(WorldArrays)
COPYING = Record(CopyingArrays)
TRAIL = Record(TrailArrays)
WATCHING = Record(WatchingArrays)

# For kernels: from the address of a record to its arrays.
group_at, relation_at, log_at, world_at = GROUP.at, RELATION.at, LOG.at, WORLD.at
copying_at, trail_at, watching_at = COPYING.at, TRAIL.at, WATCHING.at


class Bound(NamedTuple):
    """What a watcher can read: the groups and neighbour searches of a world as they are bound.

    Attributes
    ----------
    groups, group_records : list of Group, list of Packed of GroupArrays
        The groups and their records, in the same order.
    relations, relation_records : list of Relation, list of Packed of RelationArrays
        The neighbour searches and their records, in the same order.
    first_body : dict of int to int
        For each group's number, the index of its first agent among all bodies, as in ``RelationArrays.met``.
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    """

    groups: list[Group]
    group_records: list[Packed[GroupArrays]]
    relations: list[Relation]
    relation_records: list[Packed[RelationArrays]]
    first_body: dict[int, int]
    moment: npt.NDArray[np.int64]

    def relation(self, observers: Group, channel: str) -> Packed[RelationArrays] | None:
        """Return the record of what a group senses in a channel; None if it has no such channel."""
        for relation, record in zip(self.relations, self.relation_records, strict=True):
            if relation.observers is observers and relation.name == channel:
                return record
        return None


class Watcher:
    """Compiled code that is called after each step: bodies have moved, neighbours are found, the step is recorded.

    ``engine.watch(watcher)`` begins, ``engine.unwatch(watcher)`` ends. Results must not depend on how a run is divided
    into calls, so what changes lies in arrays that the watcher owns and keeps when it is bound again.

    Attributes
    ----------
    entry : Entry
        The compiled function. It takes the address of `record` and returns 0, or another number if the run is to stop
        after this step, so that `happened` is called.
    record : Packed
        The record that `bind` has packed.
    sees_changes : bool
        Whether it is also called before a step when positions, groups or ranges were changed after the last one: by
        an event, or between steps. It must then do nothing if it sees the same world twice.
    """

    entry: Entry
    record: Packed[Any]
    sees_changes: bool = False

    def bind(self, bound: Bound) -> None:
        """Pack `record` from the present arrays.

        Called before the first step, and whenever groups, agents or room for neighbours have changed. Rows may have
        changed since the last call; the column `member` says which agents they are now. It must change nothing else.
        """
        raise NotImplementedError

    def happened(self) -> None:
        """Plan events at the present tick; called after `entry` has stopped a run.

        The events are processed before the next step. Called by Python, after the step is complete; the neighbour lists
        are those of the present positions.
        """
        raise NotImplementedError

    def tidy(self) -> None:
        """End watching by ``engine.unwatch(self)`` if there is nothing to watch; called before steps are made."""

    def forget(self) -> None:
        """Drop what was planned or waited for; called when a world begins anew or goes back to a state."""

    def close(self) -> None:
        """End what depends on the world; called when it is closed."""


def report(binding: Binding) -> bool:
    """Call `happened` of the watchers that have stopped the loop; return whether there are any."""
    if not binding.progress["stopped"][0]:
        return False
    binding.progress["stopped"] = 0
    for watcher, result in zip(list(binding.watchers), binding.watching.value.watchers[:, 3].tolist(), strict=True):
        if result:
            watcher.happened()
    return True
