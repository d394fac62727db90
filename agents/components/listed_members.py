"""The check of the members for which times are listed."""

from __future__ import annotations

from teamsight.agents.components.durations import Times
from teamsight.agents.events.source import EventSource


class Coming(EventSource):
    """A source that lets agents come to its group; so others may list times for members that are not there yet."""


def check_members(source: EventSource, *names: str) -> None:
    """Refuse a source whose parameters list times for members that its group neither has nor will have."""
    group = source.group
    assert group is not None
    if any(isinstance(one, Coming) and one.group is group for one in source.world.sources):
        return
    for name in names:
        value = getattr(source, name)
        if isinstance(value, Times):
            value.check_members(name, source.members, group.name)
