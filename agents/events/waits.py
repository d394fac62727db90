"""Waits: the events of a world for which processes wait, watched by compiled code; see `Until`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.records import relation_at
from teamsight.agents.engine.watching import Bound, Watcher
from teamsight.core.kernel import Entry, Record, kernel
from teamsight.world.awaited import Kept

if TYPE_CHECKING:
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.world_data import WorldData

OBSERVED, CONTACT, NOTHING, OVER = range(4)
_FEWEST = 8


class WaitArrays(NamedTuple):
    """The record of the waits.

    Attributes
    ----------
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    rows : ndarray, shape (room, 7), int64
        For each wait: what for (`OBSERVED`, `CONTACT`, `NOTHING` if no such channel is left, so that it is not so, or
        `OVER` if an agent has left); the address of a relation; the row of the observer, or the index of the observed
        body in `met`; the index of the other agent, or −1 for any; whether the channel is that of teammates in range;
        whether it is to be so, or no longer; and, as the result, whether it has come.
    length : ndarray, shape (1,), int64
        The number of waits.
    """

    moment: Annotated[npt.NDArray[np.int64], 1]
    rows: Annotated[npt.NDArray[np.int64], "room", 7]
    length: Annotated[npt.NDArray[np.int64], 1]


WAITS = Record(WaitArrays)
waits_at = WAITS.at


@kernel
def _has_contact(address: int, row: int, other: int, in_range: int) -> bool:
    """Whether an observer has an agent, or a certain one, in range or senses it."""
    relation = relation_at(address)
    start, index = relation.true_start, relation.true_index
    if in_range != 0:
        start, index = relation.neighbours.start, relation.neighbours.identity
    if other < 0:
        return bool(start[row + 1] > start[row])
    for k in range(start[row], start[row + 1]):  # noqa: SIM110 (kernels have no generators)
        if index[k] == other:
            return True
    return False


@kernel
def _is_observed(address: int, body: int, tick: int) -> bool:
    # After a step, or before one; see `_finish` and `_see` in the loop.
    met = relation_at(address).met[body]
    return bool(met == -1 - tick or (tick > 0 and met == tick))


def _wait(address: int) -> int:
    waits = waits_at(address)
    rows = waits.rows
    found = 0
    for w in range(waits.length[0]):
        is_so = False
        if rows[w, 0] == OBSERVED:
            is_so = _is_observed(rows[w, 1], rows[w, 2], waits.moment[0])
        elif rows[w, 0] == CONTACT:
            is_so = _has_contact(rows[w, 1], rows[w, 2], rows[w, 3], rows[w, 4])
        rows[w, 6] = rows[w, 0] == OVER or is_so == (rows[w, 5] != 0)
        found += rows[w, 6]
    return found


WAIT = Entry(_wait)


class Aim(Protocol):
    """What is waited for."""

    def place(self, bound: Bound) -> tuple[int, int, int, int, int, int]:
        """Return the first six numbers of a row of `WaitArrays`."""
        ...

    def has_come(self) -> bool:
        """Whether it is so now."""
        ...

    def value(self) -> Any:
        """Return the value of the event, once it has come."""
        ...

    def lost(self) -> Exception | None:
        """Return why it can no longer come."""
        ...


class Wait:
    """One event, which happens when its aim has come."""

    def __init__(self, aim: Aim, event: Any) -> None:
        self.aim = aim
        self._kept = Kept(event)

    @property
    def is_forgotten(self) -> bool:
        """Whether nobody can ever wait for the event, or it has happened."""
        event = self._kept.event()
        return event is None or event.triggered

    def end(self) -> None:
        """Let the event happen, with its value or with the error that it cannot."""
        event, error = self._kept.event(), self.aim.lost()
        if event is None or event.triggered:
            return
        if error is None:
            event.succeed(self.aim.value())
            return
        # An event that nobody waits for must not stop the run.
        if not event.callbacks.is_awaited:
            event.defused = True
        event.fail(error)


class Waits(Watcher):
    """All events of a world for which processes wait."""

    entry = WAIT
    sees_changes = True

    def __init__(self, data: WorldData, engine: Engine) -> None:
        self._data, self._engine = data, engine
        self.waits: list[Wait] = []
        self._bound: Bound | None = None
        self._is_watching = False
        self._rows, self._length = np.zeros((_FEWEST, 7), np.int64), np.zeros(1, np.int64)

    def add(self, aim: Aim, event: Any) -> None:
        """Let an event happen at the first tick at which its aim has come."""
        self.waits.append(Wait(aim, event))
        if not self._is_watching:
            self._is_watching = True
            self._engine.watch(self)
        elif self._bound is None or not self._engine.is_bound or len(self.waits) > len(self._rows):
            self._engine.rewatch()
        else:
            self._rows[len(self.waits) - 1, :6] = aim.place(self._bound)
            self._length[0] = len(self.waits)

    def bind(self, bound: Bound) -> None:
        """Write the rows of all waits."""
        self._bound = bound
        if len(self.waits) > len(self._rows):
            self._rows = np.zeros((2 * len(self.waits), 7), np.int64)
        self._write(bound)
        self.record = WAITS.pack(WaitArrays(bound.moment, self._rows, self._length))

    def _write(self, bound: Bound) -> None:
        for row, wait in zip(self._rows, self.waits, strict=False):
            row[:6] = wait.aim.place(bound)
        self._length[0] = min(len(self.waits), len(self._rows))

    def happened(self) -> None:
        """Let those events happen whose aim has come, in the order in which they were asked for."""
        come = self._rows[: self._length[0], 6].tolist()
        # Those after them have no row yet.
        placed, rest = self.waits[: len(come)], self.waits[len(come) :]
        ended = [wait for wait, is_so in zip(placed, come, strict=True) if is_so]
        self._keep([wait for wait, is_so in zip(placed, come, strict=True) if not is_so] + rest)
        for wait in ended:
            wait.end()

    def tidy(self) -> None:
        """Drop the events that nobody waits for; without any, the loop is not slowed down."""
        if any(wait.is_forgotten for wait in self.waits):
            self._keep([wait for wait in self.waits if not wait.is_forgotten])
        if not self.waits:
            self._is_watching, self._bound = False, None
            self._engine.unwatch(self)

    def forget(self) -> None:
        """Drop all: no waiting process continues after a jump of the clock."""
        self._keep([])

    def _keep(self, waits: list[Wait]) -> None:
        self.waits = waits
        if self._bound is not None and self._engine.is_bound:
            self._write(self._bound)
        else:
            self._length[0] = len(waits)
