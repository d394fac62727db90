"""Events of a world: sources that plan them, and the log of what happened."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.events.source import EventSource

_HOMES = {"EventSource": "teamsight.agents.events.source"}

__all__ = ["EventSource"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
