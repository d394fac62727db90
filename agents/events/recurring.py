"""A function that is called again and again: mesa's recurring events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Protocol

from teamsight.agents.events.source import EventSource
from teamsight.core import checks
from teamsight.world.clock import Planned

# Shorter intervals would let the clock stand still.
_LEAST = 1e-6


class Schedule(Protocol):
    """What is read of mesa 3.5's ``mesa.time.Schedule``; see `Recurring`."""

    @property
    def interval(self) -> Any: ...
    @property
    def start(self) -> float | None: ...
    @property
    def end(self) -> float | None: ...
    @property
    def count(self) -> int | None: ...


class Recurring(EventSource):
    """Calls a function again and again; `World.schedule_recurring` returns it.

    Parameters
    ----------
    function : callable
        Called without arguments.
    schedule : mesa.time.Schedule or float
        When: its `interval` [ticks], a number or a function of the world that returns one, the time of the first call
        (`start`), the last time (`end`), and the number of calls (`count`). A number is the interval.
    priority : float
        The priority on the clock.

    Raises
    ------
    TypeError, ValueError
        If the interval is not a number of at least 1e-6.
    """

    needs_group: ClassVar[bool] = False
    # The user's function may never return.
    defers_interrupts: ClassVar[bool] = False

    def __init__(self, function: Callable[[], Any], schedule: float | Schedule, priority: float) -> None:
        self.function, self.schedule, self.priority = function, schedule, priority
        self._interval: Any = getattr(schedule, "interval", schedule)
        if not callable(self._interval):
            self._interval = checks.number("interval", self._interval, least=_LEAST)
        self._next: Planned | None = None
        self._count, self._is_active, self._is_paused = 0, False, False

    def begin(self) -> None:
        """Plan the first call."""
        self._count, self._is_active, self._is_paused = 0, True, False
        start = getattr(self.schedule, "start", None)
        self._plan_at(self.world._mesa_time + self._wait() if start is None else start)

    def happen(self) -> None:
        """Call the function, and plan the next call."""
        self._next = None
        self._count += 1
        try:
            self.function()
        finally:
            # The function may have stopped it, or begun the run again.
            if self._is_active and not self._is_paused and self._next is None:
                self._plan_next()

    def stop(self) -> None:
        """Call the function no more."""
        self._is_active = self._is_paused = False
        self._take_back()

    def pause(self) -> None:
        """Call the function no more, until `resume`."""
        if self._is_active:
            self._is_paused = True
            self._take_back()

    def resume(self) -> None:
        """Go on after `pause`; the next call is one interval from now."""
        if self._is_active and self._is_paused:
            self._is_paused = False
            self._plan_next()

    @property
    def is_active(self) -> bool:
        """Whether the function will be called again, also while it is paused."""
        return self._is_active

    @property
    def execution_count(self) -> int:
        """The number of calls."""
        return self._count

    @property
    def next_scheduled_time(self) -> float | None:
        """The time of the next call [ticks]; None if none is planned."""
        return None if self._next is None else self._next.time

    def save(self) -> tuple[int, bool, bool]:
        """Return the number of calls, and whether it is active and paused."""
        return self._count, self._is_active, self._is_paused

    def load(self, data: tuple[int, bool, bool]) -> None:
        """Go back to what `save` returned."""
        self._count, self._is_active, self._is_paused = data
        self._next = next(iter(self.pending("happen")), None)

    def __repr__(self) -> str:
        name = getattr(self.function, "__qualname__", type(self.function).__name__)
        every = getattr(self._interval, "__qualname__", self._interval)
        limits = {limit: getattr(self.schedule, limit, None) for limit in ("start", "end", "count")}
        given = [f"{limit}={value}" for limit, value in limits.items() if value is not None]
        return f"Recurring({', '.join([name, f'interval={every}', *given])})"

    def _wait(self) -> float:
        interval = self._interval
        return checks.number("interval", interval(self.world), least=_LEAST) if callable(interval) else interval

    def _plan_next(self) -> None:
        time = self.world._mesa_time + self._wait()
        count, end = (getattr(self.schedule, limit, None) for limit in ("count", "end"))
        if (count is not None and self._count >= count) or (end is not None and time > end):
            self._is_active = False
        else:
            self._plan_at(time)

    def _plan_at(self, time: float) -> None:
        self._next = self.clock.plan(time, self.happen, priority=self.priority)

    def _take_back(self) -> None:
        self.cancel(self._next)
        self._next = None
