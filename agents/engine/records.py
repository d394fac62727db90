"""The records of the compiled loop: how a world, its groups and its neighbour searches lie in memory.

`teamsight.agents.engine.binding` fills them, `teamsight.agents.engine.loop` reads them.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.binding import Sensing
from teamsight.core.kernel import Entry, Packed, Record
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies.compiled import Decision
from teamsight.world.motion import Move
from teamsight.world.proximity.search import Searching

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

HISTORY_COLUMNS = 3

#: What a call of the loop returns: done, or why it cannot go on.
DONE, GROW_RELATION, GROW_PERCEPT, BAD_ACTION, OUTSIDE = range(5)

PROGRESS = np.dtype([(name, np.int64) for name in ("tick", "steps", "phase", "row", "trail_row", "where", "need")])
"""How far a world has got: the only numbers that the loop changes.

``steps`` are still to be made. ``phase`` is 1 when bodies have moved and the neighbour lists are still those before.
``row`` and ``trail_row`` are the next rows of the history and of the positions kept. ``where`` is the group or the
relation at which the loop has stopped, ``need`` how many entries it needs room for.
"""


class GroupArrays(NamedTuple):
    """The record of a group: what it does in a step, in this order. An entry is 0 where there is nothing to do.

    Attributes
    ----------
    noise : ndarray, shape (4, draws, lanes), float64
        The policy's random numbers of four ticks.
    block : ndarray, shape (1,), int64
        Which four ticks: the tick // 4; −1 for none.
    members : ndarray, shape (lanes,), int64
        Whose numbers; 0 after the last robot.
    stream : int
        The stream of the numbers.
    perceive, situate, sensing
        The kernels of the degree of awareness, and their record.
    room : int
        How many entries `perceive` can write.
    decide, decision
        The policy's kernel and its record.
    is_sound : bool
        Whether no action needs to be checked.
    advance, move
        The motion and its record.
    """

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
    is_sound: bool
    advance: Entry
    move: Packed[Move]


class Places(NamedTuple):
    """The record of the positions of one observed group."""

    position: Annotated[Floats, "n", 2]


class RelationArrays(NamedTuple):
    """The record of a relation: one group observes others.

    Attributes
    ----------
    search : Packed of Searching
        The search for neighbours.
    groups : list of Packed of Places
        Where the observed groups are; copied to `x` and `y` before a search.
    everyone : ndarray, shape (observed,), int64
        The identities of the observed.
    rows : ndarray, shape (observed,), int64
        Where in `met` each of them is.
    met : ndarray, shape (bodies,), int64
        The step, counted from 1, at which each body of the world was last observed by the observers' side.
    neighbours : NeighbourList
        What was found; its identities are numbers of the observed.
    identity : ndarray, shape (k,), int64
        The same as identities of agents.
    """

    search: Packed[Searching]
    groups: list[Packed[Places]]
    x: Annotated[Floats, "observed"]
    y: Annotated[Floats, "observed"]
    everyone: Annotated[Integers, "observed"]
    rows: Annotated[Integers, "observed"]
    met: Annotated[Integers, "bodies"]
    neighbours: NeighbourList
    identity: Annotated[Integers, ".k"]


class LogArrays(NamedTuple):
    """The record of a log of transitions.

    Attributes
    ----------
    group, relation
        Whose log it is, and the relation in which the group senses targets; None where it senses none.
    team : list of Packed
        The relations in which its team senses targets.
    situate, sensing
        The kernel that writes situation vectors, and its record, which is the log's own.
    now : ndarray, shape (n, width), float32
        Where it writes them.
    row : ndarray, shape (1,), int64
        The next row of the four arrays that follow.
    kept_start, kept_identity
        Whom the robots sensed before the move; as in `NeighbourList`.
    before, after : ndarray, shape (bodies,), int64
        How many robots of the team sense each body of the world, before and after the move.
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


class WorldArrays(NamedTuple):
    """The record of a world.

    Attributes
    ----------
    key : ndarray, shape (2,), uint64
        The key of the noise.
    progress : ndarray of `PROGRESS`, shape (1,)
        How far the world has got.
    groups, relations, logs : list of Packed
        Its parts.
    history : ndarray, shape (steps, relations, 3), int64
        For each step and relation: how many neighbours there are, the most of one observer, and how many of the
        observed are seen for the first time in the step by the observers' side.
    present : ndarray, shape (relations, 3), int64
        The same for the present positions, before the first step that is recorded.
    every : int
        Keep positions each so many steps; 0 for never.
    trail : ndarray, shape (rows, bodies, 2), float64
        The positions kept.
    undo : ndarray, shape (bodies, 6), float64
        Where all bodies were before a move, so that one which leads out of the arena can be undone; empty in arenas
        that are tested.
    """

    key: Annotated[npt.NDArray[np.uint64], 2]
    progress: Annotated[npt.NDArray[Any], PROGRESS, 1]
    groups: list[Packed[GroupArrays]]
    relations: list[Packed[RelationArrays]]
    logs: list[Packed[LogArrays]]
    history: Annotated[Integers, "steps", "relations", HISTORY_COLUMNS]
    present: Annotated[Integers, "relations", HISTORY_COLUMNS]
    every: int
    trail: Annotated[Floats, "kept steps", "bodies", 2]
    undo: Annotated[Floats, "watched", 6]


GROUP = Record(GroupArrays)
PLACES = Record(Places)
RELATION = Record(RelationArrays)
LOG = Record(LogArrays)
WORLD = Record(WorldArrays)

# For kernels: from the address of a record to its arrays.
group_at, places_at, relation_at, log_at, world_at = GROUP.at, PLACES.at, RELATION.at, LOG.at, WORLD.at
