"""When the robots of a group decide: their cycle, and the timetable of all."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.agents.fixed import put
from teamsight.agents.policy_state import state_of_more, take_rows
from teamsight.core import checks
from teamsight.policies.interface import Action
from teamsight.world.noise import Stream, key_of, stream_number, uniforms

if TYPE_CHECKING:
    from teamsight.agents.group import Group
    from teamsight.agents.world_data import WorldData

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: A sensing that follows a whole tick by no more than this belongs to it; the clock rounds alike.
ROUNDING = 1e-9

MOST_TICKS = 1e12
MOST_DELAY = 10_000

RANDOM: Literal["random"] = "random"


class CycleNumbers(NamedTuple):
    """The cycles of n agents, one element each.

    Attributes
    ----------
    period, phase, jitter : ndarray, shape (n,), float64
        [ticks].
    is_random : ndarray, shape (n,), bool
        Whether the phase is drawn; `phase` is 0 then.
    delay : ndarray, shape (n,), int64
        [ticks].
    """

    period: Floats
    phase: Floats
    jitter: Floats
    is_random: npt.NDArray[np.bool_]
    delay: Integers


@dataclass(frozen=True)
class Cycle:
    """When robots sense and decide. Between two decisions a robot keeps its last action; before the first it stays.

    A robot senses for the k-th time, k = 0, 1, …, at the time origin + phase + k · period + jitter · u, where u is
    uniform in [0, 1), drawn for each robot and each k. The origin is the tick at which the cycle was set, or the robot
    came. Sensing takes effect at the first whole tick that is not before this time, and the action `delay` ticks
    later. If two times have the same first tick, the robot decides once.

    Parameters
    ----------
    period : float or array_like, shape (n,), default 1
        The time from one sensing to the next, at least 1 [ticks].
    phase : float, array_like of shape (n,), or "random", default 0
        The time of the first sensing after the origin, at least 0 [ticks]. "random": uniform in [0, period), drawn for
        each robot.
    jitter : float or array_like, shape (n,), default 0
        The largest time by which a sensing is late, at least 0 and below the period [ticks].
    delay : int or array_like, shape (n,), default 0
        Whole ticks from sensing to acting, at least 0.

    Raises
    ------
    TypeError, ValueError
        If a value is no number, outside its limits, or of another shape; or if shapes differ.

    Notes
    -----
    Arrays are kept as tuples, so that equal cycles are equal and can be keys.
    """

    period: float | npt.ArrayLike = 1.0
    phase: float | npt.ArrayLike = 0.0
    jitter: float | npt.ArrayLike = 0.0
    delay: int | npt.ArrayLike = 0

    def __post_init__(self) -> None:
        period = _values("period", self.period, 1.0, "a robot decides at most once in each step")
        phase = RANDOM if isinstance(self.phase, str) else _values("phase", self.phase, 0.0, "give a later time")
        if isinstance(self.phase, str):
            checks.choice("phase", self.phase, (RANDOM,))
        jitter = _values("jitter", self.jitter, 0.0, "a sensing can only be late")
        delay = _delays(self.delay)
        sizes = {len(one) for one in (period, phase, jitter, delay) if isinstance(one, tuple)}
        if len(sizes) > 1:
            raise ValueError(
                f"Cycle: has values for {' and '.join(map(str, sorted(sizes)))} robots; give one value, or one for each"
            )
        late, least = np.broadcast_arrays(np.asarray(jitter), np.asarray(period))
        if (late >= least).any():
            at = int(np.argmax(np.ravel(late >= least)))
            raise ValueError(
                f"jitter={np.ravel(late)[at]:g}: must be below the period, {np.ravel(least)[at]:g}, so that sensings "
                "keep their order; give a smaller jitter or a longer period"
            )
        for name, value in (("period", period), ("phase", phase), ("jitter", jitter), ("delay", delay)):
            object.__setattr__(self, name, value)

    @property
    def size(self) -> int | None:
        """The number of robots for which it has values; None if they are for any number."""
        sizes = [len(one) for one in (self.period, self.phase, self.jitter, self.delay) if isinstance(one, tuple)]
        return sizes[0] if sizes else None

    def numbers(self, size: int) -> CycleNumbers:
        """Return the cycles of this many agents.

        Raises
        ------
        ValueError
            If it has values for another number of agents.
        """
        if self.size not in (None, size):
            raise ValueError(
                f"cycle={checks.shown(self)}: has values for {self.size} robots; give one value, or {size}, one for "
                "each agent"
            )
        is_random = self.phase == RANDOM
        phase: Any = 0.0 if is_random else self.phase
        period, phase, jitter = (
            np.array(np.broadcast_to(np.asarray(one, float), size)) for one in (self.period, phase, self.jitter)
        )
        delay = np.array(np.broadcast_to(np.asarray(self.delay, np.int64), size))
        return CycleNumbers(period, phase, jitter, np.full(size, is_random), delay)

    def times(
        self, duration: float, size: int = 1, *, seed: int = 0, group: int = 0, origin: float = 0.0
    ) -> list[Floats]:
        """Return the times at which agents sense: one array for each agent [ticks].

        Parameters
        ----------
        duration : float
            The time from the origin in which they are listed, at least 0 [ticks].
        size : int
            The number of agents: the first members of a group.
        seed, group : int
            The world's seed and the number of the group in it; phases that are drawn and jitter depend on them.
        origin : float
            The tick at which the cycle was set.

        Raises
        ------
        TypeError, ValueError
            If a value is no number or outside its limits, or the cycle has values for another number of agents.
        """
        length = checks.number("duration", duration, least=0, most=MOST_TICKS)
        size = checks.count("size", size)
        first = checks.number("origin", origin, least=0, most=MOST_TICKS)
        key, stream = key_of(checks.count("seed", seed, least=0)), stream_number(Stream.CYCLE, group)
        numbers, members = self.numbers(size), np.arange(size)
        phase = drawn_phases(numbers, key, stream, members)
        most = int(length / float(numbers.period.min())) + 2
        late = np.array([uniforms(key, stream, k, members, 1)[0] for k in range(most)])
        times = (first + phase) + np.arange(most)[:, np.newaxis] * numbers.period + numbers.jitter * late
        return [column[column < first + length] for column in times.T]

    def __repr__(self) -> str:
        parts = {"period": self.period, "phase": self.phase, "jitter": self.jitter, "delay": self.delay}
        usual = {"phase": 0.0, "jitter": 0.0, "delay": 0}
        # In full: runs with equal texts count as one.
        shown = [f"{name}={one!r}" for name, one in parts.items() if one != usual.get(name)]
        return f"Cycle({', '.join(shown)})"


CycleLike: TypeAlias = Cycle | float

def cycle_of(value: Any) -> Cycle:
    """Return the cycle that a user gives: an object, or a number for its period.

    Raises
    ------
    TypeError, ValueError
        If it is neither, or not a valid period.
    """
    if isinstance(value, Cycle):
        return value
    if isinstance(value, (type, str, bytes)) or np.ndim(value) != 0:
        raise TypeError(
            f"cycle={checks.shown(value)}: must be a period [ticks] or a Cycle, such as Cycle(5, phase='random')"
        )
    return Cycle(period=checks.number("cycle", value, least=1))


def check_run(value: CycleLike, steps: int) -> None:
    """Refuse a cycle in which a robot senses once at most in a run of so many steps.

    Raises
    ------
    TypeError, ValueError
        Naming a cycle that fits; and as for `cycle_of`.
    """
    cycle = cycle_of(value)
    longest = float(np.max(np.asarray(cycle.period)))
    if longest > max(steps, 1):
        raise ValueError(
            f"cycle={longest:g}: is a period longer than the run of {steps:,} steps, in which a robot would decide at "
            f"most once; give at most {steps:,} ticks, or more steps"
        )
    latest = 0.0 if isinstance(cycle.phase, str) else float(np.max(np.asarray(cycle.phase)))
    if latest > max(steps - 1, 0):
        raise ValueError(
            f"phase={latest:g}: is after the last step of the run of {steps:,} steps, so that a robot would never "
            "decide; give an earlier one, or more steps"
        )


def drawn_phases(numbers: CycleNumbers, key: npt.NDArray[np.uint64], stream: int, member: Integers) -> Floats:
    """Return the phase of each agent [ticks]: that given, or one drawn for this noise key and member."""
    if not numbers.is_random.any():
        return numbers.phase.copy()
    drawn = numbers.period * uniforms(key, stream, 0, member, 2)[1]
    return np.where(numbers.is_random, drawn, numbers.phase)


def _values(name: str, value: Any, least: float, cure: str) -> float | tuple[float, ...]:
    """Return a number as a float, and an array as a tuple of floats; all from `least` to `MOST_TICKS`."""
    if np.ndim(value) == 0:
        number = checks.number(name, value.item() if isinstance(value, np.ndarray) else value)
        numbers: tuple[float, ...] = (number,)
    elif np.ndim(value) == 1:
        numbers = tuple(checks.number(name, one) for one in np.asarray(value).tolist())
    else:
        raise ValueError(f"{name}: has the shape {np.shape(value)}; give one number, or one for each robot")
    for number in numbers:
        if not least <= number <= MOST_TICKS:
            raise ValueError(f"{name}={number:g}: must be at least {least:g} and at most {MOST_TICKS:g} ticks; {cure}")
    return numbers if np.ndim(value) else numbers[0]


def _delays(value: Any) -> int | tuple[int, ...]:
    cure = "an action cannot be awaited longer"
    if np.ndim(value) == 0:
        return checks.count("delay", value, least=0, most=MOST_DELAY, cure=cure)
    if np.ndim(value) != 1:
        raise ValueError(f"delay: has the shape {np.shape(value)}; give one number, or one for each robot")
    return tuple(checks.count("delay", one, least=0, most=MOST_DELAY, cure=cure) for one in np.asarray(value).tolist())


#: Robots decide at every step.
EVERY_STEP = Cycle()


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
