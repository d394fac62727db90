"""Unreliable awareness: what robots know of their teammates is late, or missing."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Annotated

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.events.sources import EventSource
from teamsight.agents.sensing.sensor import MOST_DELAY, Delay, Sensor
from teamsight.core import checks
from teamsight.core.component import Allowed


@dataclass(eq=False, repr=False)
class UnreliableAwareness(EventSource):
    """What the robots of a group know of their teammates is late, or gets lost, for a time or for the whole run.

    It changes the sensor of the channel "teammates": under each degree of awareness, where teammates are, where they
    face and the targets that they relay are as old, and as often missing. The log says "awareness unreliable" and
    "awareness reliable". A robot's number of neighbours, and δ, are geometry, and stay as they are.

    Several that overlap add up: delays are summed, and a teammate is missed if one of them misses it. A sensor that the
    user sets meanwhile is taken as it is; from the next beginning or end on, they add to that one.

    Parameters
    ----------
    delay : int, default 0
        How old it is [ticks].
    missing : float, default 0
        The probability that a robot misses a teammate at a tick; of each teammate and tick on its own.
    begins : float, default 0
        When it begins [ticks], from the start of the run.
    ends : float, optional
        When it ends [ticks]; by default never.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits; when attached, if its end has passed, or the group is on
        no team.
    """

    delay: Delay = 0
    missing: Annotated[float, Allowed(least=0, most=1, cure="it is a probability")] = 0.0
    _: KW_ONLY
    begins: Annotated[float, Allowed(least=0, cure="0 is the start", unit="ticks")] = 0.0
    ends: Annotated[float, Allowed(unit="ticks")] | None = None
    changing = ("_sensors",)
    # While it lasts: the sensor of the user, to which all that last add, and what they have made of it.
    _sensors: tuple[Sensor, Sensor] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.ends is not None:
            checks.number("ends", self.ends, above=self.begins, cure="leave it out for never")

    def begin(self) -> None:
        """Plan when it begins and ends."""
        group = self._its_group()
        if TEAMMATES not in group.channels:
            raise ValueError(
                f"UnreliableAwareness: {group.name!r} is on no team and knows of no teammates; give the group a team, "
                "as in world.add(…, team='robots')"
            )
        if self.ends is not None and self.ends < self.now:
            raise ValueError(f"ends={self.ends:g}: has passed; the present tick is {self.now:g}, so give a later one")
        if self.begins <= self.now:
            self.start()
        else:
            self.plan(self.begins, "start")
        if self.ends is not None:
            self.plan(self.ends, "stop")

    def end(self) -> None:
        """Give the group its sensor back, which stays at a reset."""
        self._change(lasts=False)

    reset = end

    def start(self) -> None:
        """Make awareness unreliable from now on."""
        self._change(lasts=True)
        self._log_sensor()

    def stop(self) -> None:
        """Make awareness as reliable as without it, from now on."""
        self._change(lasts=False)
        self._log_sensor()

    def _change(self, *, lasts: bool) -> None:
        """Begin or end, and make the sensor anew from that of the user and all sources that last."""
        if lasts == (self._sensors is not None):
            return
        sensors, before = self._its_group().sensors, self._lasting()
        present = sensors[TEAMMATES]
        # The same in all that last.
        base, made = before[0]._sensors or (present, present) if before else (present, present)
        if present != made:
            base = present
        self._sensors = (base, made) if lasts else None
        together = self._lasting()
        delay = min(base.delay + sum(one.delay for one in together), MOST_DELAY)
        sensed = (1.0 - base.missed) * math.prod(1.0 - one.missing for one in together)
        made = replace(base, delay=delay, missed=1.0 - sensed) if together else base
        for one in together:
            one._sensors = base, made
        sensors[TEAMMATES] = made

    def _lasting(self) -> list[UnreliableAwareness]:
        """Return those that make the awareness of the group unreliable now."""
        return [one for one in self.beside(UnreliableAwareness) if one._sensors is not None]

    def _log_sensor(self) -> None:
        if self._lasting():
            sensor = self._its_group().sensors[TEAMMATES]
            self.log("awareness unreliable", delay=sensor.delay, missing=sensor.missed)
        else:
            self.log("awareness reliable")
