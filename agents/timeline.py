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
        The SimPy environment that drives the model; SimPy's own classes accept it, as in ``simpy.Resource(clock)``.
    tick : int
        How many steps have been made.
    running : bool
        Whether `run` goes on.
    """

    clock: Clock
    tick: int
    running: bool

    def _let_events_happen(self) -> bool:
        """Let everything happen that is due; return False if that has stopped the model."""
        was_running = self.running
        self.clock.advance(self.tick)
        return self.running or not was_running

    @property
    def now(self) -> float:
        """The time [ticks]; while an event happens, its exact time."""
        return float(self.clock.now)

    def at(self, time: float, action: Callable[[], Any]) -> None:
        """Call `action()` at `time` [ticks]; it takes effect before the step that starts at the next whole tick.

        An action that sets ``running = False`` stops the model at once: that step is not made.

        Parameters
        ----------
        time : float
            When; not before `now`.
        action : callable
            Called without arguments.

        Raises
        ------
        TypeError, ValueError
            If `action` cannot be called, or `time` is not finite or has passed.
        """
        self.clock.at(time, action)

    def process(self, generator: Generator[Any, Any, Any]) -> Any:
        """Start a process: a generator that yields SimPy events such as ``world.timeout(10)``.

        Returns
        -------
        simpy.Process
        """
        return self.clock.process(generator)

    def timeout(self, delay: float) -> Any:
        """Return an event that happens after `delay` [ticks]; for use in a process."""
        return self.clock.timeout(delay)
