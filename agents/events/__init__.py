"""Events of a world: sources that plan them, and the log of what happened."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.events.arrivals import Arrivals, Departures
    from teamsight.agents.events.batteries import Batteries
    from teamsight.agents.events.charging_places import ChargingPlaces
    from teamsight.agents.events.contact_log import ContactLog
    from teamsight.agents.events.durations import Constant, Duration, Exponential, Times, Weibull
    from teamsight.agents.events.failures import Failures
    from teamsight.agents.events.sensor_dropouts import SensorDropouts
    from teamsight.agents.events.source import EventSource
    from teamsight.agents.events.unreliable_awareness import UnreliableAwareness

_HOMES = {
    "Arrivals": "teamsight.agents.events.arrivals",
    "Departures": "teamsight.agents.events.arrivals",
    "UnreliableAwareness": "teamsight.agents.events.unreliable_awareness",
    "Batteries": "teamsight.agents.events.batteries",
    "ChargingPlaces": "teamsight.agents.events.charging_places",
    "ContactLog": "teamsight.agents.events.contact_log",
    "Constant": "teamsight.agents.events.durations",
    "Duration": "teamsight.agents.events.durations",
    "EventSource": "teamsight.agents.events.source",
    "Exponential": "teamsight.agents.events.durations",
    "Failures": "teamsight.agents.events.failures",
    "SensorDropouts": "teamsight.agents.events.sensor_dropouts",
    "Times": "teamsight.agents.events.durations",
    "Weibull": "teamsight.agents.events.durations",
}

__all__ = [
    "Arrivals", "Batteries", "ChargingPlaces", "Constant", "ContactLog", "Departures", "Duration", "EventSource",
    "Exponential", "Failures", "SensorDropouts", "Times", "UnreliableAwareness", "Weibull",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
