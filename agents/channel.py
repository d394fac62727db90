"""Channels: what a group senses, by name, and with which sensor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, MutableMapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.sensing.sensor import Sensor
from teamsight.core import checks
from teamsight.core.table import Field, Table
from teamsight.policies.channels import checked_channel

if TYPE_CHECKING:
    from teamsight.agents.group import Group

TARGETS, TEAMMATES = "targets", "teammates"


@dataclass(eq=False)
class Channel:
    """What a group senses under one name.

    Attributes
    ----------
    name : str
        "targets", "teammates", or a name of your own.
    observed : list of Group
        The groups that are sensed, in the order of their declarations; of "teammates", those of the team.
    sensor : Sensor or None
        The sensor; None for one without errors.
    counts : bool
        Whether what is sensed counts in the observed fraction.
    bodies : Table
        That of the group; the column `works` is declared in it.
    """

    name: str
    bodies: Table
    observed: list[Any] = field(default_factory=list)
    sensor: Sensor | None = None
    counts: bool = False

    def __post_init__(self) -> None:
        if self.column not in self.bodies:
            self.bodies.declare(Field(self.column, np.bool_, fill=True, reset="fill"))

    @property
    def column(self) -> str:
        """The name of the column `works`."""
        return f"sensor of {self.name} works"

    @property
    def works(self) -> npt.NDArray[np.bool_]:
        """Whether the sensor of each agent of the group works, shape (n,); one that does not finds nobody."""
        return self.bodies[self.column]


def changed(
    channel: Channel | None,
    name: str,
    sensor: Sensor | None,
    counts: bool | None,
    *,
    on_team: bool,
    bodies: Table,
) -> Channel:
    """Return a channel as it is after another declaration of `World.senses`, without the group declared.

    `bodies` are those of the observing group.

    Raises
    ------
    TypeError, ValueError
        If the declaration contradicts an earlier one for the same channel.
    """
    checked_channel(name)
    if name == TEAMMATES:
        raise ValueError(
            "as_='teammates': is the channel of a group's own team; give the groups the same team, as in "
            "world.add(…, team='robots'), and set its sensor by group.sensors['teammates'] = Sensor(…)"
        )
    if counts is not None:
        checks.flag("counts", counts)
    if sensor is not None:
        check_sensor_of(name, sensor)
    if channel is None:
        is_counted = on_team and name == TARGETS if counts is None else counts
        return Channel(name, bodies, [], sensor, is_counted)
    if sensor is not None and channel.sensor not in (None, sensor):
        raise ValueError(
            f"sensor={sensor!r}: the channel {name!r} of this group has {channel.sensor!r}, and a channel has one "
            "sensor; take another name as as_, or set group.sensors"
        )
    if counts is not None and counts != channel.counts:
        raise ValueError(f"counts={counts}: the channel {name!r} of this group was declared with {channel.counts}")
    return Channel(name, bodies, list(channel.observed), sensor or channel.sensor, channel.counts)


def check_sensor_of(channel: str, sensor: object) -> None:
    """Refuse what is not a sensor, and a range of its own where the group has one."""
    if not isinstance(sensor, Sensor):
        shown = f"{sensor.__name__}: is a class; give an object" if isinstance(sensor, type) else checks.shown(sensor)
        raise TypeError(f"sensor={shown}: must be a Sensor, such as Sensor(field_of_view=2.0)")
    if sensor.range is not None and channel in (TARGETS, TEAMMATES):
        name = "sensing_range" if channel == TARGETS else "awareness_range"
        raise ValueError(
            f"sensor.range={sensor.range:g}: the range of the channel {channel!r} is {name} of the group; set that"
        )


def leave(channels: dict[str, Channel], group: object) -> None:
    """Remove a group from all channels, and channels that are then without a group."""
    for channel in list(channels.values()):
        channel.observed = [observed for observed in channel.observed if observed is not group]
        if not channel.observed and channel.name != TEAMMATES:
            del channels[channel.name]
            channel.bodies.drop(channel.column)


class Sensors(MutableMapping[str, Sensor]):
    """The sensors of a group by channel. Setting one replaces it from the next step on; deleting makes it perfect.

    Parameters
    ----------
    group : Group
        The group.
    change : callable
        ``change(channel, sensor)`` changes the sensor of a channel.
    """

    def __init__(self, group: Group, change: Callable[[Channel, Sensor | None], None]) -> None:
        self._group, self._change = group, change

    def __getitem__(self, name: str) -> Sensor:
        return channel_of(self._group, name).sensor or Sensor()

    def __setitem__(self, name: str, sensor: Sensor) -> None:
        channel = channel_of(self._group, name)
        check_sensor_of(name, sensor)
        self._change(channel, sensor)

    def __delitem__(self, name: str) -> None:
        self._change(channel_of(self._group, name), None)

    def __iter__(self) -> Iterator[str]:
        return iter(self._group.channels)

    def __len__(self) -> int:
        return len(self._group.channels)

    def __repr__(self) -> str:
        return f"Sensors({dict(self)!r})"


class NoChannelError(KeyError, ValueError):
    """A group has no channel of this name."""

    __str__ = ValueError.__str__


def channel_of(group: Group, name: Any, what: str = "") -> Channel:
    """Return a channel of a group; `what` says in the error where its name was given.

    Raises
    ------
    NoChannelError
        If the group has no such channel.
    """
    try:
        return group.channels[name]
    except (KeyError, TypeError):
        have = ", ".join(map(repr, group.channels)) or "none"
        raise NoChannelError(
            f"{what or repr(name)}: the group {group.name!r} has no such channel, but {have}; declare it by "
            "world.senses(…, as_=…)"
        ) from None


def note_of_inactive(active: npt.NDArray[np.bool_]) -> str:
    """Return how many agents are inactive, to write after their number; empty if none is."""
    inactive = len(active) - int(active.sum())
    return f" ({inactive:,} inactive)" if inactive else ""
