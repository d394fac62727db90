"""The records with which one compiled call steps many worlds; `teamsight.env.loop` reads them."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Sensing
from teamsight.agents.engine.records import GroupArrays, RelationArrays, WorldArrays
from teamsight.core.kernel import Entry, Packed, Record

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: What was done with a world: its step is made; nothing, since it waits; nothing, since its step needs Python; the loop
#: stopped within the step; the step is made, but there was no room to show it.
DONE, WAITS, NEEDS_PYTHON, UNFINISHED, UNSEEN = range(5)


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
    show, seen : Entry, Packed of Sensing
        The kernel that writes the observations, and its record.
    of_robots : ndarray, shape (robots, facts), float64
        The facts of the robots; see `Facts`.
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
    seen: Packed[Sensing]
    of_robots: Annotated[Floats, "robots", "facts"]
    of_world: Annotated[Floats, "world facts"]
    kept_start: Annotated[Integers, "robots + 1"]
    kept_index: Annotated[Integers, "kept"]
    before: Annotated[Integers, "bodies"]
    after: Annotated[Integers, "bodies"]
    is_new: Annotated[Integers, 1]
    last_rewards: Annotated[Floats, "robots", 2]


class BatchArrays(NamedTuple):
    """The record of many worlds.

    Attributes
    ----------
    run : Entry
        The compiled loop of a world.
    sights : list of Packed of SightArrays
        The worlds.
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
    """

    run: Entry
    sights: list[Packed[SightArrays]]
    form: int
    table: Annotated[Floats, "actions", 2]
    given: Annotated[Floats, "worlds", "robots", "parts"]
    steering: Annotated[Floats, "worlds", "robots", 3]
    quiet_until: Annotated[Integers, "worlds"]
    status: Annotated[Integers, "worlds"]


SIGHT = Record(SightArrays)
BATCH = Record(BatchArrays)

# For kernels: from the address of a record to its arrays.
sight_at: Any = SIGHT.at
batch_at: Any = BATCH.at
