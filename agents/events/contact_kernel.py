"""The compiled part of a contact log: compare each step's neighbour lists with those before, and append changes."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.records import RelationArrays, relation_at
from teamsight.core.kernel import Entry, Packed, Record, kernel

Integers = npt.NDArray[np.int64]

#: The columns of a row: the tick, 1 for begun and 0 for ended, and the `unique_id` of the observer and of the observed.
COLUMNS = ("tick", "begun", "observer", "observed")


class ContactArrays(NamedTuple):
    """The record of a contact log.

    Attributes
    ----------
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    relation : Packed of RelationArrays or None
        What the group senses; None if it has lost the channel, so that it senses nobody.
    in_range : bool
        Whether contacts are with all in range, or with those that are sensed.
    observers, observed : ndarray, shape (n,) and (m,), int64
        The identities of the observers, and of those whom they may sense.
    start, indices : ndarray, shape (n + 1,) and (kept,), int64
        The contacts that were seen last, as in `NeighbourList`.
    gone : ndarray, shape (gone, 2), int64
        Contacts that were seen last, of which one agent has left: the identities of observer and observed.
    gone_length, length : ndarray, shape (1,), int64
        The number of rows of `gone`, and of `rows`.
    rows : ndarray, shape (room, 4), int64
        The log; see `COLUMNS`.
    """

    moment: Annotated[Integers, 1]
    relation: Packed[RelationArrays] | None
    in_range: bool
    observers: Annotated[Integers, "n"]
    observed: Annotated[Integers, "m"]
    start: Annotated[Integers, "n + 1"]
    indices: Annotated[Integers, "kept"]
    gone: Annotated[Integers, "gone", 2]
    gone_length: Annotated[Integers, 1]
    rows: Annotated[Integers, "room", 4]
    length: Annotated[Integers, 1]


CONTACTS = Record(ContactArrays)
contacts_at = CONTACTS.at


@kernel
def _append(contacts: Any, begun: int, observer: int, observed: int) -> None:
    row = contacts.rows[contacts.length[0]]
    row[0] = contacts.moment[0]
    row[1] = begun
    row[2] = observer
    row[3] = observed
    contacts.length[0] += 1


@kernel
def _append_ended(contacts: Any) -> None:
    """Log the contacts that have ended because an agent has left, or the channel is no more."""
    for k in range(contacts.gone_length[0]):
        _append(contacts, 0, contacts.gone[k, 0], contacts.gone[k, 1])
    contacts.gone_length[0] = 0


@kernel
def _compare(contacts: Any, start: Any, index: Any) -> None:
    """Log the differences of the contacts seen last and the present ones, both in ascending order; keep these."""
    old_start, old_index = contacts.start, contacts.indices
    for i in range(contacts.observers.shape[0]):
        k = start[i]
        old = old_start[i]
        while k < start[i + 1] or old < old_start[i + 1]:
            is_now = k < start[i + 1] and (old >= old_start[i + 1] or index[k] <= old_index[old])
            was_then = old < old_start[i + 1] and (k >= start[i + 1] or old_index[old] <= index[k])
            if is_now and not was_then:
                _append(contacts, 1, contacts.observers[i], contacts.observed[index[k]])
            if was_then and not is_now:
                _append(contacts, 0, contacts.observers[i], contacts.observed[old_index[old]])
            k += is_now
            old += was_then
    # Only now, because the old rows are read above.
    for i in range(old_start.shape[0]):
        old_start[i] = start[i]
    for k in range(start[start.shape[0] - 1]):
        old_index[k] = index[k]


def _log(address: int) -> int:
    contacts = contacts_at(address)
    _append_ended(contacts)
    if contacts.relation != 0:
        relation = relation_at(contacts.relation)
        if contacts.in_range:
            _compare(contacts, relation.neighbours.start, relation.neighbours.identity)
        else:
            _compare(contacts, relation.true_start, relation.true_index)
    # In the next step all these can end and as many begin as there is room for.
    most = contacts.start[contacts.start.shape[0] - 1] + contacts.indices.shape[0]
    return 1 if contacts.length[0] + most > contacts.rows.shape[0] else 0


LOG_CONTACTS = Entry(_log)
