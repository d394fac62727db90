"""Logged contacts and observations as rows of the event log."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from teamsight.agents.events.contact_log import ContactLog
from teamsight.agents.events.contact_table import observations
from teamsight.agents.events.log import EventLog, LoggedEvent

CONTACT = {True: "contact begun", False: "contact ended"}
OBSERVED = {True: "observed", False: "not observed"}


def with_contacts(log: EventLog, sources: Iterable[Any], agents: Iterable[Any]) -> EventLog:
    """Return an event log with the rows of the contact logs among event sources; the same log if there are none.

    At equal times contacts come first: they are what the last step has led to, and events follow it.

    Parameters
    ----------
    log : EventLog
        The other events.
    sources : iterable of EventSource
        The sources of the world.
    agents : iterable of Body
        Its present agents; the groups of those that have left are found in the log.
    """
    logs = [source for source in sources if isinstance(source, ContactLog)]
    if not logs:
        return log
    groups = {row.agent: row.group for row in log.rows if row.agent is not None}
    groups.update((agent.unique_id, agent.group.name) for agent in agents)
    rows = [row for one in logs for row in _contacts(one)]
    counting = [one for one in logs if one.counts]
    tick, begun, observed = (array.tolist() for array in observations(counting))
    rows += [
        LoggedEvent(float(when), when, OBSERVED[is_so], groups.get(agent), agent, ContactLog.__name__, {})
        for when, is_so, agent in zip(tick, begun, observed, strict=True)
    ]
    return EventLog(sorted([*rows, *log.rows], key=lambda row: row.time))


def _contacts(log: ContactLog) -> list[LoggedEvent]:
    contacts, source = log.contacts, ContactLog.__name__
    name = log.observers
    arrays = (contacts.tick, contacts.begun, contacts.observer, contacts.observed)
    return [
        LoggedEvent(float(tick), tick, CONTACT[begun], name, one, source, {"other": other, "channel": log.channel})
        for tick, begun, one, other in zip(*(array.tolist() for array in arrays), strict=True)
    ]
