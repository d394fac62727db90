"""The event sources of a world, and how they reach its log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from teamsight.agents.events.log import EventLog, check_event
from teamsight.agents.timeline import Timeline
from teamsight.core import checks

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
        mine = source.attached_copy(world, group, self.following)
        self.attached.append(mine)
        self.known[mine.number] = mine
        self.following += 1
        try:
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
        source.end()
        self._take_out(source)

    def _take_out(self, source: EventSource) -> None:
        for planned in source.pending():
            planned.cancel()
        self.attached = [one for one in self.attached if one is not source]

    def begin(self) -> None:
        """Begin a run: empty the log and let all sources plan their first events."""
        self.events = EventLog()
        for source in list(self.attached):
            source.forget_numbers()
            source.begin()

    def joined(self, agents: list[Any]) -> None:
        """Log that agents have come to a group, and call its sources."""
        if not self._is_set_up:
            for agent in agents:
                self.log("joined", agent, None, {})
        for source in list(self.attached):
            for agent in agents:
                # An earlier source may have removed it.
                group: Any = source.group
                if group is agent.group and agent._row >= 0:
                    source.joined(agent, int(group.bodies.member[agent._row]))

    def left(self, agent: Any, member: int) -> None:
        """Log that an agent has left its group, and call its sources."""
        if not self._is_set_up:
            self.log("left", agent, None, {})
        for source in list(self.attached):
            if source.group is agent.group:
                source.left(agent, member)

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
        self.events.append(float(timeline.clock._now), timeline.tick, what, group, identity, source, details)

    @property
    def _is_set_up(self) -> bool:
        """Whether the run has not begun: what comes and goes then is how the world is made, not what happens in it."""
        return self._timeline.tick == 0 and not self._timeline.inside


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
