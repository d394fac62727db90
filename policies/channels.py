"""Channels: the neighbour lists of a percept besides those of targets and teammates, by name."""

from __future__ import annotations

import keyword
from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from teamsight.core import checks
from teamsight.core.neighbour_list import Filled, NeighbourList

T = TypeVar("T")


def unknown_channel(channels: Any, name: str) -> Any:
    """Raise the error for a channel that a percept does not have."""
    have = ", ".join(channels._fields) or "none"
    raise AttributeError(
        f"percept.channels.{name}: the group has no such channel; it has {have}; declare it by "
        f"world.senses(group, others, as_={name!r})"
    )


if TYPE_CHECKING:

    class Channels(tuple[T, ...], Generic[T]):
        """The neighbour list of each channel, as an attribute of its name."""

        def __getattr__(self, name: str) -> T: ...
else:
    # Percepts without further channels have this type; others have one of `channels_type`.
    class Channels(NamedTuple):
        """The neighbour list of each channel, as an attribute of its name; without any here."""

        @classmethod
        def __class_getitem__(cls, item):
            return cls

        def __getattr__(self, name):
            return unknown_channel(self, name)


NO_CHANNELS: Any = Channels()

#: The channels that have fields of their own in percepts.
OWN_FIELDS = ("targets", "teammates", "relayed")


@cache
def channels_type(names: tuple[str, ...]) -> Any:
    """Return the NamedTuple with one neighbour list for each of these channels."""
    if not names:
        return Channels
    made = NamedTuple("Channels", [(name, Filled) for name in names])  # type: ignore[misc]
    setattr(made, "__getattr__", unknown_channel)  # noqa: B010
    return made


def channels_of(names: tuple[str, ...], lists: Iterable[Any]) -> Any:
    """Return the channels with these names and neighbour lists."""
    return channels_type(names)._make(lists) if names else NO_CHANNELS


def selected(channels: Any, names: tuple[str, ...], reader: str) -> Channels[NeighbourList]:
    """Return only the channels that a policy reads.

    Raises
    ------
    ValueError
        If the percept lacks one of them.
    """
    have = channels._fields
    if have == names:
        return channels  # type: ignore[no-any-return]
    missing = [name for name in names if name not in have]
    if missing:
        raise ValueError(
            f"{reader}: reads the channel {missing[0]!r}, and the percept has {', '.join(have) or 'none'}; "
            f"declare it in the world: world.senses(group, others, as_={missing[0]!r})"
        )
    return channels_of(names, (getattr(channels, name) for name in names))  # type: ignore[no-any-return]


def checked_channel(name: object) -> str:
    """Return the name of a channel.

    Raises
    ------
    TypeError, ValueError
        If it cannot be an attribute of a percept.
    """
    if not isinstance(name, str):
        raise TypeError(f"as_={checks.shown(name)}: must be the name of a channel, such as 'targets' or 'beacons'")
    is_taken = name == "relayed" or hasattr(tuple, name)
    if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_") or is_taken:
        raise ValueError(f"as_={name!r}: must be a name for an attribute of percepts, such as 'targets' or 'beacons'")
    return name
