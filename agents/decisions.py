"""When the robots of a group decide: their cycle, and the timetable of all."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import put
from teamsight.core import checks
from teamsight.core.component import Allowed, Component
from teamsight.core.table import Field, Table
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
class Cycle(Component):
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

    period: Annotated[
        float | npt.ArrayLike,
        Allowed(check=partial(_values, least=1.0, cure="a robot decides at most once in each step"), unit="ticks"),
    ] = 1.0
    phase: Annotated[float | npt.ArrayLike, Allowed(check=_phase, unit="ticks")] = 0.0
    jitter: Annotated[
        float | npt.ArrayLike,
        Allowed(check=partial(_values, least=0.0, cure="a sensing can only be late"), unit="ticks"),
    ] = 0.0
    delay: Annotated[int | npt.ArrayLike, Allowed(check=_delays, unit="ticks")] = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        parts = (self.period, self.phase, self.jitter, self.delay)
        sizes = {len(one) for one in parts if isinstance(one, tuple)}
        if len(sizes) > 1:
            raise ValueError(
                f"Cycle: has values for {' and '.join(map(str, sorted(sizes)))} robots; give one value, or one for each"
            )
        late, least = np.broadcast_arrays(np.asarray(self.jitter), np.asarray(self.period))
        if (late >= least).any():
            at = int(np.argmax(np.ravel(late >= least)))
            raise ValueError(
                f"jitter={np.ravel(late)[at]:g}: must be below the period, {np.ravel(least)[at]:g}, so that sensings "
                "keep their order; give a smaller jitter or a longer period"
            )

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
    return _every(checks.number("cycle", value, least=1))


@lru_cache(maxsize=64)
def _every(period: float) -> Cycle:
    return Cycle(period)


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


def _phase(name: str, value: Any) -> float | tuple[float, ...] | str:
    if isinstance(value, str):
        return checks.choice(name, value, (RANDOM,))
    return _values(name, value, 0.0, "give a later time")


def _delays(name: str, value: Any) -> int | tuple[int, ...]:
    cure = "an action cannot be awaited longer"
    if np.ndim(value) == 0:
        return checks.count(name, value, least=0, most=MOST_DELAY, cure=cure)
    if np.ndim(value) != 1:
        raise ValueError(f"{name}: has the shape {np.shape(value)}; give one number, or one for each robot")
    return tuple(checks.count(name, one, least=0, most=MOST_DELAY, cure=cure) for one in np.asarray(value).tolist())


#: Robots decide at every step.
EVERY_STEP = Cycle()

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
