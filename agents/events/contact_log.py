"""The contact log: which agent began and ceased to sense which, and when."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.watching import Bound, Watcher
from teamsight.agents.events.contact_kernel import COLUMNS, CONTACTS, LOG_CONTACTS, ContactArrays
from teamsight.agents.events.places import places
from teamsight.agents.events.source import EventSource
from teamsight.agents.group import Group

Integers = npt.NDArray[np.int64]
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


class ContactLog(EventSource):
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

    def __init__(self, channel: str = TEAMMATES) -> None:
        self.channel = channel

    def begin(self) -> None:
        """Log the present contacts, as begun at this tick, and all changes from now on."""
        group = self._its_group()
        if self.channel not in group.channels:
            have = ", ".join(map(repr, group.channels)) or "none"
            raise ValueError(
                f"channel={self.channel!r}: {group.name} have no such channel, but {have}; declare it with world.senses"
            )
        if "_watcher" not in vars(self):
            self._watcher = ContactWatcher(group, self.channel, self.world._engine)
            self.world._engine.watch(self._watcher)
        self._watcher.begin(self.world.tick)

    def end(self) -> None:
        """Log no more."""
        self.world._engine.unwatch(self._watcher)

    def save(self) -> Any:
        """Return the log and the contacts that were seen last."""
        return self._watcher.save()

    def load(self, data: Any) -> None:
        """Go back to what `save` returned."""
        self._watcher.load(data)

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
        return self._watcher.rows[: self._watcher.length[0]]

    @property
    def contacts(self) -> Contacts:
        """What was logged so far."""
        watcher, rows = self._watcher, self.rows.copy()
        return Contacts(rows[:, 0], rows[:, 1] != 0, rows[:, 2], rows[:, 3], watcher.since, self.world.tick)


class ContactWatcher(Watcher):
    """The arrays of a contact log; `CONTACTS` describes them."""

    entry = LOG_CONTACTS
    sees_changes = True

    def __init__(self, group: Group, channel: str, engine: Any) -> None:
        self._group, self._channel, self._engine = group, channel, engine
        self.begin(0)

    def begin(self, tick: int) -> None:
        """Begin to log at a tick; no contacts have been seen."""
        self.since = tick
        self.rows, self.length = np.zeros((_FEWEST, len(COLUMNS)), np.int64), np.zeros(1, np.int64)
        self._set_seen(np.zeros((0, 2), np.int64))
        self._engine.rewatch()

    def _set_seen(self, seen: Integers) -> None:
        """Set the contacts that were seen last, by identities; the next `bind` finds their rows."""
        self._seen = seen
        self._observers = self._observed = np.zeros(0, np.int64)
        self._start, self._index = np.zeros(1, np.int64), np.zeros(0, np.int64)
        self._gone, self._gone_length = np.zeros((0, 2), np.int64), np.zeros(1, np.int64)

    def seen(self) -> Integers:
        """Return the contacts that were seen last and not logged as ended, shape (k, 2): their identities, in order."""
        rows = np.repeat(np.arange(len(self._observers)), np.diff(self._start))
        index = self._index[: self._start[-1]]
        present = np.stack([self._observers[rows], self._observed[index]], axis=1)
        found = np.concatenate([self._seen, self._gone[: self._gone_length[0]], present])
        return found[np.lexsort((found[:, 1], found[:, 0]))]

    def bind(self, bound: Bound) -> None:
        """Find the rows of the contacts that were seen last, and make room."""
        seen = self.seen()
        packed = bound.relation(self._group, self._channel)
        relation = None if packed is None else self._group.relations[self._channel]
        self._seen = np.zeros((0, 2), np.int64)
        self._observers = self._group.bodies.identity.copy()
        self._observed = np.zeros(0, np.int64) if relation is None else relation.everyone.copy()
        row, index = places(self._observers, seen[:, 0]), places(self._observed, seen[:, 1])
        stays = (row >= 0) & (index >= 0)
        self._gone, self._gone_length = seen[~stays], np.array([(~stays).sum()])
        row, index = row[stays], index[stays]
        order = np.lexsort((index, row))
        self._start = np.searchsorted(row[order], np.arange(len(self._observers) + 1))
        in_range = self._channel == TEAMMATES
        room = 0
        if relation is not None:
            room = len(relation.search.room.identity if in_range else relation.true_lists[1])
        self._index = np.zeros(max(room, len(order)), np.int64)
        self._index[: len(order)] = index[order]
        self._make_room(len(seen) + len(self._index))
        self.record = CONTACTS.pack(ContactArrays(
            bound.moment, packed, in_range, self._observers, self._observed, self._start, self._index, self._gone,
            self._gone_length, self.rows, self.length,
        ))  # fmt: skip

    def happened(self) -> None:
        """Make room for more rows."""
        self._make_room(int(self._start[-1]) + len(self._index))
        self._engine.rewatch()

    def _make_room(self, more: int) -> None:
        need = int(self.length[0]) + more
        if need > len(self.rows):
            longer = np.zeros((2 * need, len(COLUMNS)), np.int64)
            longer[: self.length[0]] = self.rows[: self.length[0]]
            self.rows = longer

    def save(self) -> tuple[int, Integers, Integers]:
        """Return what `load` needs."""
        return self.since, self.rows[: self.length[0]].copy(), self.seen()

    def load(self, data: tuple[int, Integers, Integers]) -> None:
        """Go back to what `save` returned."""
        self.since, rows, seen = data
        self.rows, self.length = rows.copy(), np.full(1, len(rows))
        self._set_seen(seen.copy())
        self._engine.rewatch()
