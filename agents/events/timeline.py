"""The timeline of a world: the present tick, due events, and which of the user's functions is being called."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from teamsight.world.clock import Clock

DECIDE, EVENT, CONDITION, OWN_STEP = "decide", "an event", "a condition", "an agent's own step"


class Timeline:
    """The time of a world.

    Attributes
    ----------
    clock : Clock
        The SimPy environment with the world's events.
    tick : int
        The number of completed steps.
    jumps : int
        The sum of the changes of `tick` by `reset` and `restore`.
    inside : str
        Which of the user's functions is being called; the world cannot be advanced meanwhile.
    events_end_steps : bool
        Whether the events of a tick happen at the end of the step that leads to it, as in mesa, and not before the
        next step.
    """

    def __init__(self) -> None:
        self.clock = Clock()
        self.tick = self.jumps = 0
        self.inside = ""
        self.events_end_steps = False

    @contextlib.contextmanager
    def calling(self, what: str) -> Iterator[None]:
        """Mark the time during which a function of the user's is called."""
        before, self.inside = self.inside, what
        try:
            yield
        finally:
            self.inside = before

    def check_outside(self, what: str) -> None:
        """Refuse to advance the world while a function of the user's is called."""
        if self.inside:
            cure = "call it between steps"
            if self.inside == EVENT:
                cure += "; a process lets the world go on by yield world.clock.timeout(1)"
            raise RuntimeError(f"{what}: called in {self.inside}, before a step is complete; {cure}")

    def check_undecided(self, what: str, cure: str) -> None:
        """Refuse to change groups while they decide."""
        if self.inside == DECIDE:
            raise RuntimeError(f"{what}: called in {DECIDE}, before all agents have decided; {cure}")

    @property
    def is_in_event(self) -> bool:
        """Whether an event is being processed."""
        return self.inside == EVENT

    def process_events(self) -> None:
        """Process all events that are due."""
        if self.clock.ticks_until_event(self.tick) <= 0:
            with self.calling(EVENT):
                self.clock.advance(self.tick)

    def set(self, tick: int) -> None:
        """Set the tick after completed steps."""
        self.tick = tick
        self.clock.set(tick)

    def jump(self, tick: int) -> None:
        """Set the tick and drop all pending events."""
        self.jumps += tick - self.tick
        self.tick = tick
        self.clock.begin(tick)


class AgentLeftError(RuntimeError):
    """Raised in a process that waits for something that cannot come, because an agent has left the world."""
