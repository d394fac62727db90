"""The named parts of a percept: channels, the neighbour lists besides those of targets and teammates, and columns."""

from __future__ import annotations

import keyword
import math
from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
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


#: What policies can read of all bodies like a column: the column of the table of bodies, and the part of its elements.
OF_BODIES = {
    "position_x": ("position", 0), "position_y": ("position", 1), "heading_x": ("heading", 0),
    "heading_y": ("heading", 1), "moved_x": ("moved", 0), "moved_y": ("moved", 1),
    "speed": ("speed", 0), "radius": ("radius", 0), "bumps": ("bumps", 0), "blocked": ("blocked", 0),
}  # fmt: skip

#: One element for each identity in the world.
ByIdentity = Annotated[npt.NDArray[np.float64], "identities"]


def unknown_column(columns: Any, name: str) -> Any:
    """Raise the error for a column that a percept does not have."""
    have = ", ".join(columns._fields) or "none"
    raise AttributeError(
        f"percept.columns.{name}: the percept has no such column; it has {have}; declare it in the policy, as in "
        f"columns = ({name!r},)"
    )


if TYPE_CHECKING:

    class PerceivedColumns(tuple[npt.NDArray[np.float64], ...]):
        """The columns that a policy reads, as attributes of their names."""

        def __getattr__(self, name: str) -> npt.NDArray[np.float64]: ...
else:

    class PerceivedColumns(NamedTuple):
        """The columns that a policy reads, as attributes of their names; none here."""

        def __getattr__(self, name):
            return unknown_column(self, name)


NO_COLUMNS: Any = PerceivedColumns()


@cache
def columns_type(names: tuple[str, ...]) -> Any:
    """Return the NamedTuple with one array for each of these columns."""
    if not names:
        return PerceivedColumns
    made = NamedTuple("PerceivedColumns", [(name, ByIdentity) for name in names])  # type: ignore[misc]
    setattr(made, "__getattr__", unknown_column)  # noqa: B010
    return made


def columns_of(names: tuple[str, ...], arrays: Any) -> Any:
    """Return the columns with these names and arrays."""
    return columns_type(names)._make(arrays) if names else NO_COLUMNS


def selected_columns(columns: Any, names: tuple[str, ...], reader: str) -> Any:
    """Return only the columns that a policy reads.

    Raises
    ------
    ValueError
        If the percept lacks one of them.
    """
    have = columns._fields
    if have == names:
        return columns
    for name in names:
        if name not in have:
            raise ValueError(
                f"{reader}: reads the column {name!r}, and the percept has {', '.join(have) or 'none'}; add it to a "
                f"group of the world: group.add_column({name!r})"
            )
    return columns_of(names, (getattr(columns, name) for name in names))


@inlined
def column_of(column: Any, identity: int) -> float:
    """Return what a column holds of an agent; NaN if the agent does not have it, or its identity is hidden.

    Parameters
    ----------
    column : ndarray, shape (identities,), float64
        A column of a percept, ``percept.columns.NAME``.
    identity : int
        The agent: ``percept.identity[i]`` for the robot itself, ``percept.teammates.identity[k]`` for a teammate.
    """
    if identity < 0 or identity >= column.shape[0]:
        return math.nan
    return column[identity]  # type: ignore[no-any-return]
