"""The newest events of a world as the page lists them; contacts of one tick are one row."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from itertools import islice
from typing import Any

from teamsight.agents.events.contact_log import CONTACT, ContactLog
from teamsight.agents.world import World

#: Rows of the event log that a page shows, and rows of contacts of each log: they change at almost every tick, and
#: would leave no room for other events.
MOST_EVENTS, MOST_CONTACTS = 100, 20
Row = list[Any]


def event_rows(world: World) -> dict[str, Any]:
    """Return the newest rows, the newest first, and how many events there are.

    Parameters
    ----------
    world : World
        The world.

    Returns
    -------
    dict of str to object
        ``total``, and ``rows``: time, what, group, agent or None, and details by name.
    """
    sources = world._data.sources
    logged = sources.events.rows
    rows: list[Row] = [
        [row.time, row.what, row.group, row.agent, {name: _plain(one) for name, one in row.details.items()}]
        for row in islice(reversed(logged), MOST_EVENTS)
    ]
    total = len(logged)
    for source in world.sources:
        if isinstance(source, ContactLog):
            rows += islice(_contact_rows(source), MOST_CONTACTS)
            total += len(source.rows)
    rows.sort(key=lambda row: float(row[0]), reverse=True)
    return {"total": total, "rows": rows[:MOST_EVENTS]}


def _contact_rows(log: ContactLog) -> Iterator[Row]:
    """Yield the contacts of each tick that began, and those that ended, as one row each; the newest tick first."""
    ticks, end = log.rows[:, 0], len(log.rows)
    while end:
        # Not searchsorted, which would copy the column.
        first = bisect_left(ticks, ticks[end - 1], hi=end)
        of_tick = log.rows[first:end]
        for begun in (True, False):
            found = of_tick[(of_tick[:, 1] != 0) == begun]
            if len(found) == 1:
                tick, _, one, other = found[0].tolist()
                yield [tick, CONTACT[begun], log.observers, one, {"other": other, "channel": log.channel}]
            elif len(found):
                what = CONTACT[begun].replace("contact", f"{len(found):,} contacts")
                yield [int(ticks[first]), what, log.observers, None, {"channel": log.channel}]
        end = first


def _plain(value: Any) -> Any:
    """Return a detail of an event as JSON has it."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return value.item() if hasattr(value, "item") else str(value)
