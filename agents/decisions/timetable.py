"""The timetable of a group: when each robot decides next and by which policy, and the actions on their way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.decisions.cycle import EVERY_STEP, RANDOM, ROUNDING, Cycle, CycleNumbers, drawn_phases
from teamsight.agents.fixed import put
from teamsight.agents.group import Group
from teamsight.core.table import Field, Table
from teamsight.world.noise import Stream, stream_number, uniforms

if TYPE_CHECKING:
    from teamsight.agents.world_data import WorldData

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Key = npt.NDArray[np.uint64]

_CYCLE = (
    Field("period", fill=1.0, reset="first", unit="ticks"),
    Field("phase", reset="first", unit="ticks"),
    Field("jitter", reset="first", unit="ticks"),
    Field("is_random", np.bool_, fill=False, reset="first"),
    Field("delay", np.int64, reset="first", unit="ticks"),
)
#: The columns of a timetable, besides its slots.
TIMETABLE = (
    *_CYCLE,
    # Origin and phase of each cycle.
    Field("start", unit="ticks"),
    # How often each robot has sensed, or would have if it had been active, since the origin.
    Field("sensings", np.int64),
    # The ticks at which each robot decides next and has last decided; −1 for none.
    Field("next_at", np.int64),
    Field("decided_at", np.int64, fill=-1, reset="fill"),
    # The displacement since the last decision: without that of the last step; and as it was at the begin of a step.
    Field("trip", shape=(2,), reset="fill", unit="length"),
    Field("travelled", shape=(2,), reset="fill", unit="length"),
    # The policy of each robot: its index in `Group.policies`.
    Field("policy", np.int64, reset="fill"),
)
_SLOTS = ("arrives_at", "waiting")

# The columns that a step changes.
_CHANGING = ("sensings", "next_at", "decided_at", "trip", "aim", "distance", *_SLOTS)


class Timetable:
    """The timetable of a group: the columns `TIMETABLE` of its table, as attributes.

    Robots need one if not all decide at every step, or not by the same policy. Of actions on their way, that of tick t
    is in slot ``t % slots``: `arrives_at`, shape (n, slots), int64, the ticks at which they take effect, and `waiting`,
    shape (n, slots, 3), float64, heading and distance. There are no slots without delays.

    Parameters
    ----------
    group : Group
        The group; the columns are declared in its tables.
    numbers : CycleNumbers
        The cycles of its robots, with which its members begin runs too.
    decided_at : ndarray, shape (n,), int64
        The tick at which each last decided.
    """

    def __init__(self, group: Group, numbers: CycleNumbers, decided_at: Integers) -> None:
        self._number, self._bodies, self._members = group.number, group.bodies, group.members
        for field in TIMETABLE:
            self._bodies.declare(field)
        self._declare_slots(0)
        self._bodies.decided_at[:] = decided_at
        given = numbers if len(group) else EVERY_STEP.numbers(1)
        for field, values in zip(_CYCLE, given, strict=True):
            # Those that have left have the first's, which nobody reads.
            self._members.declare(field, np.resize(values, len(self._members)))
        self.set_numbers(numbers)

    def __getattr__(self, name: str) -> npt.NDArray[Any]:
        if name.startswith("__") or name == "_bodies":
            raise AttributeError(name)
        return self._bodies[name]

    def drop(self) -> None:
        """Remove the columns."""
        names = [field.name for field in TIMETABLE]
        self._bodies.drop(*names, *_SLOTS)
        self._members.drop(*names)

    @property
    def numbers(self) -> CycleNumbers:
        """The cycles of the robots."""
        return _numbers_in(self._bodies)

    def set_numbers(self, numbers: CycleNumbers) -> None:
        """Let robots have other cycles, in later runs too; `begin` begins them."""
        for field, values in zip(_CYCLE, numbers, strict=True):
            self._bodies[field.name][:] = values
            self._members[field.name][self._bodies.member] = values

    def begin(self, rows: Any, key: Key, tick: int) -> bool:
        """Begin the cycles of some rows at a tick; return whether the slots were replaced."""
        bodies, stream = self._bodies, stream_number(Stream.CYCLE, self._number)
        numbers, mine = CycleNumbers._make(one[rows] for one in self.numbers), bodies.member[rows]
        bodies.start[rows] = tick + drawn_phases(numbers, key, stream, mine)
        bodies.sensings[rows] = 0
        first = bodies.start[rows] + numbers.jitter * uniforms(key, stream, 0, mine, 1)[0]
        bodies.next_at[rows] = np.ceil(first - ROUNDING).astype(np.int64)
        return self._make_slots()

    def go_on(self, key: Key, tick: int) -> None:
        """Let robots whose cycle begins at a tick at which they had decided, in a step that failed, decide after it."""
        stream, bodies = stream_number(Stream.CYCLE, self._number), self._bodies
        for i in np.flatnonzero((bodies.decided_at == tick) & (bodies.next_at <= tick)):
            while bodies.next_at[i] <= tick:
                bodies.sensings[i] += 1
                drawn = uniforms(key, stream, int(bodies.sensings[i]), bodies.member[i : i + 1], 1)[0, 0]
                time = bodies.start[i] + bodies.sensings[i] * bodies.period[i] + bodies.jitter[i] * drawn
                bodies.next_at[i] = np.ceil(time - ROUNDING)

    def cycle(self, rows: Any = slice(None)) -> Cycle:
        """Return the cycle of some robots; with one value where all have the same."""
        return _cycle_of(CycleNumbers._make(one[rows] for one in self.numbers))

    @property
    def first_cycle(self) -> Cycle:
        """The cycle with which members begin a run."""
        return _cycle_of(_numbers_in(self._members))

    def usual(self) -> Cycle | None:
        """Return the cycle of all robots, or of all members if there is none; None if they differ."""
        numbers = _numbers_in(self._bodies if len(self._bodies) else self._members)
        is_same = all((one == one[0]).all() for one in numbers)
        return _cycle_of(CycleNumbers._make(one[:1] for one in numbers)) if is_same else None

    def travel(self, tick: int) -> None:
        """Update `travelled` to the present positions, as the kernel does at the begin of a step."""
        bodies, moved = self._bodies, self._bodies.moved
        bodies.travelled[:] = np.where((bodies.decided_at == tick - 1)[:, np.newaxis], moved, moved + bodies.trip)

    def kept(self) -> list[npt.NDArray[Any]]:
        """Return copies of what a step changes."""
        return [self._bodies[name].copy() for name in _CHANGING]

    def put_back(self, kept: list[npt.NDArray[Any]]) -> None:
        """Undo the changes since `kept`, in place."""
        for name, array in zip(_CHANGING, kept, strict=True):
            self._bodies[name][:] = array

    def _make_slots(self) -> bool:
        """Make room for the actions on their way, at least as many slots as before; return whether more are needed."""
        longest, before = int(self._bodies.delay.max(initial=0)), self._bodies.arrives_at.shape[1]
        slots = longest + 1 if longest else 0
        if slots <= before:
            return False
        ticks, actions = (self._bodies[name].copy() for name in _SLOTS)
        self._declare_slots(slots)
        arrives_at, waiting = self._bodies.arrives_at, self._bodies.waiting
        for row, old in zip(*np.nonzero(ticks >= 0), strict=True):
            slot = ticks[row, old] % slots
            if ticks[row, old] > arrives_at[row, slot]:
                arrives_at[row, slot], waiting[row, slot] = ticks[row, old], actions[row, old]
        return True

    def _declare_slots(self, slots: int) -> None:
        self._bodies.declare(Field("arrives_at", np.int64, (slots,), fill=-1, reset="fill"))
        self._bodies.declare(Field("waiting", np.float64, (slots, 3)))


def _numbers_in(table: Table) -> CycleNumbers:
    return CycleNumbers(*(table[field.name] for field in _CYCLE))


def _cycle_of(numbers: CycleNumbers) -> Cycle:
    def one_of(array: npt.NDArray[Any]) -> Any:
        return array[0].item() if len(array) and (array == array[0]).all() else array

    phase = RANDOM if len(numbers.is_random) and numbers.is_random.all() else one_of(numbers.phase)
    if not len(numbers.period):
        return Cycle()
    return Cycle(one_of(numbers.period), phase, one_of(numbers.jitter), one_of(numbers.delay))


def give_timetable(data: WorldData, group: Group, numbers: CycleNumbers) -> Timetable:
    """Give a group a timetable, or other cycles in that which it has; they begin now. Its records must be bound."""
    tick = data.timeline.tick
    if group.timetable is None:
        # After a failed step the kernels have decided at this tick, and learned from what they got before.
        decided_at = np.full(len(group), tick) if group.has_decided else group.decided_at
        put(group, timetable=Timetable(group, numbers, decided_at))
    else:
        group.timetable.set_numbers(numbers)
    table = group.timetable
    assert table is not None
    table.begin(slice(None), data.key, tick)
    return table


def give_timetables(data: WorldData) -> None:
    """Give a timetable to the groups that need one and have none: those with inactive robots."""
    for group in data.groups:
        if group.needs_timetable and group.timetable is None:
            give_timetable(data, group, EVERY_STEP.numbers(len(group)))


def is_every_step(group: Group) -> bool:
    """Whether all active robots of a group decide at every step."""
    return group.timetable is None or group.timetable.cycle() == EVERY_STEP
