"""The event methods of mesa 3.5, on the clock of a world; also with versions of mesa that do not have them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from teamsight.agents.events.event_methods import EventMethods
from teamsight.core import checks
from teamsight.world.clock import check_does_not_yield

if TYPE_CHECKING:
    from teamsight.agents.events.recurring import Recurring, Schedule
    from teamsight.world.clock import Planned

# mesa's default priority; 1 is high and 10 is low.
_DEFAULT = 5


class MesaEvents(EventMethods):
    """mesa's event methods; `World` derives from it.

    They act on `World.clock`, whose unit is the tick, as is mesa's. Once one of them has planned an event, the events
    of a tick happen at the end of the step that leads to it, as in mesa; otherwise before the next step.
    """

    clock: Any

    def schedule_event(
        self,
        function: Callable[[], Any],
        *,
        at: float | None = None,
        after: float | None = None,
        priority: int = _DEFAULT,
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
        self, function: Callable[[], Any], schedule: float | Schedule, priority: int = _DEFAULT
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
        from teamsight.agents.events.recurring import Recurring

        _check_callable("schedule_recurring", function)
        recurring = self.attach(Recurring(function, schedule, clock_priority(priority)))
        self._data.timeline.events_end_steps = True
        return recurring

    @property
    def _mesa_time(self) -> float:
        """The time from which mesa counts: that of the present event, or the number of counted steps."""
        timeline = self._data.timeline
        return float(self.clock.now if timeline.is_in_event else self.steps)


def clock_priority(priority: Any) -> float:
    """Return the priority on the clock: mesa's default is SimPy's, high ones come before and low ones after.

    Raises
    ------
    TypeError, ValueError
        If it is not a finite number.
    """
    number = checks.number("priority", getattr(priority, "value", priority))
    # Between 0 and 2 for all numbers, in the same order; SimPy's own urgent events, at 0, come first.
    return 1 + math.atan(number - _DEFAULT) * 2 / math.pi


def _check_callable(method: str, function: Any) -> None:
    if not callable(function):
        raise TypeError(f"{method}({checks.shown(function)}): must be callable, such as a function or world.rain")
    check_does_not_yield(function)
