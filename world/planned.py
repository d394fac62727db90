"""A call that is planned on a clock, and what events call."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappush
from inspect import isgeneratorfunction
from types import GeneratorType
from typing import Any

import simpy


class Planned(simpy.Event):  # type: ignore[misc]
    """A call that is planned on a clock. It can be cancelled before it happens, and processes can wait for it.

    Attributes
    ----------
    time : float
        The time of the call [ticks].
    priority, order : float, int
        Of simultaneous calls, that with the lowest priority comes first; of these, that with the lowest order: the one
        that was planned first.
    action, arguments : callable, tuple
        What is called.
    links : int
        See `Clock.links_to`.
    is_cancelled : bool
        Whether it was cancelled.
    """

    _ok = True
    _value = None
    callbacks: Any
    is_cancelled = False

    def __init__(
        self, clock: Any, time: float, priority: float, order: int, action: Callable[..., Any], arguments: Any
    ) -> None:
        self.env, self.callbacks = clock, [_call]
        self.time, self.priority, self.order = time, priority, order
        self.action, self.arguments = action, arguments
        self.links = clock.links_to(time)
        heappush(clock._queue, (time, priority, order, self))

    def cancel(self) -> None:
        """Take the call back. It has no effect on one that has happened or was cancelled before."""
        if self.callbacks is not None:
            self.callbacks, self.is_cancelled = None, True
            self.env.forget_cancelled()

    def __repr__(self) -> str:
        name = getattr(self.action, "__name__", type(self.action).__name__)
        past = " (cancelled)" if self.is_cancelled else " (happened)" if self.callbacks is None else ""
        return f"<{name}{self.arguments or '()'} planned at {self.time:g}{past}>"


def _call(planned: Planned) -> None:
    clock, action = planned.env, planned.action
    clock.caller = getattr(action, "__self__", None)
    try:
        result = action(*planned.arguments)
    finally:
        clock.caller = None
    if type(result) is GeneratorType:
        raise _never_runs(action)


def check_does_not_yield(action: Any) -> None:
    """Refuse to plan a function that yields, which would do nothing when it is called.

    Raises
    ------
    TypeError
        If it does.
    """
    if isgeneratorfunction(action):
        raise _never_runs(action)


def _never_runs(action: Any) -> TypeError:
    """Return the error for a planned call that has only made a generator."""
    name = getattr(action, "__name__", type(action).__name__)
    return TypeError(f"the planned call {name} yields, so it does nothing; start a process: clock.process({name}())")


def callbacks_of(event: Any) -> list[Any]:
    """Return what an event calls, except SimPy's resources, which have done their part when it is in the queue."""
    resource = simpy.resources.base.BaseResource
    return [one for one in event.callbacks or () if not isinstance(getattr(one, "__self__", None), resource)]


def is_whole(event: Any) -> bool:
    """Whether all that an event calls are methods of objects that defer Ctrl-C, as event sources do."""
    called = [event] if isinstance(event, Planned) and len(event.callbacks) == 1 else callbacks_of(event)
    owners = [getattr(getattr(one, "action", None), "__self__", None) for one in called]
    return all(getattr(owner, "defers_interrupts", False) for owner in owners)
