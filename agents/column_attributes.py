"""Columns as attributes: ``robot.battery -= 0.1`` changes an element, ``robots.battery = 1`` all of a column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from teamsight.agents.columns import Column, Columns, unwritable


class Holder(Protocol):
    """The part of `Group` that its columns use; groups import this file."""

    name: str
    columns: Columns
    agent_class: Any

    @property
    def agents(self) -> Sequence[Any]: ...
    def __len__(self) -> int: ...


class ColumnAttribute:
    """An attribute of agents, or of groups, that is a column of some groups.

    In groups without the column it is an ordinary attribute of each agent, and groups do not have it.

    Parameters
    ----------
    name : str
        The name of the column.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, holder: Any, owner: type | None = None) -> Any:
        if holder is None:
            return self
        group, is_group = _group_of(holder)
        if self._name in group.columns:
            column = group.columns[self._name]
            if is_group:
                return column
            element = column[holder.row]
            return unwritable(element) if isinstance(element, np.ndarray) else element
        try:
            return vars(holder)[self._name]
        except KeyError:
            raise AttributeError(f"{holder!r} has no attribute or column {self._name!r}") from None

    def __set__(self, holder: Any, value: Any) -> None:
        group, is_group = _group_of(holder)
        if self._name in group.columns:
            group.columns[self._name][... if is_group else holder.row] = value
        elif is_group:
            raise AttributeError(f"{group!r} has no column {self._name!r}; make it with add_column({self._name!r})")
        else:
            holder.__dict__[self._name] = value

    def __delete__(self, holder: Any) -> None:
        group, is_group = _group_of(holder)
        if self._name in group.columns:
            raise AttributeError(f"{self._name}: is a column of {group.name!r}; remove it with del group.columns[…]")
        if is_group or holder.__dict__.pop(self._name, self) is self:
            raise AttributeError(self._name)


def new_column(group: Holder, name: str, fill: Any) -> Column:
    """Add a column to a group; see `Group.add_column`."""
    if not isinstance(name, str) or not name:
        raise TypeError(f"name={name!r}: must be a string, such as 'battery'")
    if name in group.columns:
        raise ValueError(f"name={name!r}: the group {group.name!r} has this column; take another name")
    if not all(is_free(agent, name) for agent in group.agents):
        raise ValueError(f"name={name!r}: the agents of {group.name!r} have this attribute; take another name")
    value = np.asarray(fill)
    if value.dtype.kind in "US":
        # An array of strings would truncate longer ones.
        value = value.astype(object)
    if value.ndim and len(value) != len(group):
        raise ValueError(f"fill: has the shape {value.shape}; give one value, or {len(group)}, one for each agent")
    install(group, name)
    if value.ndim:
        return group.columns.create(name, np.array(value))
    return group.columns.create(name, np.full(len(group), value, value.dtype), value[()])


def install(group: Holder, name: str) -> None:
    """Make a column an attribute of a group and of its agents."""
    if not isinstance(getattr(group.agent_class, name, None), ColumnAttribute):
        setattr(group.agent_class, name, ColumnAttribute(name))
    if not name.startswith("_") and not hasattr(group, name):
        setattr(type(group), name, ColumnAttribute(name))


def is_free(agent: Any, name: str) -> bool:
    """Whether an agent has no other attribute of this name, which a column would hide."""
    known = getattr(type(agent), name, None)
    return name not in vars(agent) and (known is None or isinstance(known, ColumnAttribute))


def _group_of(holder: Any) -> tuple[Holder, bool]:
    """Return the group of an agent, or the given group; and whether a group was given."""
    group = vars(holder).get("group")
    return (holder, True) if group is None else (group, False)
