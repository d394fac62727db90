"""What a world offers for events: its sources and its log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pandas as pd

from teamsight.agents.fixed import refusing
from teamsight.agents.measures import Measures

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.events.contact_log import ContactLog
    from teamsight.agents.events.observation_counts import ObservationCounts
    from teamsight.agents.events.source import EventSource
    from teamsight.agents.events.until import Until
    from teamsight.agents.group import Group

    S = TypeVar("S", bound=EventSource)
else:
    S = TypeVar("S")


@refusing(
    contacts="log_contacts(group) fills it",
    events="it is what happened; world.log(…) adds to it, and reset() empties it",
    sources="world.attach(…) and world.detach(…) change them",
    until="its methods return the events for which a process can wait, as in world.until.observed(target)",
)


class EventMethods(Measures):
    """The methods of a world for events; `World` derives from it."""

    def attach(self, source: S, group: Group[Any] | None = None) -> S:
        """Let an event source plan events in this world, from now on; see `EventSource`.

        Parameters
        ----------
        source : EventSource
            Such as ``Failures(500, 50)``. It is copied: one object can be attached to many groups and worlds.
        group : Group, optional
            The group that it concerns.

        Returns
        -------
        EventSource
            The attached copy, which belongs to this world; `detach` takes it.

        Raises
        ------
        TypeError, ValueError
            If `source` is no event source or is attached already, or the group is missing or of another world. Nothing
            is changed then.
        """
        return self._data.sources.attach(self, source, group)

    def detach(self, source: EventSource) -> None:
        """Take an event source out of this world and cancel the events that it has planned.

        Raises
        ------
        ValueError
            If it is not attached to this world.
        """
        self._data.sources.detach(source)

    @property
    def sources(self) -> tuple[EventSource, ...]:
        """The attached event sources, in the order in which they were attached."""
        return tuple(self._data.sources.attached)

    @property
    def until(self) -> Until:
        """Events of the world for which processes wait: ``yield world.until.observed(target)``; see `Until`."""
        data = self._data
        if data.until is None:
            from teamsight.agents.events.until import Until

            data.until = Until(data, self._engine)
        until: Until = data.until
        return until

    def log_contacts(self, group: Group[Any], channel: str = "teammates") -> ContactLog:
        """Log the contacts of a group from now on: which agent begins and ceases to sense which, and when.

        Parameters
        ----------
        group : Group
            A group of this world.
        channel : str
            "teammates": those within awareness range. Other channels: those that are sensed.

        Returns
        -------
        ContactLog
            Its `contacts` are arrays; see also `contacts`. If these contacts are logged already, that log. It is an
            event source: `detach` ends it, states hold it, and a reset begins it anew.

        Raises
        ------
        TypeError, ValueError
            If it is no group of this world, or the group has no such channel.
        """
        from teamsight.agents.events.contact_log import ContactLog

        for source in self.sources:
            if isinstance(source, ContactLog) and source.group is group and source.channel == channel:
                return source
        return self.attach(ContactLog(channel), group)

    @property
    def contacts(self) -> pd.DataFrame:
        """The contacts that were logged; see `log_contacts`.

        One row for each beginning and each end, in the order of `sources` and then of time. The columns are tick,
        begun (False if the contact has ended), group, channel, and observer and observed (`unique_id`).
        """
        from teamsight.agents.events.contact_log import contact_table

        return contact_table(self.sources)

    def count_observations(self) -> ObservationCounts:
        """Count from now on for how many steps each target is observed, and by how many robots.

        Returns
        -------
        ObservationCounts
            Its `table` has a row for each target; `spread`, `entropy` and `redundancy` are numbers of the team. If
            observations are counted already, those counts. It is an event source: `detach` ends it, states hold it,
            and a reset begins it anew.
        """
        from teamsight.agents.events.observation_counts import ObservationCounts

        for source in self.sources:
            if isinstance(source, ObservationCounts):
                return source
        return self.attach(ObservationCounts())

    def log(self, what: str, agent: Body | None = None, /, **details: str | float | np.generic | None) -> None:
        """Add an event to `events`, at the present time: ``world.log("painted", robot, colour="red")``.

        Parameters
        ----------
        what : str
            What happened, in a word or two.
        agent : Body, optional
            To whom.
        **details
            Numbers, texts, True, False or None; each is a column of the table.

        Raises
        ------
        TypeError, ValueError
            If one of these is something else.
        """
        self._data.sources.log(what, agent, None, details)

    @property
    def events(self) -> pd.DataFrame:
        """The event log: one row for each event, in the order in which they happened.

        The columns are time (exact) and tick (completed steps) [ticks], what, group, agent (`unique_id`), source, and
        one for each detail. ``world.events.to_parquet("events.parquet")`` writes it to a file. Contacts that
        `log_contacts` logs are rows too, with the columns other (`unique_id`) and channel; if the channel counts in the
        observed fraction, also when each agent is observed and no longer observed.
        """
        log = self._data.sources.events
        if self.sources:
            from teamsight.agents.events.contact_log import with_contacts

            log = with_contacts(log, self.sources, self.agents)
        return log.frame()
