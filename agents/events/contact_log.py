"""Contacts: which agent begins and ceases to sense which, as a log, as a table, and as rows of the event log."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.channel import TEAMMATES, channel_of
from teamsight.agents.engine.records import Bound, RelationArrays, relation_at
from teamsight.agents.events.sources import EventLog, LoggedEvent, Watching
from teamsight.core.kernel import Entry, Packed, Record, kernel
from teamsight.core.table import Field, Table

Integers = npt.NDArray[np.int64]


def places(known: Integers, wanted: Integers) -> Integers:
    """Return the index of each wanted number among the known ones; −1 for those that are not there."""
    order = np.argsort(known, kind="stable")
    at = np.searchsorted(known[order], wanted)
    found: Integers = order[np.minimum(at, len(known) - 1)] if len(known) else np.full(len(wanted), -1)
    return np.where(known[found] == wanted, found, -1) if len(known) else found


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


_FEWEST = 256


class Contacts(NamedTuple):
    """The beginnings and ends of contacts, in order of time.

    Attributes
    ----------
    tick : ndarray, shape (k,), int64
        When: the tick at which the neighbour lists showed it first.
    begun : ndarray, shape (k,), bool
        Whether the contact has begun; False if it has ended.
    observer, observed : ndarray, shape (k,), int64
        The `unique_id` of both agents. A contact of two teammates that sense each other is two: one in each direction.
    since, until : int
        The ticks between which contacts were logged. What begins at `since` had been so before, perhaps; what has not
        ended lasts at `until`.
    """

    tick: Integers
    begun: npt.NDArray[np.bool_]
    observer: Integers
    observed: Integers
    since: int
    until: int


class ContactLog(Watching):
    """Logs the contacts of a group in a channel, in compiled code; `World.log_contacts` attaches it.

    Parameters
    ----------
    channel : str
        "teammates": those within awareness range, as in `Body.neighbours`. Other channels: those that are sensed.

    Raises
    ------
    ValueError
        When attached, if the group has no such channel.

    Attributes
    ----------
    contacts : Contacts
        What was logged so far. A reset begins anew.
    """

    entry = LOG_CONTACTS
    sees_changes = True

    def __init__(self, channel: str = TEAMMATES) -> None:
        self.channel = channel

    def begin(self) -> None:
        """Log the present contacts, as begun at this tick, and all changes from now on."""
        channel_of(self._its_group(), self.channel, f"channel={self.channel!r}")
        self.load((self.world.tick, np.zeros((0, len(COLUMNS)), np.int64), np.zeros((0, 2), np.int64)))

    def save(self) -> tuple[int, Integers, Integers]:
        """Return since when contacts are logged, the log, and the contacts that were seen last."""
        return self._since, self.rows.copy(), self._last_seen()

    def load(self, data: tuple[int, Integers, Integers]) -> None:
        """Go back to what `save` returned."""
        self._since, rows, seen = data
        self._log = Table([Field("contact", np.int64, (len(COLUMNS),))], room=_FEWEST)
        self._log.append(len(rows), {"contact": rows})
        self._length = np.full(1, len(rows))
        # By identities; the next `bind` finds their rows.
        self._seen = seen.copy()
        self._observers = self._observed = np.zeros(0, np.int64)
        self._start, self._index = np.zeros(1, np.int64), np.zeros(0, np.int64)
        self._gone, self._gone_length = np.zeros((0, 2), np.int64), np.zeros(1, np.int64)
        self.world._engine.rewatch()

    @property
    def observers(self) -> str:
        """The name of the group whose contacts are logged."""
        return self._its_group().name

    @property
    def counts(self) -> bool:
        """Whether what is sensed in the channel counts in the observed fraction."""
        return self._its_group().channels[self.channel].counts

    @property
    def rows(self) -> Integers:
        """What was logged so far, shape (k, 4), with the columns `COLUMNS`: a view that the next steps may change."""
        self._log.count(int(self._length[0]))
        return self._log.contact

    @property
    def contacts(self) -> Contacts:
        """What was logged so far."""
        rows = self.rows.copy()
        return Contacts(rows[:, 0], rows[:, 1] != 0, rows[:, 2], rows[:, 3], self._since, self.world.tick)

    def _last_seen(self) -> Integers:
        """Return the contacts that were seen last and not logged as ended, shape (k, 2): their identities, in order."""
        rows = np.repeat(np.arange(len(self._observers)), np.diff(self._start))
        index = self._index[: self._start[-1]]
        present = np.stack([self._observers[rows], self._observed[index]], axis=1)
        found = np.concatenate([self._seen, self._gone[: self._gone_length[0]], present])
        return found[np.lexsort((found[:, 1], found[:, 0]))]

    def bind(self, bound: Bound) -> None:
        """Find the rows of the contacts that were seen last, and make room."""
        seen, group = self._last_seen(), self._its_group()
        packed = bound.relation(group, self.channel)
        relation = None if packed is None else group.relations[self.channel]
        self._seen = np.zeros((0, 2), np.int64)
        self._observers = group.bodies.identity.copy()
        self._observed = np.zeros(0, np.int64) if relation is None else relation.everyone.copy()
        row, index = places(self._observers, seen[:, 0]), places(self._observed, seen[:, 1])
        stays = (row >= 0) & (index >= 0)
        self._gone, self._gone_length = seen[~stays], np.array([(~stays).sum()])
        row, index = row[stays], index[stays]
        order = np.lexsort((index, row))
        self._start = np.searchsorted(row[order], np.arange(len(self._observers) + 1))
        in_range = self.channel == TEAMMATES
        room = 0
        if relation is not None:
            room = len(relation.search.room.identity if in_range else relation.true_lists[1])
        self._index = np.zeros(max(room, len(order)), np.int64)
        self._index[: len(order)] = index[order]
        self._make_room(len(seen) + len(self._index))
        self.record = CONTACTS.pack(ContactArrays(
            bound.moment, packed, in_range, self._observers, self._observed, self._start, self._index, self._gone,
            self._gone_length, self._log.whole("contact"), self._length,
        ))  # fmt: skip

    def happened(self) -> None:
        """Make room for more rows."""
        self._make_room(int(self._start[-1]) + len(self._index))
        self.world._engine.rewatch()

    def _make_room(self, more: int) -> None:
        self._log.count(int(self._length[0]))
        self._log.make_room(more, most_spare=None)


def contact_table(sources: Iterable[Any]) -> pd.DataFrame:
    """Return the contacts of the contact logs among event sources; see `World.contacts`."""
    logs = [source for source in sources if isinstance(source, ContactLog)]
    logged = [log.contacts for log in logs]
    rows = [len(one.tick) for one in logged]

    def joined(name: str, dtype: Any) -> Any:
        return np.concatenate([np.zeros(0, dtype), *(getattr(one, name) for one in logged)])

    return pd.DataFrame({
        "tick": joined("tick", np.int64),
        "begun": joined("begun", np.bool_),
        "group": np.repeat(np.array([log.observers for log in logs], object), rows),
        "channel": np.repeat(np.array([log.channel for log in logs], object), rows),
        "observer": joined("observer", np.int64),
        "observed": joined("observed", np.int64),
    })  # fmt: skip


class Observations(NamedTuple):
    """When agents began to be observed by any, and ceased to be: arrays of shape (k,), by tick and then by agent.

    Attributes
    ----------
    tick : ndarray, int64
        When.
    begun : ndarray, bool
        Whether it is now observed; False if it is no longer.
    observed : ndarray, int64
        The `unique_id` of the agent.
    """

    tick: npt.NDArray[np.int64]
    begun: npt.NDArray[np.bool_]
    observed: npt.NDArray[np.int64]


def observations(logs: Iterable[ContactLog]) -> Observations:
    """Return when agents were observed by at least one of the observers of these logs, and when no longer."""
    rows = np.concatenate([np.zeros((0, len(COLUMNS)), np.int64), *(log.rows for log in logs)])
    tick, begun, _, observed = rows.T
    # Of all observers that an agent gains and loses at a tick, only their number afterwards counts.
    change = pd.Series(2 * begun - 1).groupby([observed, tick]).sum()
    is_so = change.groupby(level=0).cumsum() > 0
    changed = is_so[is_so != is_so.groupby(level=0).shift(fill_value=False)].sort_index(level=[1, 0])
    observed, tick = (changed.index.get_level_values(level).to_numpy() for level in (0, 1))
    return Observations(tick, changed.to_numpy(), observed)


CONTACT = {True: "contact begun", False: "contact ended"}
OBSERVED = {True: "observed", False: "not observed"}


def with_contacts(log: EventLog, sources: Iterable[Any], agents: Iterable[Any]) -> EventLog:
    """Return an event log with the rows of the contact logs among event sources; the same log if there are none.

    At equal times contacts come first: they are what the last step has led to, and events follow it.

    Parameters
    ----------
    log : EventLog
        The other events.
    sources : iterable of EventSource
        The sources of the world.
    agents : iterable of Body
        Its present agents; the groups of those that have left are found in the log.
    """
    logs = [source for source in sources if isinstance(source, ContactLog)]
    if not logs:
        return log
    groups = {row.agent: row.group for row in log.rows if row.agent is not None}
    groups.update((agent.unique_id, agent.group.name) for agent in agents)
    name, rows = ContactLog.__name__, []
    for one in logs:
        for tick, begun, observer, other in one.rows.tolist():
            details = {"other": other, "channel": one.channel}
            rows.append(LoggedEvent(float(tick), tick, CONTACT[begun], one.observers, observer, name, details))
    seen = observations(one for one in logs if one.counts)
    for tick, begun, agent in zip(*(array.tolist() for array in seen), strict=True):
        rows.append(LoggedEvent(float(tick), tick, OBSERVED[begun], groups.get(agent), agent, name, {}))
    return EventLog(sorted([*rows, *log.rows], key=lambda row: row.time))
