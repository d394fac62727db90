"""The timeline of a world: events and processes on the clock, and the time that they see."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Iterator
from typing import Any

from teamsight.world.clock import Clock

DECIDE = "decide"


class Timeline:
    """What of a `World` has to do with discrete events.

    Attributes
    ----------
    clock : Clock
        The SimPy environment that drives the model; SimPy's own classes accept it, as in ``simpy.Resource(clock)``.
    running : bool
        Whether `run` goes on.
    """

    clock: Clock
    running: bool
    _tick: int
    # By how much resets and restored states have moved the tick, all together.
    _jumps = 0
    # What of the user's is being called, if anything: the world cannot be advanced meanwhile.
    _inside = ""

    @property
    def tick(self) -> int:
        """How many steps have been made."""
        return self._tick

    @contextlib.contextmanager
    def _calling(self, what: str) -> Iterator[None]:
        """Call something of the user's, in which the world cannot be advanced."""
        before, self._inside = self._inside, what
        try:
            yield
        finally:
            self._inside = before

    def _check_outside(self, what: str) -> None:
        """Refuse what advances the world while something of the user's is being called."""
        if self._inside:
            raise RuntimeError(f"{what}: called in {self._inside}, in the middle of a step; call it between steps")

    def _check_undecided(self, what: str, cure: str) -> None:
        """Refuse what changes groups while they decide."""
        if self._inside == DECIDE:
            raise RuntimeError(f"{what}: called in {DECIDE}, while others are still to decide; {cure}")

    def _let_events_happen(self) -> bool:
        """Let everything happen that is due; return False if that has stopped the model."""
        if self.clock.ticks_until_event(self._tick) > 0:
            return True
        was_running = self.running
        with self._calling("an event"):
            self.clock.advance(self._tick)
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
