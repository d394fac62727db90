"""The condition of one agent: whether it takes part, and whether its sensors work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

from teamsight.agents.channel import Channel

if TYPE_CHECKING:
    from teamsight.agents.group import Group


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


def channel_of(group: Group, name: str) -> Channel:
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
