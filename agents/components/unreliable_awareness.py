"""Unreliable awareness: what robots know of their teammates is late, or missing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.events.source import EventSource
from teamsight.agents.sensing.sensor import MOST_DELAY, Sensor
from teamsight.core import checks


class UnreliableAwareness(EventSource):
    """What the robots of a group know of their teammates is late, or gets lost, for a time or for the whole run.

    It changes the sensor of the channel "teammates": under each degree of awareness, where teammates are, where they
    face and the targets that they relay are as old, and as often missing. The log says "awareness unreliable" and
    "awareness reliable". A robot's number of neighbours, and δ, are geometry, and stay as they are.

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

    def __init__(self, delay: int = 0, missing: float = 0.0, *, begins: float = 0.0, ends: float | None = None) -> None:
        self.delay = checks.count("delay", delay, least=0, most=MOST_DELAY, cure="it is a number of ticks")
        self.missing = checks.number("missing", missing, least=0, most=1)
        self.begins = checks.number("begins", begins, least=0)
        self.ends = None if ends is None else checks.number("ends", ends, above=self.begins)

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
        self._before: Sensor | None = None
        if self.begins <= self.now:
            self.start()
        else:
            self.plan(self.begins, "start")
        if self.ends is not None:
            self.plan(self.ends, "stop")

    def reset(self) -> None:
        """Give the group its sensor back, which stays at a reset."""
        self._restore_sensor()

    def end(self) -> None:
        """Make awareness reliable again."""
        self._restore_sensor()

    def start(self) -> None:
        """Make awareness unreliable from now on."""
        if self._before is None:
            sensors = self._its_group().sensors
            self._before = sensors[TEAMMATES]
            missed = 1.0 - (1.0 - self._before.missed) * (1.0 - self.missing)
            delay = min(self._before.delay + self.delay, MOST_DELAY)
            sensors[TEAMMATES] = replace(self._before, delay=delay, missed=missed)
            self.log("awareness unreliable", delay=delay, missing=missed)

    def stop(self) -> None:
        """Make awareness as reliable as before, from now on."""
        if self._before is not None:
            self._restore_sensor()
            self.log("awareness reliable")

    def save(self) -> Any:
        """Return the sensor that it has replaced."""
        return self._before

    def load(self, data: Any) -> None:
        """Go back to what `save` returned."""
        self._before = data

    def _restore_sensor(self) -> None:
        if self._before is not None:
            self._its_group().sensors[TEAMMATES] = self._before
            self._before = None
