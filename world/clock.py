"""The clock: a SimPy environment whose unit is the tick. Only this file imports simpy."""

from __future__ import annotations

import itertools
import math
import weakref
from collections.abc import Callable, Generator, Iterable
from heapq import heapify, heappop, heappush
from inspect import isgeneratorfunction
from numbers import Integral
from types import GeneratorType
from typing import Any

import simpy

from teamsight.core import checks
from teamsight.core.interrupts import deferred


class Planned(simpy.Event):  # type: ignore[misc]
    """A call that is planned on a clock. It can be cancelled before it happens, and processes can wait for it.

    Attributes
    ----------
    time : float
        The time of the call [ticks].
    priority, order : float, int
        Of simultaneous calls, that with the lowest priority comes first; of these, that with the lowest order: the one
        that was planned first.
    action, arguments : callable, tuple
        What is called.
    links : int
        See `Clock.links_to`.
    is_cancelled : bool
        Whether it was cancelled.
    """

    _ok = True
    _value = None
    callbacks: Any
    is_cancelled = False

    def __init__(
        self, clock: Any, time: float, priority: float, order: int, action: Callable[..., Any], arguments: Any
    ) -> None:
        self.env, self.callbacks = clock, [_call]
        self.time, self.priority, self.order = time, priority, order
        self.action, self.arguments = action, arguments
        self.links = clock.links_to(time)
        heappush(clock._queue, (time, priority, order, self))

    def cancel(self) -> None:
        """Take the call back. It has no effect on one that has happened or was cancelled before."""
        if self.callbacks is not None:
            self.callbacks, self.is_cancelled = None, True
            self.env.forget_cancelled()

    def __repr__(self) -> str:
        name = getattr(self.action, "__name__", type(self.action).__name__)
        past = " (cancelled)" if self.is_cancelled else " (happened)" if self.callbacks is None else ""
        return f"<{name}{self.arguments or '()'} planned at {self.time:g}{past}>"


def _call(planned: Planned) -> None:
    call(planned.env, planned.action, planned.arguments)


def call(clock: Any, action: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Call something as an event of a clock.

    Raises
    ------
    TypeError
        If it yields: then it has only made a generator.
    """
    clock.caller = getattr(action, "__self__", None)
    try:
        result = action(*arguments)
    finally:
        clock.caller = None
    if type(result) is GeneratorType:
        raise _never_runs(action)


def check_does_not_yield(action: Any) -> None:
    """Refuse to plan a function that yields, which would do nothing when it is called.

    Raises
    ------
    TypeError
        If it does.
    """
    if isgeneratorfunction(action):
        raise _never_runs(action)


def _never_runs(action: Any) -> TypeError:
    """Return the error for a planned call that has only made a generator."""
    name = getattr(action, "__name__", type(action).__name__)
    return TypeError(f"the planned call {name} yields, so it does nothing; start a process: clock.process({name}())")


def callbacks_of(event: Any) -> list[Any]:
    """Return what an event calls, except SimPy's resources, which have done their part when it is in the queue."""
    resource = simpy.resources.base.BaseResource
    return [one for one in event.callbacks or () if not isinstance(getattr(one, "__self__", None), resource)]


def is_whole(event: Any) -> bool:
    """Whether all that an event calls are methods of objects that defer Ctrl-C, as event sources do."""
    resource = simpy.resources.base.BaseResource
    for one in [event] if type(event) is Planned and len(event.callbacks) == 1 else event.callbacks:
        owner = getattr(one, "__self__", None)
        if not isinstance(owner, resource):
            owner = getattr(getattr(one, "action", None), "__self__", None)
            if not getattr(owner, "defers_interrupts", False):
                return False
    return True


class Waiting(list[Any]):
    """The callbacks of an event: SimPy adds those that wait and removes those that no longer do, as after an interrupt.

    Parameters
    ----------
    event : simpy.Event
        The event.
    changed : callable
        Called without arguments whenever `is_awaited` may have changed.
    callbacks : iterable, optional
        The callbacks that the event has.
    """

    def __init__(self, event: Any, changed: Callable[[], None], callbacks: Iterable[Any] = ()) -> None:
        super().__init__(callbacks)
        self._event, self._changed = weakref.ref(event), [changed]

    @property
    def is_awaited(self) -> bool:
        """Whether a process waits for the event."""
        return any(self._is_waiting(callback) for callback in self)

    def _is_waiting(self, callback: Any) -> bool:
        owner: Any = getattr(callback, "__self__", None)
        if owner is self._event():
            return False
        # A condition that nobody waits for keeps its callbacks in its events.
        above = owner.callbacks if _is_condition(owner) else None
        return not isinstance(above, Waiting) or above.is_awaited

    def append(self, callback: Any) -> None:
        """Add one that waits."""
        super().append(callback)
        owner: Any = getattr(callback, "__self__", None)
        if owner is not self._event() and _is_condition(owner):
            if type(owner.callbacks) is list:
                owner.callbacks = Waiting(owner, self._notify, owner.callbacks)
            elif isinstance(owner.callbacks, Waiting):
                owner.callbacks._changed.append(self._notify)
        self._notify()

    def remove(self, callback: Any) -> None:
        """Remove one that no longer waits."""
        super().remove(callback)
        self._notify()

    def _notify(self) -> None:
        for changed in self._changed:
            changed()


def _is_condition(owner: Any) -> bool:
    # Only the clock imports simpy.
    return hasattr(owner, "_evaluate") and hasattr(owner, "_events")


class Kept:
    """An event that is kept while a process waits for it: nothing else refers to a process that waits.

    An event for which nobody waits is kept by whoever holds it, and is gone if nobody does.
    """

    def __init__(self, event: Any) -> None:
        self.event: Callable[[], Any] = weakref.ref(event)
        self._held: Any = None
        mine = weakref.ref(self)
        event.callbacks = Waiting(event, lambda: _hold(mine()), event.callbacks)

    def hold(self) -> None:
        """Keep the event as long as it is awaited."""
        event = self.event()
        waiting = None if event is None else event.callbacks
        self._held = event if isinstance(waiting, Waiting) and waiting.is_awaited else None


def _hold(kept: Kept | None) -> None:
    if kept is not None:
        kept.hold()


# The generators of which processes were made.
_started: weakref.WeakSet[GeneratorType[Any, Any, Any]] = weakref.WeakSet()


class NoGeneratorError(TypeError, ValueError):
    """A process was started with what is no generator. SimPy raises a ValueError."""


class NoEventError(TypeError, RuntimeError):
    """A process has yielded what is no event of its clock. SimPy raises a RuntimeError."""


class CheckedGenerator:
    """Stands for a generator in a SimPy process.

    What is no event, or an event of another clock, is refused by an error at the yield. After the clock began again, it
    ends: at its next yield, or where it waits.

    Raises
    ------
    NoGeneratorError
        If it is not a generator.
    ValueError
        If a process was made of it before.
    """

    def __init__(self, clock: Any, generator: Generator[Any, Any, Any]) -> None:
        if not hasattr(generator, "throw"):
            raise NoGeneratorError(
                f"process({checks.shown(generator)}): is not a generator; call the function that yields: process(f(…))"
            )
        self._clock, self._generator, self._beginnings = clock, generator, clock.beginnings
        self.__name__ = getattr(generator, "__name__", type(generator).__name__)
        if isinstance(generator, GeneratorType):
            if generator in _started:
                name = self.__name__
                raise ValueError(
                    f"process({checks.shown(generator)}): a process of this generator was started already; call the "
                    f"function again for another: process({name}(…))"
                )
            _started.add(generator)

    def send(self, value: Any) -> Any:
        """Go on to the next yield; return the event."""
        return self._go_on(self._generator.send, value)

    def throw(self, error: BaseException) -> Any:
        """Go on with an exception at the present yield; return the next event."""
        return self._go_on(self._generator.throw, error)

    def _go_on(self, resume: Callable[[Any], Any], value: Any) -> Any:
        clock = self._clock
        while self._beginnings == clock.beginnings:
            event = resume(value)
            if self._beginnings != clock.beginnings:
                break
            if not hasattr(event, "callbacks"):
                wrong = (
                    "no event; yield one, such as world.clock.timeout(10), world.clock.process(…) or a request of a "
                    "resource"
                )
            elif event.env is not clock:
                wrong = (
                    "of another clock and may never come here; yield an event of this world, such as "
                    "world.clock.timeout(10)"
                )
            else:
                return event
            shown = f"Invalid yield value \"{checks.shown(event)}\", which is {wrong}"
            resume, value = self._generator.throw, NoEventError(f"process {self.__name__}: {shown}")
        # The process ends as if its function had returned; what it has in `finally` is done.
        self._generator.close()
        raise StopIteration


# SimPy adds delays to the present time; 0.1 + 2.9 must still count as the whole tick 3.
_ROUNDING = 1e-9
# Cancelled calls stay in the queue until they are due, or until they are more than this and more than half of it.
_MOST_CANCELLED = 64
# Events in a row at one time; see `links_to`.
_MOST_LINKS = 100_000

NORMAL = simpy.events.NORMAL
Event = simpy.Event


class Clock(simpy.Environment):  # type: ignore[misc]
    """A SimPy environment whose time advances with the steps of a world.

    SimPy's own classes accept it, as in ``simpy.Resource(world.clock)``. Each step leads from one whole tick to the
    next. An event at time t is processed before the step that starts at the first whole tick ≥ t. `now` is the
    exact time of an event while it is processed, and otherwise the present tick.
    """

    _eid: itertools.count[int]
    # The object whose method is being called as an event.
    caller: Any = None

    def __init__(self) -> None:
        super().__init__()
        self._cancelled = 0
        # The number of times that it was begun again, as at each reset.
        self.beginnings = 0
        # Of the last event; see `links_to`.
        self._links, self._linked_at = 0, -math.inf
        # The tick up to which events are being processed.
        self._limit = 0
        # Those that wait for something that nobody else refers to are gone, and will never continue.
        self._processes: weakref.WeakSet[simpy.Process] = weakref.WeakSet()

    def at(self, time: float, action: Callable[[], Any]) -> Planned:
        """Call `action` once, at `time` [ticks].

        Parameters
        ----------
        time : float
            The time of the call [ticks].
        action : callable
            Called without arguments.

        Returns
        -------
        Planned
            The planned call; its method `cancel` takes it back.

        Raises
        ------
        ValueError
            If `time` is not finite or has passed.
        TypeError
            If `action` cannot be called or yields, or `time` is not a number.
        """
        if not callable(action):
            shown = f"at({checks.shown(time)}, {checks.shown(action)})"
            raise TypeError(f"{shown}: the second argument must be callable, such as a function")
        check_does_not_yield(action)
        return self.plan(time, action)

    def plan(self, time: float, action: Callable[..., Any], *arguments: Any, priority: float = NORMAL) -> Planned:
        """Call `action` once with these arguments, at `time` [ticks]; see `at`.

        Of simultaneous events, that with the lowest priority comes first, and of these that which was planned first.
        """
        if type(time) is not float or not self._now <= time < math.inf:
            time = _exact("time", time)
            if time < self._now:
                raise ValueError(f"time={time:g}: has passed; it must be at least the present time, {self._now:g}")
        return Planned(self, time, priority, next(self._eid), action, arguments)

    def process(self, generator: Generator[Any, Any, Any]) -> Any:
        """Start a process: a generator that yields SimPy events, such as ``clock.timeout(10)``.

        Raises
        ------
        TypeError
            If it is not a generator; also a ValueError, as in SimPy. A process that yields what is no event of this
            clock receives a TypeError there, which is also a RuntimeError, as in SimPy.
        ValueError
            If a process was started with this generator before.
        """
        return simpy.Process(self, CheckedGenerator(self, generator))

    def timeout(self, delay: float, value: Any = None) -> Any:
        """Return an event that happens after `delay` [ticks], for use in a process.

        Parameters
        ----------
        delay : float
            Time from now [ticks], finite and at least 0.
        value : object, optional
            The value of the event, which the waiting process receives.
        """
        if (delay := _exact("delay", delay)) < 0:
            raise ValueError(f"Negative delay {delay:g}: delay must be at least 0")
        return simpy.Timeout(self, delay, value)

    def resource(self, capacity: int) -> Any:
        """Return a ``simpy.Resource`` of this clock, of which so many users can have one unit at the same time."""
        return simpy.Resource(self, checks.count("capacity", capacity))

    def schedule(self, event: Any, priority: Any = NORMAL, delay: float = 0) -> None:
        """Put an event into the queue; SimPy's own classes call this.

        Parameters
        ----------
        event : simpy.Event
            The event.
        priority : int
            Of simultaneous events, that with the lowest priority comes first.
        delay : float
            Time from now [ticks].

        Raises
        ------
        ValueError
            If the delay is negative, infinite or NaN.
        """
        if not 0 <= delay < math.inf:
            checks.number("delay", delay, least=0)
        if type(event) is simpy.events.Initialize:
            self._processes.add(event.callbacks[0].__self__)
        event.links = self.links_to(self._now + delay)
        super().schedule(event, priority, delay)

    def step(self) -> None:
        """Refused with a TypeError; see `run`."""
        raise TypeError("clock.step(): the clock advances with its world; call world.step()")

    def run(self, until: Any = None) -> Any:
        """Refused with a TypeError, because the world would not advance."""
        raise TypeError("clock.run(…): the clock advances with its world; call world.run(steps)")

    def peek(self) -> float:
        """Return the time of the next event; infinite without one."""
        queue = self._queue
        while queue and queue[0][3].callbacks is None:
            heappop(queue)
            self._cancelled -= 1
        return queue[0][0] if queue else math.inf

    def ticks_until_event(self, tick: int) -> float:
        """Return the number of steps from `tick` to the next event; infinite without one."""
        time = self.peek()
        return math.inf if math.isinf(time) else max(math.ceil(time - _ROUNDING) - tick, 0)

    def advance(self, tick: int) -> bool:
        """Process all events that are due by `tick`; return whether there were any.

        An exception in an event, or one that a process does not handle, is raised as it is; the events after it are
        processed by the next call.
        """
        happened = False
        self._limit = tick
        try:
            # An event that begins another run sets the limit to its first tick.
            while self.peek() <= self._limit + _ROUNDING:
                self._process_next()
                happened = True
        finally:
            self.set(self._limit)
        return happened

    def _process_next(self) -> None:
        """Process the next event; what a source does in it is done completely, whenever Ctrl-C comes."""
        if is_whole(self._queue[0][3]):
            with deferred():
                self._process()
        else:
            self._process()

    def _process(self) -> None:
        """Process the next event. SimPy's own `step` would raise a copy of an exception, without its traceback."""
        self._now, _, _, event = heappop(self._queue)
        callbacks, event.callbacks = event.callbacks, None
        self._links, self._linked_at = getattr(event, "links", 0), self._now
        if self._links > _MOST_LINKS:
            self._stop_chain(event, callbacks)
            return
        for number, callback in enumerate(callbacks, 1):
            try:
                callback(event)
            except BaseException:
                if callbacks[number:]:
                    event.callbacks = callbacks[number:]
                    heappush(self._queue, (self._now, -1, next(self._eid), event))
                raise
        if not event._ok and not hasattr(event, "_defused"):
            raise event._value

    def _stop_chain(self, event: Any, callbacks: list[Any]) -> None:
        """Raise an error about an endless chain of events and drop the event; in a process, raise it at its yield."""
        self._links = 0
        process = next(filter(None, map(_process_of, callbacks)), None)
        action = next((one.action for one in (event, *callbacks) if hasattr(one, "action")), event)
        what = f"the planned call {getattr(action, '__qualname__', action)}"
        if process is not None:
            what = f"process {process.name}"
        error = RuntimeError(
            f"{what}: more than {_MOST_LINKS:,} events in a row at time {self._now:g}, each planned by the one before; "
            "let time pass in between, as by clock.timeout(1), or by until.lost(…) after until.observed(…)"
        )
        if process is None:
            raise error
        if process.target.callbacks is not None:
            process.target.callbacks.remove(process._resume)
        failed = simpy.Event(self)
        failed._ok, failed._value = False, error
        process._resume(failed)

    def links_to(self, time: float) -> int:
        """Return how many events, each planned by the one before without delay, lead to one planned now for `time`."""
        stands_still = time - self._now <= _ROUNDING and self._now - self._linked_at <= _ROUNDING
        return self._links + 1 if stands_still else 0

    def begin(self, tick: int) -> None:
        """Drop all events and set the time to `tick`. Resources stay usable; waiting processes never continue."""
        self._queue.clear()
        self._processes.clear()
        self._cancelled = self._links = 0
        self._now = self._limit = tick
        self.beginnings += 1

    def set(self, tick: int) -> None:
        """Set the time to `tick`, between two steps; the next `advance` processes the events due by then."""
        self._now = tick

    def forget_cancelled(self) -> None:
        """Count a cancelled call, and drop all of them once they are many."""
        self._cancelled += 1
        if self._cancelled > _MOST_CANCELLED and 2 * self._cancelled > len(self._queue):
            self._queue[:] = [entry for entry in self._queue if entry[3].callbacks is not None]
            heapify(self._queue)
            self._cancelled = 0

    @property
    def processes(self) -> list[Any]:
        """The processes that have not ended."""
        return [process for process in self._processes if process.is_alive]

    @property
    def pending(self) -> list[tuple[float, float, int, Any]]:
        """The events to come that do something, in order: (time, priority, order, event)."""
        return sorted((entry for entry in self._queue if callbacks_of(entry[3])), key=lambda entry: entry[:3])

    @property
    def order(self) -> int:
        """The order of the next event."""
        order = next(self._eid)
        self._eid = itertools.count(order)
        return order

    @order.setter
    def order(self, order: int) -> None:
        self._eid = itertools.count(order)


def _exact(name: str, time: Any) -> float:
    """Return a time as a finite number; whole numbers stay ints, as in SimPy."""
    number = checks.number(name, time)
    return int(time) if isinstance(time, Integral) else number


def _process_of(callback: Any) -> Any:
    """Return the process that a callback continues or interrupts, or would by a condition; None for others."""
    owner = getattr(callback, "__self__", None)
    owner = getattr(owner, "process", owner)
    if isinstance(owner, simpy.events.Condition):
        above = [one for one in owner.callbacks or () if getattr(one, "__self__", None) is not owner]
        return next(filter(None, map(_process_of, above)), None)
    return owner if isinstance(owner, simpy.Process) and owner.is_alive else None
