"""The clock: SimPy's environment, counted in ticks, drives the model. The only file that imports simpy."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

import simpy

from teamsight import checks

# SimPy adds delays to the present time; 0.1 + 2.9 must still count as the whole tick 3.
_ROUNDING = 1e-9


class Clock:
    """Discrete-event time.

    Physics makes one step from each whole tick to the next. An event at time t takes effect before the step that starts
    at the first whole tick not before t; its exact time is kept by `now` while it happens.
    """

    def __init__(self) -> None:
        self.environment = simpy.Environment()

    @property
    def now(self) -> float:
        """The time [ticks]."""
        return float(self.environment.now)

    def at(self, time: float, action: Callable[[], Any], tick: int | None = None) -> None:
        """Call `action` once, at `time` [ticks].

        Parameters
        ----------
        time : float
            When.
        action : callable
            What.
        tick : int, optional
            The present tick, when called between steps: the clock itself may still stand at the last event.

        Raises
        ------
        ValueError
            If `time` is not finite or has passed.
        TypeError
            If `action` cannot be called, or `time` is no number.
        """
        if not callable(action):
            raise TypeError(f"at({time!r}, {action!r}): the second argument must be callable, such as a function")
        now = self.now if tick is None else float(tick)
        if checks.number("time", time) < now:
            raise ValueError(f"time={time:g}: has passed; it must be at least now, {now:g}")
        self.environment.timeout(time - self.environment.now).callbacks.append(lambda _: action())

    def process(self, generator: Generator[Any, Any, Any], tick: int | None = None) -> Any:
        """Start a user's process: a generator that yields SimPy events, such as ``clock.timeout(10)``.

        Parameters
        ----------
        generator : generator
            The process.
        tick : int, optional
            As for `at`; the process begins at this tick.

        Raises
        ------
        TypeError
            If it is no generator.
        """
        if not hasattr(generator, "throw"):
            raise TypeError(
                f"process({generator!r}): must be a generator; call the function that yields: process(f(…))"
            )
        return self.environment.process(generator if tick is None else self._from(tick, generator))

    def _from(self, tick: int, generator: Generator[Any, Any, Any]) -> Generator[Any, Any, Any]:
        yield self.timeout(0, tick)
        return (yield from generator)

    def timeout(self, delay: float, tick: int | None = None) -> Any:
        """Return an event that happens after `delay` [ticks], finite and at least 0; for use in a process."""
        checks.number("delay", delay, least=0)
        late = 0.0 if tick is None else tick - self.environment.now
        return self.environment.timeout(late + delay)

    def ticks_until_event(self, tick: int) -> float:
        """Return how many whole steps can be made from `tick` before the next event takes effect; inf without one."""
        time = self.environment.peek()
        return math.inf if math.isinf(time) else max(math.ceil(time - _ROUNDING) - tick, 0)

    def advance(self, tick: int) -> bool:
        """Let everything happen that is due at or before `tick`; return whether anything did."""
        environment = self.environment
        happened = False
        while environment.peek() <= tick + _ROUNDING:
            environment.step()
            happened = True
        self.catch_up(tick)
        return happened

    def catch_up(self, tick: int) -> None:
        """Set the time to `tick`; what was due earlier happens."""
        if self.environment.now < tick:
            self.environment.run(until=tick)
            # SimPy leaves the event that stopped it at the head of its queue.
            self.environment.step()
