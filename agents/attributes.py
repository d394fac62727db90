"""Attributes of agents, groups and worlds: the types of values, and what assignment does, or why it is refused.

The names are for completion in editors; a test compares them with the registries. Any other name of a policy or a
degree of awareness is a ``str``, so that it may come from a variable; a wrong one raises an error at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, Literal, Protocol, TypeAlias, TypeVar, overload

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Awareness
from teamsight.core import checks
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import Rule

PolicyName: TypeAlias = Literal[
    "a-cmommt",
    "b-cmommt",
    "centroid",
    "evasive",
    "evolved",
    "lattice-walk",
    "lazy-collective",
    "lazy-cooperative",
    "p-cmommt",
    "random-walk",
    "stationary",
]
AwarenessName: TypeAlias = Literal["none", "ring", "nearest", "pairwise", "shared"]
PlacementName: TypeAlias = Literal["uniform", "spread", "cells"]

PolicyLike: TypeAlias = Policy | Rule | PolicyName | str
AwarenessLike: TypeAlias = Awareness | AwarenessName | str


class Arrayed(Protocol):
    """An array, or what NumPy turns into one: a `Column`, or a column of a table."""

    def __array__(self) -> npt.NDArray[Any]:
        """Return the array."""
        ...


# As npt.ArrayLike, but without strings, so that type checkers refuse those.
Numbers: TypeAlias = float | Sequence[float] | Sequence[Arrayed] | Arrayed
Points: TypeAlias = Sequence[float] | Sequence[Sequence[float]] | Sequence[Arrayed] | Arrayed
Rows: TypeAlias = Sequence[int] | Arrayed

# What `numpy.random.default_rng` takes, as SPEC 7 of Scientific Python wants it of every `rng`.
SeedLike: TypeAlias = (
    int | Sequence[int] | npt.NDArray[np.integer[Any]] | np.random.SeedSequence | np.random.BitGenerator
    | np.random.Generator | np.random.RandomState | None
)  # fmt: skip


C = TypeVar("C", bound=type)
Got = TypeVar("Got", covariant=True)
Given = TypeVar("Given", contravariant=True)


class Setting(Generic[Got, Given]):
    """An attribute that one function reads and another changes. What may be assigned can be of more types.

    Parameters
    ----------
    get : callable
        ``get(owner, name)`` returns the value.
    change : callable
        ``change(owner, name, value)`` checks a new value and sets it, or raises an error.
    doc : str
        Its docstring.
    """

    def __init__(self, get: Callable[[Any, str], Got], change: Callable[[Any, str, Any], None], doc: str) -> None:
        self._get, self._change = get, change
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, holder: None, owner: type) -> Setting[Got, Given]: ...
    @overload
    def __get__(self, holder: object, owner: type) -> Got: ...
    def __get__(self, holder: Any, owner: type) -> Any:
        return self if holder is None else self._get(holder, self._name)

    def __set__(self, holder: Any, value: Given) -> None:
        self._change(holder, self._name, value)


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
