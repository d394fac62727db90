"""Events of a world: sources that plan them, processes that wait for them, and the log of what happened."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.agents.events.contact_log import ContactLog
    from teamsight.agents.events.sources import EventSource

_HOMES = {
    "ContactLog": "teamsight.agents.events.contact_log",
    "EventSource": "teamsight.agents.events.sources",
}

__all__ = ["ContactLog", "EventSource"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
