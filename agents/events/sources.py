"""The event sources of a world, and its log of what happened."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import pandas as pd

from teamsight.agents.events.timeline import Timeline
from teamsight.core import checks

# What a detail can be: a value of a table.
_PLAIN = (str, int, float, np.number, np.bool_, type(None))


class LoggedEvent(NamedTuple):
    """One row of the log; see `EventLog.frame`."""

    time: float
    tick: int
    what: str
    group: str | None
    agent: int | None
    source: str | None
    details: dict[str, Any]


class EventLog:
    """The events of a run, in the order in which they happened.

    Attributes
    ----------
    rows : list of LoggedEvent
        One for each event.
    """

    def __init__(self, rows: Iterable[LoggedEvent] = ()) -> None:
        self.rows = list(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __deepcopy__(self, memo: Any) -> EventLog:
        # Rows are never changed.
        return EventLog(self.rows)

    def frame(self) -> pd.DataFrame:
        """Return the log as a table.

        Returns
        -------
        DataFrame
            The columns time [ticks] (float64), tick (int64), what, group (text), agent (Int64, the `unique_id`), source
            (text), and one for each detail. Values that an event does not have are missing.
        """
        rows = self.rows
        columns: dict[str, Any] = {
            "time": np.array([row.time for row in rows], np.float64),
            "tick": np.array([row.tick for row in rows], np.int64),
            "what": pd.array([row.what for row in rows], dtype="string"),
            "group": pd.array([row.group for row in rows], dtype="string"),
            "agent": pd.array([row.agent for row in rows], dtype="Int64"),
            "source": pd.array([row.source for row in rows], dtype="string"),
        }
        names = dict.fromkeys(name for row in rows if row.details for name in row.details)
        for name in names:
            columns[name] = _column([row.details.get(name) for row in rows])
        return pd.DataFrame(columns)


OWN_COLUMNS = LoggedEvent._fields[:-1]


def check_event(what: Any, details: dict[str, Any]) -> None:
    """Refuse what is no name of an event, and details that a table cannot hold.

    Raises
    ------
    TypeError, ValueError
        If it is not a text, or a detail is not a number, a text, True, False or None, or has the name of a column.
    """
    if not isinstance(what, str) or not what:
        shown = checks.shown(what)
        raise TypeError(f"log({shown}): must be a text that says what happened, as in log('painted', robot)")
    for name, value in details.items():
        if name in OWN_COLUMNS:
            raise ValueError(f"log({what!r}, {name}=…): the log has a column of this name already; take another name")
        if not isinstance(value, _PLAIN):
            raise TypeError(
                f"log({what!r}, {name}={checks.shown(value)}): must be a number, a text, True, False or None; give its "
                "parts as details of their own, as in log('moved', robot, x=0.5, y=1.0)"
            )


def _column(values: list[Any]) -> Any:
    """Return details as an array: numbers as floats or integers, texts as texts, others as objects."""
    present = [value for value in values if value is not None]
    if all(isinstance(value, (bool, np.bool_)) for value in present):
        return pd.array(values, dtype="boolean")
    if all(isinstance(value, (int, np.integer)) and not isinstance(value, bool) for value in present):
        return pd.array(values, dtype="Int64")
    if all(isinstance(value, (int, float, np.number)) and not isinstance(value, bool) for value in present):
        return np.array([np.nan if value is None else value for value in values], np.float64)
    texts = [value if value is None or isinstance(value, str) else str(value) for value in values]
    return pd.array(texts, dtype="string")


if TYPE_CHECKING:
    from teamsight.agents.events.source import EventSource

    S = TypeVar("S", bound=EventSource)
else:
    S = TypeVar("S")


class Sources:
    """The sources that are attached to a world, in the order of their numbers.

    Attributes
    ----------
    attached : list of EventSource
        The sources.
    known : dict of int to EventSource
        By number, those that were detached included: a state may bring them back.
    following : int
        The number of the next source.
    events : EventLog
        The log of the world.
    """

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self.attached: list[EventSource] = []
        self.known: dict[int, EventSource] = {}
        self.following = 1
        self.events = EventLog()

    def attach(self, world: Any, source: S, group: Any) -> S:
        """Attach a copy of a source; see `World.attach`."""
        self._timeline.check_undecided("attach()", "plan it with world.clock.at(world.clock.now, …)")
        _check(world, source, group)
        # Numbers from `following` on are of sources that could not begin, or that a restored state does not know.
        earlier = [one for number, one in self.known.items() if number < self.following and one.group is group]
        nth = sum(type(one).__name__ == type(source).__name__ for one in earlier)
        mine = source.attached_copy(world, group, self.following, nth)
        mine.check()
        self.attached.append(mine)
        self.known[mine.number] = mine
        self.following += 1
        try:
            with self._acting(mine):
                mine.connect()
                mine.begin()
        except BaseException:
            self._take_out(mine)
            self.following -= 1
            raise
        return mine

    def detach(self, source: EventSource) -> None:
        """Take a source out, and cancel its planned calls; see `World.detach`."""
        if not any(one is source for one in self.attached):
            raise ValueError(
                f"detach({checks.shown(source)}): is not attached to this world; detach what attach() returned, once"
            )
        with self._acting(source):
            source.end()
        self._take_out(source)

    def _take_out(self, source: EventSource) -> None:
        for planned in source.pending():
            planned.cancel()
        self.replace([one for one in self.attached if one is not source])

    def replace(self, sources: list[EventSource]) -> None:
        """Let these sources be attached, some of which may have been before, and no others."""
        before, self.attached = self.attached, sources
        for source in before:
            if not any(one is source for one in sources):
                source.disconnect()
        for source in sources:
            if not any(one is source for one in before):
                source.connect()

    def begin(self) -> None:
        """Begin a run: empty the log and let all sources plan their first events."""
        for source in list(self.attached):
            source.reset()
        self.events = EventLog()
        for source in list(self.attached):
            source.forget_numbers()
            with self._acting(source):
                source.begin()

    def joined(self, agents: list[Any]) -> None:
        """Log that agents have come to a group, and call its sources."""
        for agent in agents:
            self.note("joined", agent)
        for source in list(self.attached):
            for agent in agents:
                # An earlier source may have removed it.
                group: Any = source.group
                if group is agent.group and agent._row >= 0:
                    with self._acting(source):
                        source.joined(agent, int(group.bodies.member[agent._row]))

    def left(self, agent: Any, member: int) -> None:
        """Log that an agent has left its group, and call its sources."""
        self.note("left", agent)
        for source in list(self.attached):
            if source.group is agent.group:
                with self._acting(source):
                    source.left(agent, member)

    def switched(self, agent: Any, channel: str | None, on: bool) -> None:
        """Call the sources of an agent of which is set whether it is active, or whether a sensor of it works."""
        group, member = agent.group, int(agent.group.bodies.member[agent.row])
        for source in self.attached:
            if source.group is group:
                source.switched(agent, member, channel, on)

    def note(self, what: str, agent: Any, **details: Any) -> None:
        """Log that an agent has joined or left, once the run has begun: before, it belongs to the set-up."""
        timeline, caller = self._timeline, self._timeline.clock.caller
        if timeline.tick or timeline.inside:
            self.log(what, agent, type(caller).__name__ if self._is_attached(caller) else None, details)

    def note_change(self, what: str, agent: Any, **details: Any) -> None:
        """Log that an agent has changed, unless a source has changed it, which logs why."""
        if not self._is_attached(self._timeline.clock.caller):
            self.note(what, agent, **details)

    def _is_attached(self, source: Any) -> bool:
        return any(one is source for one in self.attached)

    @contextlib.contextmanager
    def _acting(self, source: EventSource) -> Iterator[None]:
        """Mark the time during which a source is called that is not an event."""
        clock = self._timeline.clock
        before, clock.caller = clock.caller, source
        try:
            yield
        finally:
            clock.caller = before

    def log(self, what: str, agent: Any, source: str | None, details: dict[str, Any]) -> None:
        """Add an event of the present moment to the log; see `World.log`."""
        check_event(what, details)
        group = identity = None
        if agent is not None:
            try:
                group, identity = agent.group.name, agent.unique_id
            except AttributeError:
                shown = checks.shown(agent)
                raise TypeError(f"log({what!r}, {shown}): must be an agent of the world, or None") from None
        timeline = self._timeline
        time = float(timeline.clock._now)
        self.events.rows.append(LoggedEvent(time, timeline.tick, what, group, identity, source, details))


def sources_of(events: Any) -> list[Any]:
    """Return the sources that are given as one, as several, or as None."""
    if events is None:
        return []
    return list(events) if isinstance(events, (list, tuple)) else [events]


def _check(world: Any, source: Any, group: Any) -> None:
    from teamsight.agents.events.source import EventSource

    kind = getattr(source, "__name__", None) if isinstance(source, type) else None
    if kind is not None and issubclass(source, EventSource):
        raise TypeError(f"attach({kind}): is a class; attach an object of it, as in attach({kind}(…), robots)")
    if not isinstance(source, EventSource):
        raise TypeError(f"attach({checks.shown(source)}): must be an event source, such as Failures(500, 50)")
    name = type(source).__name__
    if source.is_attached:
        raise ValueError(
            f"attach({checks.shown(source)}): is attached to a world already; attach the source that it was copied "
            f"from, or a new {name}(…)"
        )
    if group is None and source.needs_group:
        raise TypeError(f"attach({checks.shown(source)}): needs a group; give it, as in attach({name}(…), robots)")
    if group is not None and not any(one is group for one in world.groups):
        raise ValueError(f"attach({name}(…), {checks.shown(group)}): must be a group of this world, such as robots")
