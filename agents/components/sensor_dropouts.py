"""Sensors that drop out, and come back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.agents.components.durations import Duration, Times, lasting, time_to
from teamsight.agents.components.holding import Holding
from teamsight.agents.components.interruptions import Interruptions
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.body import Body


class SensorDropouts(Holding, Interruptions):
    """Sensors drop out and come back, those of each agent independently of the others.

    An agent whose sensor has dropped out senses nobody in that channel; others sense it as before. The log says
    "sensor dropped out" and "sensor came back". What the user sets wins: a sensor that the user breaks stays so,
    and one that the user repairs works.

    Parameters
    ----------
    time_to_dropout : float, Duration or Times
        The time from the start, or from the end of the last dropout, to a dropout [ticks]; as for `Failures`.
    time_to_recovery : float, Duration or Times, optional
        The time until the sensor comes back [ticks]; by default it does not.
    channel : str, optional
        The channel of the sensor; by default all channels of the group drop out together.

    Raises
    ------
    TypeError, ValueError
        If a time is neither a number nor a duration, or is not positive; when attached, if a listed time has passed or
        the group has no such channel.
    """

    words = "sensor dropped out", "sensor came back"
    parameters = "time_to_dropout", "time_to_recovery"

    def __init__(
        self,
        time_to_dropout: float | Duration | Times,
        time_to_recovery: float | Duration | Times | None = None,
        channel: str | None = None,
    ) -> None:
        self.time_to_dropout = time_to("time_to_dropout", time_to_dropout)
        self.time_to_recovery = None if time_to_recovery is None else lasting("time_to_recovery", time_to_recovery)
        if channel is not None and not isinstance(channel, str):
            raise TypeError(f"channel={checks.shown(channel)}: must be the name of a channel, such as 'targets'")
        self.channel = channel

    def begin(self) -> None:
        """Plan the first dropout of each agent."""
        channels = self._its_group().channels
        if self.channel is not None and self.channel not in channels:
            name, have = self._its_group().name, ", ".join(map(repr, channels)) or "none"
            raise ValueError(
                f"channel={self.channel!r}: the group {name!r} has no such channel, but {have}; declare it by "
                "world.senses(…, as_=…)"
            )
        Holding.begin(self)
        Interruptions.begin(self)

    def begin_one(self, agent: Body, member: int) -> None:
        """Break the sensors of an agent."""
        for name in self._its_group().channels if self.channel is None else (self.channel,):
            self.hold(member, name)

    def end_one(self, agent: Body, member: int) -> None:
        """Repair those that nothing else keeps out of order."""
        for one, name in list(self._held):
            if one == member:
                self.release(member, name)
