"""mesa's names for a world: its generators, its collector, its space, and calls that users schedule."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

import mesa

from teamsight.agents.events.sources import EventSource
from teamsight.agents.host import check_keywords
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.mesa.bases import Agent, Model
from teamsight.agents.recording.recording import collecting_once
from teamsight.agents.world_data import EVENT
from teamsight.core import checks
from teamsight.world.clock import Planned, check_does_not_yield

if TYPE_CHECKING:
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.host import WorldHost
    from teamsight.agents.mesa.space import WorldSpace
    from teamsight.agents.recording.recording import Recording
    from teamsight.agents.world_data import WorldData
    from teamsight.world.clock import Clock

# mesa's default priority; 1 is high and 10 is low.
DEFAULT_PRIORITY = 5


def clock_priority(priority: Any) -> float:
    """Return the priority on the clock: mesa's default is SimPy's, high ones come before and low ones after.

    Raises
    ------
    TypeError, ValueError
        If it is not a finite number.
    """
    number = checks.number("priority", getattr(priority, "value", priority))
    # Between 0 and 2 for all numbers, in the same order; SimPy's own urgent events, at 0, come first.
    return 1 + math.atan(number - DEFAULT_PRIORITY) * 2 / math.pi


def _check_callable(method: str, function: Any) -> None:
    if not callable(function):
        raise TypeError(f"{method}({checks.shown(function)}): must be callable, such as a function or world.rain")
    check_does_not_yield(function)


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
    changing = ("_count", "_is_active", "_is_paused")

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

    def load(self, data: Any) -> None:
        """Go back to what `save` returned."""
        super().load(data)
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


class MesaModel(Model):
    """mesa's names for a world; `World` derives from it, and has all others.

    Parameters
    ----------
    seed : int
        The seed of `random` and `rng`.
    """

    # `World` sets and defines these.
    clock: Clock
    recording: Recording
    _data: WorldData
    _engine: Engine
    _host: WorldHost
    if TYPE_CHECKING:

        def run(self, steps: int) -> None: ...

    # Beside ``__init__``, Python would take the signature of the class from ``__new__``, so it stands in a base.
    def __new__(cls, *arguments: Any, **named: Any) -> Self:
        # Before Python's own error, which suggests nothing.
        check_keywords(cls, named)
        return super().__new__(cls)

    def __init__(self, seed: int) -> None:
        super().__init__(rng=seed)
        self.random = random.Random(seed)
        self.agents.random = self.random
        mesa_compat.take_over_step(self)

    rng = mesa_compat.LazyGenerator()

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        cls.__signature__ = mesa_compat.signature_for_batches(cls)  # type: ignore[attr-defined]

    def register_agent(self, agent: Agent) -> None:
        """Take an agent into the model and give it its `unique_id`; mesa calls this when an agent is made."""
        mesa_compat.number(self, agent)
        super().register_agent(agent)

    def run_for(self, duration: int) -> None:
        """Make this many steps; mesa's name for `run`."""
        self.run(duration)

    def run_until(self, end_time: int) -> None:
        """Make steps until `tick` is `end_time`."""
        tick = self._data.timeline.tick
        self.run(checks.count("end_time", end_time, least=tick, cure="reset() goes back") - tick)

    def _advance_time(self, until: float) -> None:
        """Make steps until a time; mesa's simulators call this."""
        self.run(int(until) - self._data.timeline.tick)

    @cached_property
    def space(self) -> WorldSpace:
        """The agents' places under the names of mesa's spaces; mesa's visualisation reads it. You may set your own."""
        return self._host.space

    @property
    def datacollector(self) -> mesa.DataCollector:
        """mesa's data collector, a `HistoryCollector` by default. It collects when it is set and after every step.

        There is one row a tick: ``world.datacollector.collect(world)`` replaces that of the present one.
        """
        return self.recording.collector

    @datacollector.setter
    def datacollector(self, collector: mesa.DataCollector) -> None:
        if not callable(getattr(collector, "collect", None)):
            raise TypeError(f"datacollector={checks.shown(collector)}: must be a mesa.DataCollector")
        self._engine.prepare()
        collecting_once(collector, self._data.timeline).collect(self)
        self.recording.collector = collector

    def schedule_event(
        self,
        function: Callable[[], Any],
        *,
        at: float | None = None,
        after: float | None = None,
        priority: int = DEFAULT_PRIORITY,
    ) -> Planned:
        """Call a function once; mesa's name for ``clock.at``.

        Parameters
        ----------
        function : callable
            Called without arguments.
        at, after : float, optional
            The time of the call, or the time from now until it [ticks]; one of them.
        priority : int
            Of simultaneous events, that with the lowest number comes first: a `mesa.time.Priority`, or any number.

        Returns
        -------
        Planned
            The planned call; its method `cancel` takes it back.

        Raises
        ------
        TypeError, ValueError
            If the time has passed or is not a finite number, both or none of `at` and `after` are given, or the
            function cannot be called.
        """
        if (at is None) == (after is None):
            raise ValueError(f"schedule_event(at={at}, after={after}): give one of at and after, as in after=10")
        _check_callable("schedule_event", function)
        time = checks.number("at", at) if after is None else self._mesa_time + checks.number("after", after, least=0)
        planned: Planned = self.clock.plan(time, function, priority=clock_priority(priority))
        self._data.timeline.events_end_steps = True
        return planned

    def schedule_recurring(
        self, function: Callable[[], Any], schedule: float | Schedule, priority: int = DEFAULT_PRIORITY
    ) -> Recurring:
        """Call a function again and again.

        A reset begins it again, and a state holds it: it goes on in this world, and in one that was built in the same
        way.

        Parameters
        ----------
        function : callable
            Called without arguments.
        schedule : mesa.time.Schedule or float
            When; a number is the interval [ticks].
        priority : int
            As for `schedule_event`.

        Returns
        -------
        Recurring
            Its methods `stop`, `pause` and `resume` are those of mesa's.

        Raises
        ------
        TypeError, ValueError
            If the interval is below 1e-6, the start has passed, or the function cannot be called.
        """
        _check_callable("schedule_recurring", function)
        recurring = self._data.sources.attach(self, Recurring(function, schedule, clock_priority(priority)), None)
        self._data.timeline.events_end_steps = True
        return recurring

    @property
    def _mesa_time(self) -> float:
        """The time from which mesa counts: that of the present event, or the number of counted steps."""
        timeline = self._data.timeline
        return float(self.clock.now if timeline.inside == EVENT else self.steps)
