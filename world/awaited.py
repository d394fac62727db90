"""Whether a process waits for an event of SimPy, directly or through conditions such as ``a | b``."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterable
from typing import Any


class Waiting(list[Any]):
    """The callbacks of an event: SimPy adds those that wait and removes those that no longer do, as after an interrupt.

    Parameters
    ----------
    event : simpy.Event
        The event.
    changed : callable
        Called without arguments whenever `is_awaited` may have changed.
    callbacks : iterable, optional
        The callbacks that the event has.
    """

    def __init__(self, event: Any, changed: Callable[[], None], callbacks: Iterable[Any] = ()) -> None:
        super().__init__(callbacks)
        self._event, self._changed = weakref.ref(event), [changed]

    @property
    def is_awaited(self) -> bool:
        """Whether a process waits for the event."""
        return any(self._is_waiting(callback) for callback in self)

    def _is_waiting(self, callback: Any) -> bool:
        owner: Any = getattr(callback, "__self__", None)
        if owner is self._event():
            return False
        # A condition that nobody waits for keeps its callbacks in its events.
        above = owner.callbacks if _is_condition(owner) else None
        return not isinstance(above, Waiting) or above.is_awaited

    def append(self, callback: Any) -> None:
        """Add one that waits."""
        super().append(callback)
        owner: Any = getattr(callback, "__self__", None)
        if owner is not self._event() and _is_condition(owner):
            if type(owner.callbacks) is list:
                owner.callbacks = Waiting(owner, self._notify, owner.callbacks)
            elif isinstance(owner.callbacks, Waiting):
                owner.callbacks._changed.append(self._notify)
        self._notify()

    def remove(self, callback: Any) -> None:
        """Remove one that no longer waits."""
        super().remove(callback)
        self._notify()

    def _notify(self) -> None:
        for changed in self._changed:
            changed()


def _is_condition(owner: Any) -> bool:
    # Only the clock imports simpy.
    return hasattr(owner, "_evaluate") and hasattr(owner, "_events")


class Kept:
    """An event that is kept while a process waits for it: nothing else refers to a process that waits.

    An event for which nobody waits is kept by whoever holds it, and is gone if nobody does.
    """

    def __init__(self, event: Any) -> None:
        self.event: Callable[[], Any] = weakref.ref(event)
        self._held: Any = None
        mine = weakref.ref(self)
        event.callbacks = Waiting(event, lambda: _hold(mine()), event.callbacks)

    def hold(self) -> None:
        """Keep the event as long as it is awaited."""
        event = self.event()
        waiting = None if event is None else event.callbacks
        self._held = event if isinstance(waiting, Waiting) and waiting.is_awaited else None


def _hold(kept: Kept | None) -> None:
    if kept is not None:
        kept.hold()
