"""The timeline of a world: events and processes on the clock, and the time that they see."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

from teamsight.world.clock import Clock


class Timeline:
    """What of a `World` has to do with discrete events.

    Attributes
    ----------
    clock : Clock
        The SimPy environment that drives the model.
    tick : int
        How many steps have been made.
    running : bool
        Whether the model goes on; an exception in an event stops it.
    """

    clock: Clock
    tick: int
    running: bool
    _in_event = False

    def _let_events_happen(self) -> None:
        self._in_event = True
        try:
            self.clock.advance(self.tick)
        except BaseException:
            self.running = False
            raise
        finally:
            self._in_event = False

    @property
    def now(self) -> float:
        """The time [ticks]; while an event happens, its exact time."""
        return self.clock.now if self._in_event else float(self.tick)

    def at(self, time: float, action: Callable[[], Any]) -> None:
        """Call `action()` at `time` [ticks]; it takes effect before the step that starts at the next whole tick.

        Raises
        ------
        TypeError, ValueError
            If `action` cannot be called, or `time` is not finite or has passed.
        """
        self.clock.at(time, action, self._tick_between_steps)

    def process(self, generator: Generator[Any, Any, Any]) -> Any:
        """Start a process: a generator that yields SimPy events such as ``world.timeout(10)``.

        Returns
        -------
        simpy.Process
        """
        return self.clock.process(generator, self._tick_between_steps)

    def timeout(self, delay: float) -> Any:
        """Return an event that happens after `delay` [ticks]; for use in a process."""
        return self.clock.timeout(delay, self._tick_between_steps)

    @property
    def _tick_between_steps(self) -> int | None:
        return None if self._in_event else self.tick
