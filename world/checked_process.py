"""The generator of a process, whose yields are checked where they are made."""

from __future__ import annotations

import weakref
from collections.abc import Generator
from types import GeneratorType
from typing import Any

from teamsight.core import checks

# The generators of which processes were made.
_started: weakref.WeakSet[GeneratorType[Any, Any, Any]] = weakref.WeakSet()


class NoGeneratorError(TypeError, ValueError):
    """A process was started with what is no generator. SimPy raises a ValueError."""


class NoEventError(TypeError, RuntimeError):
    """A process has yielded what is no event of its clock. SimPy raises a RuntimeError."""


class CheckedGenerator:
    """Stands for a generator in a SimPy process.

    What is no event, or an event of another clock, is refused by an error at the yield. After the clock began again, it
    ends: at its next yield, or where it waits.

    Raises
    ------
    NoGeneratorError
        If it is not a generator.
    ValueError
        If a process was made of it before.
    """

    def __init__(self, clock: Any, generator: Generator[Any, Any, Any]) -> None:
        if not hasattr(generator, "throw"):
            raise NoGeneratorError(
                f"process({checks.shown(generator)}): is not a generator; call the function that yields: process(f(…))"
            )
        self._clock, self._generator, self._beginnings = clock, generator, clock.beginnings
        self.__name__ = getattr(generator, "__name__", type(generator).__name__)
        if isinstance(generator, GeneratorType):
            if generator in _started:
                name = self.__name__
                raise ValueError(
                    f"process({checks.shown(generator)}): a process of this generator was started already; call the "
                    f"function again for another: process({name}(…))"
                )
            _started.add(generator)

    def send(self, value: Any) -> Any:
        """Go on to the next yield; return the event."""
        if self._is_over:
            return self._end()
        return self._checked(self._generator.send(value))

    def throw(self, error: BaseException) -> Any:
        """Go on with an exception at the present yield; return the next event."""
        if self._is_over:
            return self._end()
        return self._checked(self._generator.throw(error))

    @property
    def _is_over(self) -> bool:
        return bool(self._beginnings != self._clock.beginnings)

    def _checked(self, event: Any) -> Any:
        while not self._is_over:
            wrong = self._what_is_wrong(event)
            if not wrong:
                return event
            what = f"Invalid yield value \"{checks.shown(event)}\""
            event = self._generator.throw(NoEventError(f"process {self.__name__}: {what}, {wrong}"))
        return self._end()

    def _what_is_wrong(self, event: Any) -> str:
        if not hasattr(event, "callbacks"):
            return (
                "which is no event; yield one, such as world.clock.timeout(10), world.clock.process(…) or a request of "
                "a resource"
            )
        if event.env is not self._clock:
            return (
                "which is of another clock and may never come here; yield an event of this world, such as "
                "world.clock.timeout(10)"
            )
        return ""

    def _end(self) -> None:
        """End the process, as if its function had returned; what it has in `finally` is done."""
        self._generator.close()
        raise StopIteration
