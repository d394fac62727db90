"""The compiled part of the observation counts: after each step, who was there, who was observed, and by how many."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.records import GroupArrays, RelationArrays, group_at, relation_at
from teamsight.core.kernel import Entry, Packed, Record, kernel
from teamsight.world.motion import move_at

Integers = npt.NDArray[np.int64]

#: The columns of the counts: steps in which a target was present and active, in which a robot sensed it, and the sum
#: over these of the number of robots that did.
COLUMNS = ("steps", "observed", "sightings")
_STEPS, _OBSERVED, _SIGHTINGS = range(3)


class ObservationArrays(NamedTuple):
    """The record of observation counts.

    Attributes
    ----------
    relations : list of Packed of RelationArrays
        The relations that count in the observed fraction.
    same : ndarray, shape (relations,), int64
        For each, the first of them with the same observers.
    groups : list of Packed of GroupArrays
        The groups that are observed in any of them, each once.
    first : ndarray, shape (groups,), int64
        The index of the first agent of each among all bodies.
    observers : ndarray, shape (1,), int64
        The number of observers that were looked at so far, over all steps.
    last : ndarray, shape (bodies, 2), int64
        For each body, the value of `observers` when it was last counted, and at the beginning of that step.
    counts : ndarray, shape (bodies, 3), int64
        See `COLUMNS`.
    """

    relations: list[Packed[RelationArrays]]
    same: Annotated[Integers, "relations"]
    groups: list[Packed[GroupArrays]]
    first: Annotated[Integers, "groups"]
    observers: Annotated[Integers, 1]
    last: Annotated[Integers, "bodies", 2]
    counts: Annotated[Integers, "bodies", 3]


OBSERVATIONS = Record(ObservationArrays)
observations_at = OBSERVATIONS.at


@kernel
def _count_of(address: int, i: int, before: int, here: Any) -> None:
    """Count what observer `i` of a relation senses, each body once for this observer."""
    relation = relation_at(address)
    number = here.observers[0]
    for k in range(relation.true_start[i], relation.true_start[i + 1]):
        body = relation.rows[relation.true_index[k]]
        if here.last[body, 0] != number:
            here.counts[body, _SIGHTINGS] += 1
            here.counts[body, _OBSERVED] += here.last[body, 1] != before
        here.last[body, 0] = number
        here.last[body, 1] = before


@kernel
def _count_present(address: int, first: int, counts: Any) -> None:
    """Count the active bodies of a group."""
    move = move_at(group_at(address).move)
    has_inactive = move.active.shape[0] > 0
    for j in range(move.position.shape[0]):
        counts[first + j, _STEPS] += not has_inactive or move.active[j]


def _count(address: int) -> int:
    here = observations_at(address)
    # No step begins with the number with which another began, since a step without observers counts nothing.
    before = here.observers[0]
    for a in range(here.same.shape[0]):
        if here.same[a] != a:
            continue
        for i in range(relation_at(here.relations[a]).true_start.shape[0] - 1):
            here.observers[0] += 1
            for b in range(a, here.same.shape[0]):
                if here.same[b] == a:
                    _count_of(here.relations[b], i, before, here)
    for g in range(here.first.shape[0]):
        _count_present(here.groups[g], here.first[g], here.counts)
    return 0


COUNT_OBSERVATIONS = Entry(_count)
