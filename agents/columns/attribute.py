"""Columns as attributes of agents: ``robot.battery -= 0.1`` changes the robot's element of the column "battery"."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.agents.columns.read_only import unwritable

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.group import Group


class ColumnAttribute:
    """An attribute of a class of agents that is a column in some of its groups.

    In groups without the column it is an ordinary attribute of each agent.

    Parameters
    ----------
    name : str
        The name of the column.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, agent: Body | None, owner: type | None = None) -> Any:
        if agent is None:
            return self
        columns = agent.group.columns
        if self._name in columns:
            element = columns[self._name][agent.row]
            return unwritable(element) if isinstance(element, np.ndarray) else element
        try:
            return vars(agent)[self._name]
        except KeyError:
            raise AttributeError(f"{type(agent).__name__!r} object has no attribute {self._name!r}") from None

    def __set__(self, agent: Body, value: Any) -> None:
        columns = agent.group.columns
        if self._name in columns:
            columns[self._name][agent.row] = value
        else:
            agent.__dict__[self._name] = value

    def __delete__(self, agent: Body) -> None:
        if self._name in agent.group.columns:
            raise AttributeError(f"{self._name}: is a column of {agent.group.name!r}; del group.columns[…] drops it")
        if agent.__dict__.pop(self._name, self) is self:
            raise AttributeError(self._name)


class GroupColumn:
    """An attribute of groups that is a column in some of them: ``robots.battery = 1.0`` sets the elements of all.

    Parameters
    ----------
    name : str
        The name of the column.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, group: Group | None, owner: type | None = None) -> Any:
        if group is None:
            return self
        if self._name not in group.columns:
            raise AttributeError(f"{group!r} has no column {self._name!r}")
        return group.columns[self._name]

    def __set__(self, group: Group, value: Any) -> None:
        if self._name not in group.columns:
            raise AttributeError(f"{group!r} has no column {self._name!r}; make it with add_column({self._name!r})")
        group.columns[self._name] = value


def install(group: Group, name: str) -> None:
    """Let a group and its agents have a column as an attribute."""
    for kind in {type(agent) for agent in group.agents}:
        if not isinstance(getattr(kind, name, None), ColumnAttribute):
            setattr(kind, name, ColumnAttribute(name))
    if not name.startswith("_") and not hasattr(group, name):
        setattr(type(group), name, GroupColumn(name))


def is_free(agent: Any, name: str) -> bool:
    """Whether an agent has no other attribute of this name, which a column would hide."""
    known = getattr(type(agent), name, None)
    return name not in vars(agent) and (known is None or isinstance(known, ColumnAttribute))
