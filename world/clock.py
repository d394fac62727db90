"""The clock: a SimPy environment whose unit is the tick. No other file imports simpy."""

from __future__ import annotations

import itertools
import math
import weakref
from collections.abc import Callable, Generator
from heapq import heapify, heappop, heappush
from typing import Any

import simpy

from teamsight.core import checks

# SimPy adds delays to the present time; 0.1 + 2.9 must still count as the whole tick 3.
_ROUNDING = 1e-9
# Cancelled calls stay in the queue until they are due, or until they are more than this and more than half of it.
_MOST_CANCELLED = 64

NORMAL = simpy.events.NORMAL
Event = simpy.Event


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
    is_cancelled : bool
        Whether it was cancelled.
    """

    _ok = True
    _value = None
    callbacks: Any
    is_cancelled = False

    def __init__(
        self, clock: Clock, time: float, priority: float, order: int, action: Callable[..., Any], arguments: Any
    ) -> None:
        self.env, self.callbacks = clock, [_call]
        self.time, self.priority, self.order = time, priority, order
        self.action, self.arguments = action, arguments
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
    clock, action = planned.env, planned.action
    clock.caller = getattr(action, "__self__", None)
    try:
        action(*planned.arguments)
    finally:
        clock.caller = None


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
            If `action` cannot be called, or `time` is not a number.
        """
        if not callable(action):
            shown = f"at({checks.shown(time)}, {checks.shown(action)})"
            raise TypeError(f"{shown}: the second argument must be callable, such as a function")
        return self.plan(time, action)

    def plan(self, time: float, action: Callable[..., Any], *arguments: Any, priority: float = NORMAL) -> Planned:
        """Call `action` once with these arguments, at `time` [ticks]; see `at`.

        Of simultaneous events, that with the lowest priority comes first, and of these that which was planned first.
        """
        if type(time) is not float or not self._now <= time < math.inf:
            time = checks.number("time", time)
            if time < self._now:
                raise ValueError(f"time={time:g}: has passed; it must be at least the present time, {self._now:g}")
        return Planned(self, time, priority, next(self._eid), action, arguments)

    def plan_again(
        self, time: float, priority: float, order: int, action: Callable[..., Any], arguments: tuple[Any, ...]
    ) -> Planned:
        """Plan a call that was saved, at its place in the order."""
        return Planned(self, time, priority, order, action, arguments)

    def process(self, generator: Generator[Any, Any, Any]) -> Any:
        """Start a process: a generator that yields SimPy events, such as ``clock.timeout(10)``.

        Raises
        ------
        TypeError
            If it is not a generator. A process that yields what is no event receives a TypeError there.
        """
        if not hasattr(generator, "throw"):
            raise TypeError(
                f"process({checks.shown(generator)}): must be a generator; call the function that yields: process(f(…))"
            )
        return simpy.Process(self, generator)

    def timeout(self, delay: float, value: Any = None) -> Any:
        """Return an event that happens after `delay` [ticks], for use in a process.

        Parameters
        ----------
        delay : float
            Time from now [ticks], finite and at least 0.
        value : object, optional
            The value of the event, which the waiting process receives.
        """
        return simpy.Timeout(self, checks.number("delay", delay, least=0), value)

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
            raise ValueError(f"delay={delay}: must be a finite number, at least 0")
        if type(event) is simpy.events.Initialize:
            self._processes.add(event.callbacks[0].__self__)
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
        """Process the next event. SimPy's own `step` would raise a copy of an exception, without its traceback."""
        self._now, _, _, event = heappop(self._queue)
        callbacks, event.callbacks = event.callbacks, None
        for number, callback in enumerate(callbacks, 1):
            try:
                callback(event)
            except BaseException as error:
                process = _process_of(callback)
                if process is not None and process.is_alive and type(error) is RuntimeError:
                    self._refuse_yield(process, error)
                    continue
                if callbacks[number:]:
                    event.callbacks = callbacks[number:]
                    heappush(self._queue, (self._now, -1, next(self._eid), event))
                raise
        if not event._ok and not hasattr(event, "_defused"):
            raise event._value

    def _refuse_yield(self, process: Any, error: BaseException) -> None:
        """Raise a TypeError in a process, at its yield."""
        trace: Any = error.__traceback__
        while trace.tb_next is not None:
            trace = trace.tb_next
        # SimPy's message has its text only.
        value = trace.tb_frame.f_locals.get("event")
        refused = simpy.Event(self)
        refused._ok, refused._defused = False, True
        refused._value = TypeError(
            f"process {process.name}: yielded {checks.shown(value)}, which is no event; yield one, such as "
            "world.clock.timeout(10), world.clock.process(…) or a request of a resource"
        )
        process._resume(refused)

    def begin(self, tick: int) -> None:
        """Drop all events and set the time to `tick`. Resources stay usable; waiting processes never continue."""
        self._queue.clear()
        self._processes.clear()
        self._cancelled = 0
        self._now = self._limit = tick

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


def callbacks_of(event: Any) -> list[Any]:
    """Return what an event calls, except SimPy's resources, which have done their part when it is in the queue."""
    resource = simpy.resources.base.BaseResource
    return [one for one in event.callbacks or () if not isinstance(getattr(one, "__self__", None), resource)]


def _process_of(callback: Any) -> Any:
    """Return the process that a callback continues or interrupts; None for others."""
    owner = getattr(callback, "__self__", None)
    owner = getattr(owner, "process", owner)
    return owner if isinstance(owner, simpy.Process) else None
