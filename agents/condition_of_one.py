"""The condition of agents, as users read it: whether one takes part, and whether its sensors work."""

from __future__ import annotations

from typing import Any, Protocol, overload

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import Channel


class Members(Protocol):
    """The part of `Group` that is used here; groups import this file."""

    name: str
    channels: dict[str, Channel]


class Active:
    """Whether an agent takes part: an element of the array `active` of its group."""

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    @overload
    def __get__(self, agent: None, owner: type) -> Active: ...
    @overload
    def __get__(self, agent: object, owner: type) -> bool: ...
    def __get__(self, agent: Any, owner: type) -> Active | bool:
        return self if agent is None else bool(agent.group.bodies.active[agent.row])

    def __set__(self, agent: Any, value: bool) -> None:
        agent.group.host.set_active(agent, value)


def channel_of(group: Members, name: str) -> Channel:
    """Return a channel of a group.

    Raises
    ------
    KeyError
        If the group has no such channel.
    """
    try:
        return group.channels[name]
    except (KeyError, TypeError):
        have = ", ".join(map(repr, group.channels)) or "none"
        raise KeyError(
            f"{name!r}: the group {group.name!r} has no such channel, but {have}; declare it by world.senses(…, as_=…)"
        ) from None


def note_of_inactive(active: npt.NDArray[np.bool_]) -> str:
    """Return how many agents are inactive, to write after their number; empty if none is."""
    inactive = len(active) - int(active.sum())
    return f" ({inactive:,} inactive)" if inactive else ""
