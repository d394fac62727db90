"""The clock: a SimPy environment whose unit is the tick. No other file imports simpy."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

import simpy

from teamsight.core import checks

# SimPy adds delays to the present time; 0.1 + 2.9 must still count as the whole tick 3.
_ROUNDING = 1e-9


class Clock(simpy.Environment):  # type: ignore[misc]
    """A SimPy environment whose time advances with the steps of a world.

    SimPy's own classes accept it, as in ``simpy.Resource(world.clock)``. Each step leads from one whole tick to the
    next. An event at time t is processed before the step that starts at the first whole tick ≥ t. `now` is the
    exact time of an event while it is processed, and otherwise the present tick.
    """

    def at(self, time: float, action: Callable[[], Any]) -> None:
        """Call `action` once, at `time` [ticks].

        Parameters
        ----------
        time : float
            The time of the call [ticks].
        action : callable
            Called without arguments.

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
        moment = checks.number("time", time)
        if moment < self.now:
            raise ValueError(f"time={moment:g}: has passed; it must be at least the present time, {self.now:g}")
        simpy.Timeout(self, moment - self.now).callbacks.append(lambda _: action())

    def process(self, generator: Generator[Any, Any, Any]) -> Any:
        """Start a process: a generator that yields SimPy events, such as ``clock.timeout(10)``.

        Raises
        ------
        TypeError
            If it is not a generator.
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

    def schedule(self, event: Any, priority: Any = simpy.events.NORMAL, delay: float = 0) -> None:
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
        super().schedule(event, priority, delay)

    def step(self) -> None:
        """Refused with a TypeError; see `run`."""
        raise TypeError("clock.step(): the clock advances with its world; call world.step()")

    def run(self, until: Any = None) -> Any:
        """Refused with a TypeError, because the world would not advance."""
        raise TypeError("clock.run(…): the clock advances with its world; call world.run(steps)")

    def ticks_until_event(self, tick: int) -> float:
        """Return the number of steps from `tick` to the next event; infinite without one."""
        time = self.peek()
        return math.inf if math.isinf(time) else max(math.ceil(time - _ROUNDING) - tick, 0)

    def advance(self, tick: int) -> bool:
        """Process all events that are due by `tick`; return whether there were any."""
        happened = False
        try:
            while self.peek() <= tick + _ROUNDING:
                super().step()
                happened = True
        finally:
            self.set(tick)
        return happened

    def begin(self, tick: int) -> None:
        """Drop all events and set the time to `tick`. Resources stay usable; waiting processes never continue."""
        self._queue.clear()
        self._now = tick

    def set(self, tick: int) -> None:
        """Set the time to `tick`, between two steps; the next `advance` processes the events due by then."""
        self._now = tick
