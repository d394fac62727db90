"""Declarations of what groups sense, and with which sensors."""

from __future__ import annotations

from typing import Any

from teamsight.agents.channel import Channel, changed
from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.interrupts import deferred


def declare(
    data: WorldData, engine: Engine, groups: tuple[Group, Group], name: str, sensor: Sensor | None, counts: bool | None
) -> None:
    """Let the first of two groups sense the other in the channel `name`; see `World.senses`."""
    data.timeline.check_undecided("senses()", "declare it before the run, or by world.clock.at(world.clock.now, …)")
    observers, observed = groups
    for group in groups:
        if not isinstance(group, Group):
            given = checks.shown(group)
            raise TypeError(f"senses({given}): give a group, not a list or an agent; world.add returns it")
        if group not in data.groups:
            shown = f"senses({checks.shown(observers)}, {checks.shown(observed)})"
            raise ValueError(f"{shown}: both groups must have been added to this world")
    before = observers.channels.get(name) if isinstance(name, str) else None
    is_team = observers.team is not None
    channel = changed(before, name, sensor, counts, on_team=is_team, size=len(observers))
    _check_range(data, channel.sensor)
    if observed not in channel.observed:
        channel.observed.append(observed)
    with deferred():
        observers.channels[name] = channel
        engine.is_bound = False


def set_sensor(data: WorldData, engine: Engine, channel: Channel, sensor: Sensor | None) -> None:
    """Replace the sensor of a channel from the next step on."""
    data.timeline.check_undecided("sensors[…]", "plan it with world.clock.at(world.clock.now, …)")
    _check_range(data, sensor)
    with deferred():
        channel.sensor = sensor
        engine.is_bound = False


def _check_range(data: WorldData, sensor: Any) -> None:
    if sensor is not None and sensor.range is not None:
        data.limits.range("sensor.range", sensor.range)
