"""The timetable of a group: when each robot decides next and by which policy, and the actions on their way."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.decisions.cycle import EVERY_STEP, RANDOM, ROUNDING, Cycle, CycleNumbers, drawn_phases
from teamsight.agents.fixed import put
from teamsight.agents.group import Group
from teamsight.agents.policy_state import state_of_more, take_rows
from teamsight.policies.interface import Action
from teamsight.world.noise import Stream, stream_number, uniforms

if TYPE_CHECKING:
    from teamsight.agents.world_data import WorldData


@dataclass
class OtherPolicy:
    """A policy that some robots of a group have, or have had.

    Attributes
    ----------
    policy : Policy or callable
        The policy.
    state : object
        Its state for all robots of the group, of which those of robots with this policy are in use.
    """

    policy: Any
    state: Any

    def rows(self, keep: npt.NDArray[Any], size: int) -> OtherPolicy:
        """Return it for some of the `size` robots."""
        return OtherPolicy(self.policy, take_rows(self.state, keep, size))

    def extended(self, size: int, members: npt.NDArray[np.int64], members_so_far: int) -> OtherPolicy:
        """Return it for more robots, of which the first `size` go on; see `state_of_more`."""
        return OtherPolicy(self.policy, state_of_more(self.policy, self.state, size, members, members_so_far))


Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Key = npt.NDArray[np.uint64]

# The arrays that a step changes.
_CHANGING = ("sensings", "next_at", "decided_at", "trip", "heading", "distance", "arrives_at", "waiting")


@dataclass
class Timetable:
    """The timetable of n robots. They need one if not all decide at every step, or not by the same policy.

    Attributes
    ----------
    group : int
        The number of the group.
    numbers : CycleNumbers
        The cycles of the robots.
    first : CycleNumbers
        The cycles with which the members of the group begin a run.
    start : ndarray, shape (n,), float64
        Origin and phase of each cycle [ticks].
    sensings : ndarray, shape (n,), int64
        How often each robot has sensed, or would have if it had been active, since the origin.
    next_at : ndarray, shape (n,), int64
        The tick at which each robot decides next.
    decided_at : ndarray, shape (n,), int64
        The tick at which each robot last decided; −1 for none.
    trip : ndarray, shape (n, 2), float64
        The displacement since the last decision, without that of the last step [length].
    travelled : ndarray, shape (n, 2), float64
        The displacement since the last decision, computed at the begin of a step [length].
    policy : ndarray, shape (n,), int64
        The policy of each robot: its index in `Group.policies`.
    heading, distance : ndarray, shape (n, 2) and (n,), float64
        The action that each robot carries out; see `Action`.
    arrives_at : ndarray, shape (slots, n), int64
        The ticks at which actions on their way take effect; that of tick t is in slot ``t % slots``. No slots without
        delays.
    waiting : ndarray, shape (slots, n, 3), float64
        These actions: heading and distance.
    """

    group: int
    numbers: CycleNumbers
    first: CycleNumbers
    start: Floats
    sensings: Integers
    next_at: Integers
    decided_at: Integers
    trip: Floats
    travelled: Floats
    policy: Integers
    heading: Floats
    distance: Floats
    arrives_at: Integers
    waiting: Floats

    @classmethod
    def made(
        cls, group: int, cycle: Cycle, members: Integers, members_so_far: int, decided_at: Integers, action: Action
    ) -> Timetable:
        """Return the timetable of robots that go on with this action; `begin` begins their cycles."""
        size = len(members)
        numbers = cycle.numbers(size)
        none = np.zeros(size, np.int64)
        return cls(
            group, numbers, _by_member(numbers, members, members_so_far), np.zeros(size), none, none.copy(),
            decided_at, np.zeros((size, 2)), np.zeros((size, 2)), none.copy(),
            action.heading.copy(), action.distance.copy(), *_on_their_way(0, size),
        )  # fmt: skip

    @property
    def action(self) -> Action:
        """The actions that are carried out."""
        return Action(self.heading, self.distance)

    def begin(self, rows: Any, key: Key, members: Integers, tick: int) -> None:
        """Begin the cycles of some rows at a tick, in place but for the slots; `members` are those of all rows."""
        stream, numbers = stream_number(Stream.CYCLE, self.group), CycleNumbers._make(one[rows] for one in self.numbers)
        mine = members[rows]
        self.start[rows] = tick + drawn_phases(numbers, key, stream, mine)
        self.sensings[rows] = 0
        first = self.start[rows] + numbers.jitter * uniforms(key, stream, 0, mine, 1)[0]
        self.next_at[rows] = np.ceil(first - ROUNDING).astype(np.int64)
        self._make_slots()

    def go_on(self, key: Key, members: Integers, tick: int) -> None:
        """Let robots whose cycle begins at a tick at which they had decided, in a step that failed, decide after it."""
        stream = stream_number(Stream.CYCLE, self.group)
        for i in np.flatnonzero((self.decided_at == tick) & (self.next_at <= tick)):
            while self.next_at[i] <= tick:
                self.sensings[i] += 1
                drawn = uniforms(key, stream, int(self.sensings[i]), members[i : i + 1], 1)[0, 0]
                time = self.start[i] + self.sensings[i] * self.numbers.period[i] + self.numbers.jitter[i] * drawn
                self.next_at[i] = np.ceil(time - ROUNDING)

    def restart(self, key: Key, members: Integers) -> None:
        """Go back to the start of a run, in place."""
        for present, first in zip(self.numbers, self.first, strict=True):
            present[:] = first[members]
        self.decided_at[:], self.arrives_at[:] = -1, -1
        for array in (self.trip, self.travelled, self.policy, self.heading, self.distance):
            array[:] = 0
        self.begin(slice(None), key, members, 0)

    def note_first(self, members: Integers, count: int) -> None:
        """Let the last `count` robots begin runs with the cycles that they have now."""
        for first, present in zip(self.first, self.numbers, strict=True):
            first[members[len(members) - count :]] = present[len(members) - count :]

    def rows(self, which: npt.NDArray[Any]) -> Timetable:
        """Return a copy of some rows, selected by index or by mask."""
        changed: dict[str, Any] = {"group": self.group, "first": self.first}
        changed["numbers"] = CycleNumbers._make(one[which] for one in self.numbers)
        for field in fields(self):
            if field.name in ("arrives_at", "waiting"):
                changed[field.name] = np.ascontiguousarray(getattr(self, field.name)[:, which])
            elif field.name not in changed:
                changed[field.name] = np.ascontiguousarray(getattr(self, field.name)[which])
        return Timetable(**changed)

    def followed_by(self, other: Timetable, members_so_far: int) -> Timetable:
        """Return a copy of these robots' timetable, then of others', who join the members that there were so far."""
        changed: dict[str, Any] = {"group": self.group}
        pairs = zip(self.numbers, other.numbers, strict=True)
        changed["numbers"] = CycleNumbers._make(np.append(mine, theirs) for mine, theirs in pairs)
        pairs = zip(self.first, other.first, strict=True)
        changed["first"] = CycleNumbers._make(np.append(mine[:members_so_far], theirs) for mine, theirs in pairs)
        slots, more = len(self.arrives_at), len(other.start)
        for field in fields(self):
            if field.name in changed:
                continue
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            if field.name in ("arrives_at", "waiting"):
                fresh = _on_their_way(slots, more)[field.name == "waiting"]
                changed[field.name] = np.concatenate([mine, fresh], axis=1)
            else:
                changed[field.name] = np.concatenate([mine, theirs])
        return Timetable(**changed)

    def with_cycle(self, cycle: Cycle, members: Integers) -> Timetable:
        """Return a copy in which all robots have another cycle; `begin` begins it."""
        made = self.rows(np.arange(len(members)))
        made.numbers = cycle.numbers(len(members))
        made.first = CycleNumbers._make(one.copy() for one in self.first)
        for first, given in zip(made.first, made.numbers, strict=True):
            first[members] = given
        return made

    def cycle(self, rows: Any = slice(None)) -> Cycle:
        """Return the cycle of some robots; with one value where all have the same."""
        return _cycle_of(CycleNumbers._make(one[rows] for one in self.numbers))

    @property
    def first_cycle(self) -> Cycle:
        """The cycle with which members begin a run."""
        return _cycle_of(self.first)

    def usual(self) -> Cycle | None:
        """Return the cycle of all robots, or of all members if there is none; None if they differ."""
        numbers = self.numbers if len(self.start) else self.first
        is_same = all((one == one[0]).all() for one in numbers)
        return _cycle_of(CycleNumbers._make(one[:1] for one in numbers)) if is_same else None

    def travel(self, moved: Floats, tick: int) -> None:
        """Update `travelled` to the present positions, as the kernel does at the begin of a step."""
        self.travelled[:] = np.where((self.decided_at == tick - 1)[:, np.newaxis], moved, moved + self.trip)

    def kept(self) -> list[npt.NDArray[Any]]:
        """Return copies of what a step changes."""
        return [getattr(self, name).copy() for name in _CHANGING]

    def put_back(self, kept: list[npt.NDArray[Any]]) -> None:
        """Undo the changes since `kept`, in place."""
        for name, array in zip(_CHANGING, kept, strict=True):
            getattr(self, name)[:] = array

    def _make_slots(self) -> None:
        """Make room for the actions on their way, at least as many slots as before."""
        longest, before = int(self.numbers.delay.max(initial=0)), len(self.arrives_at)
        slots = longest + 1 if longest else 0
        if slots <= before:
            return
        arrives_at, waiting = _on_their_way(slots, len(self.start))
        for old, row in zip(*np.nonzero(self.arrives_at >= 0), strict=True):
            slot = self.arrives_at[old, row] % slots
            if self.arrives_at[old, row] > arrives_at[slot, row]:
                arrives_at[slot, row], waiting[slot, row] = self.arrives_at[old, row], self.waiting[old, row]
        self.arrives_at, self.waiting = arrives_at, waiting


def _cycle_of(numbers: CycleNumbers) -> Cycle:
    def one_of(array: npt.NDArray[Any]) -> Any:
        return array[0].item() if len(array) and (array == array[0]).all() else array

    phase = RANDOM if len(numbers.is_random) and numbers.is_random.all() else one_of(numbers.phase)
    if not len(numbers.period):
        return Cycle()
    return Cycle(one_of(numbers.period), phase, one_of(numbers.jitter), one_of(numbers.delay))


def _by_member(numbers: CycleNumbers, members: Integers, members_so_far: int) -> CycleNumbers:
    """Return the cycles by member; those that have left have the first's, which nobody reads."""
    given = numbers if len(members) else EVERY_STEP.numbers(1)
    found = CycleNumbers._make(np.resize(one, members_so_far) for one in given)
    for array, one in zip(found, numbers, strict=True):
        array[members] = one
    return found


def _on_their_way(slots: int, size: int) -> tuple[Integers, Floats]:
    return np.full((slots, size), -1), np.zeros((slots, size, 3))


def new_timetable(data: WorldData, group: Group, cycle: Cycle = EVERY_STEP) -> Timetable:
    """Return the timetable of a group with a cycle that begins now; it is not yet the group's."""
    members, tick = group.bodies.member, data.timeline.tick
    if group.timetable is None:
        so_far = max(group.members_so_far, len(members))
        # After a failed step the kernels have decided at this tick, and learned from what they got before.
        decided_at = np.full(len(members), tick) if group.has_decided else group.decided_at
        table = Timetable.made(group.number, cycle, members, so_far, decided_at, group.action)
    else:
        table = group.timetable.with_cycle(cycle, members)
    table.begin(slice(None), data.key, members, tick)
    return table


def put_timetable(group: Group, table: Timetable) -> None:
    """Give a group a timetable; its records must be bound again."""
    put(group, timetable=table)
    group.action = table.action


def give_timetables(data: WorldData) -> None:
    """Give a timetable to the groups that need one and have none: those with inactive robots."""
    for group in data.groups:
        if group.needs_timetable and group.timetable is None:
            put_timetable(group, new_timetable(data, group))


def is_every_step(group: Group) -> bool:
    """Whether all active robots of a group decide at every step."""
    return group.timetable is None or group.timetable.cycle() == EVERY_STEP
