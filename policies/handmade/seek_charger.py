"""Seek charger: go to the nearest charging place in sight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamsight.core.kernel import kernel
from teamsight.policies.actions import go
from teamsight.policies.compiled import CompiledPolicy


@kernel
def _seek(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    chargers = percept.channels.chargers
    for i in range(len(percept.heading)):
        x, y, least = 0.0, 0.0, -1.0
        for k in range(chargers.start[i], chargers.start[i + 1]):
            if least < 0.0 or chargers.distance[k] < least:
                least = chargers.distance[k]
                x, y = chargers.offset[k, 0], chargers.offset[k, 1]
        go(action, i, x, y, min(max(least, 0.0), percept.speed[i]))


@dataclass(frozen=True)
class SeekCharger(CompiledPolicy):
    """Go straight to the nearest agent of the channel "chargers", and stay there; stay if there is none.

    `teamsight.agents.components.ChargingPlaces` gives it to agents whose battery is low.
    """

    kernel = _seek
    channels = ("chargers",)
