"""Sensors: which of the agents within range an observer senses, and where they appear to be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.sensing.check import check_sensor
    from teamsight.agents.sensing.lidar import Lidar
    from teamsight.agents.sensing.sensor import NOBODY, Sensor, View, normals, rotation, uniform, words_of

_HOMES = {
    "Lidar": "teamsight.agents.sensing.lidar",
    "NOBODY": "teamsight.agents.sensing.sensor",
    "Sensor": "teamsight.agents.sensing.sensor",
    "View": "teamsight.agents.sensing.sensor",
    "check_sensor": "teamsight.agents.sensing.check",
    "normals": "teamsight.agents.sensing.sensor",
    "rotation": "teamsight.agents.sensing.sensor",
    "uniform": "teamsight.agents.sensing.sensor",
    "words_of": "teamsight.agents.sensing.sensor",
}

__all__ = ["NOBODY", "Lidar", "Sensor", "View", "check_sensor", "normals", "rotation", "uniform", "words_of"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
