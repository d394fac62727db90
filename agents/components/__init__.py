"""Components that plan events: failures, dropouts of sensors, batteries and charging, arrivals, late reports, bumps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.components.arrivals import Arrivals, Departures
    from teamsight.agents.components.batteries import Batteries, ChargingPlaces
    from teamsight.agents.components.bumps import Bumps
    from teamsight.agents.components.durations import Constant, Duration, Exponential, Times, Weibull
    from teamsight.agents.components.failures import Failures, SensorDropouts
    from teamsight.agents.components.unreliable_awareness import UnreliableAwareness

_HOMES = {
    "Arrivals": "teamsight.agents.components.arrivals",
    "Batteries": "teamsight.agents.components.batteries",
    "Bumps": "teamsight.agents.components.bumps",
    "ChargingPlaces": "teamsight.agents.components.batteries",
    "Constant": "teamsight.agents.components.durations",
    "Departures": "teamsight.agents.components.arrivals",
    "Duration": "teamsight.agents.components.durations",
    "Exponential": "teamsight.agents.components.durations",
    "Failures": "teamsight.agents.components.failures",
    "SensorDropouts": "teamsight.agents.components.failures",
    "Times": "teamsight.agents.components.durations",
    "UnreliableAwareness": "teamsight.agents.components.unreliable_awareness",
    "Weibull": "teamsight.agents.components.durations",
}

__all__ = [
    "Arrivals", "Batteries", "Bumps", "ChargingPlaces", "Constant", "Departures", "Duration", "Exponential",
    "Failures", "SensorDropouts", "Times", "UnreliableAwareness", "Weibull",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
