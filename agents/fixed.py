"""Fixed attributes: properties whose assignment raises an error that names the cure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from teamsight.core import checks

C = TypeVar("C", bound=type)


def refusing(**cures: str) -> Callable[[C], C]:
    """Return a class decorator: assignments to these read-only properties raise an error with the cure.

    For type checkers, which do not see it, the properties stay read-only.
    """

    def decorate(owner: C) -> C:
        for name, cure in cures.items():
            found = next(vars(base)[name] for base in owner.__mro__ if name in vars(base))
            setattr(owner, name, found.setter(_refusal(name, cure)))
        return owner

    return decorate


def _refusal(name: str, cure: str) -> Callable[[Any, Any], None]:
    def refuse(self: Any, value: Any) -> None:
        raise AttributeError(f"{name}={checks.shown(value)}: cannot be set; {cure}")

    return refuse


class Kept:
    """An attribute that is put into the object's dictionary by `put`, and cannot be set.

    Without a `__get__`, so reading it costs nothing.
    """

    def __init__(self, cure: str) -> None:
        self._cure = cure

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __set__(self, owner: Any, value: Any) -> None:
        raise AttributeError(f"{self._name}={checks.shown(value)}: cannot be set; {self._cure}")


def put(owner: object, **values: Any) -> None:
    """Put attributes that are `Kept` into an object's dictionary."""
    vars(owner).update(values)
