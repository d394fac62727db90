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

    SimPy's own classes accept it, as in ``simpy.Resource(world.clock)``. Physics makes one step from each whole tick to
    the next. An event at time t takes effect before the step that starts at the first whole tick not before t; `now` is
    its exact time while it happens, and the present tick at all other times.
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
            If `action` cannot be called, or `time` is no number.
        """
        if not callable(action):
            shown = f"at({checks.shown(time)}, {checks.shown(action)})"
            raise TypeError(f"{shown}: the second argument must be callable, such as a function")
        moment = checks.number("time", time)
        if moment < self.now:
            raise ValueError(f"time={moment:g}: has passed; it must be at least now, {self.now:g}")
        simpy.Timeout(self, moment - self.now).callbacks.append(lambda _: action())

    def process(self, generator: Generator[Any, Any, Any]) -> Any:
        """Start a process: a generator that yields SimPy events, such as ``clock.timeout(10)``.

        Raises
        ------
        TypeError
            If it is no generator.
        """
        if not hasattr(generator, "throw"):
            raise TypeError(
                f"process({checks.shown(generator)}): must be a generator; call the function that yields: process(f(…))"
            )
        return simpy.Process(self, generator)

    def timeout(self, delay: float, value: Any = None) -> Any:
        """Return an event that happens after `delay` [ticks], finite and at least 0; for use in a process.

        Parameters
        ----------
        delay : float
            Time from now [ticks].
        value : object, optional
            What the event gives to the process that waits for it.
        """
        return simpy.Timeout(self, checks.number("delay", delay, least=0), value)

    def schedule(self, event: Any, priority: Any = simpy.events.NORMAL, delay: float = 0) -> None:
        """Put an event into the queue, `delay` [ticks] from now; SimPy's own classes call this.

        Parameters
        ----------
        event : simpy.Event
            What happens.
        priority : int
            Among events of one time, the lowest first.
        delay : float
            When, from now.

        Raises
        ------
        ValueError
            If the delay is negative or no number.
        """
        if not 0 <= delay < math.inf:
            raise ValueError(f"delay={delay}: must be a finite number, at least 0")
        super().schedule(event, priority, delay)

    def step(self) -> None:
        """Refused, as `run` is.

        Raises
        ------
        TypeError
            Always.
        """
        raise TypeError("clock.step(): the world drives its clock; call world.step()")

    def run(self, until: Any = None) -> Any:
        """Refused: physics would stand still meanwhile.

        Raises
        ------
        TypeError
            Always.
        """
        raise TypeError("clock.run(…): the world drives its clock; call world.run(steps)")

    def ticks_until_event(self, tick: int) -> float:
        """Return how many whole steps can be made from `tick` before the next event takes effect; inf without one."""
        time = self.peek()
        return math.inf if math.isinf(time) else max(math.ceil(time - _ROUNDING) - tick, 0)

    def advance(self, tick: int) -> bool:
        """Let everything happen that is due at or before `tick`; return whether anything did."""
        happened = False
        try:
            while self.peek() <= tick + _ROUNDING:
                super().step()
                happened = True
        finally:
            self.set(tick)
        return happened

    def begin(self, tick: int) -> None:
        """Drop all events and set the time to `tick`. Resources stay usable; processes that wait do so for ever."""
        self._queue.clear()
        self._now = tick

    def set(self, tick: int) -> None:
        """Set the time between two steps to `tick`; what is due by then happens with the next `advance`."""
        self._now = tick
