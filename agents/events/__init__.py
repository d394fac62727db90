"""Events of a world: sources that plan them, and the log of what happened."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.events.batteries import Batteries
    from teamsight.agents.events.durations import Constant, Duration, Exponential, Times, Weibull
    from teamsight.agents.events.failures import Failures
    from teamsight.agents.events.sensor_dropouts import SensorDropouts
    from teamsight.agents.events.source import EventSource

_HOMES = {
    "Batteries": "teamsight.agents.events.batteries",
    "Constant": "teamsight.agents.events.durations",
    "Duration": "teamsight.agents.events.durations",
    "EventSource": "teamsight.agents.events.source",
    "Exponential": "teamsight.agents.events.durations",
    "Failures": "teamsight.agents.events.failures",
    "SensorDropouts": "teamsight.agents.events.sensor_dropouts",
    "Times": "teamsight.agents.events.durations",
    "Weibull": "teamsight.agents.events.durations",
}

__all__ = ["Batteries", "Constant", "Duration", "EventSource", "Exponential", "Failures", "SensorDropouts", "Times", "Weibull"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
