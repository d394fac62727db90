"""Sensors: which of the agents within range an observer senses, and where they appear to be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.sensing.check import check_sensor
    from teamsight.agents.sensing.interface import View
    from teamsight.agents.sensing.sensor import Sensor

_HOMES = {
    "Sensor": "teamsight.agents.sensing.sensor",
    "View": "teamsight.agents.sensing.interface",
    "check_sensor": "teamsight.agents.sensing.check",
}

__all__ = ["Sensor", "View", "check_sensor"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
