"""The event sources of a world, and its log of what happened."""

from __future__ import annotations

import contextlib
import copy
import inspect
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar

import numpy as np
import pandas as pd

from teamsight.agents.engine.records import Watcher
from teamsight.agents.group import Group
from teamsight.core import checks
from teamsight.core.component import Component
from teamsight.core.references import stable_name
from teamsight.world.clock import Clock, Planned, call
from teamsight.world.noise import TICKS_A_BLOCK, Stream, key_within, uniforms_of_block

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.world_data import Timeline

# The numbers of so many members are drawn at once: more cost hardly more time than one.
_MEMBERS = 16
_MOST_BLOCKS = 1024
# What a planned call can be given: what a saved state can hold, and agents cannot be.
_CONSTANT = frozenset({int, float, str, bool, type(None), np.int64, np.float64, tuple})


S = TypeVar("S", bound="EventSource")


class EventSource(Component):
    """A component that plans events in a world; a subclass says which.

    `World.attach` copies it, so one object can serve many worlds, be a parameter of a sweep, and be pickled. The copy
    belongs to the world: `begin` plans its first events, and each event is the call of one of its methods by name,
    which may plan the next. So a saved state can hold all that is pending.

    The fields of a subclass that is a dataclass are its options, and `Component` says how they are checked.

    Agents are named by their *member*, a number that they never lose, while rows change when others leave.

    Attributes
    ----------
    needs_group : bool
        Declared by the class: whether it can only be attached to a group.
    defers_interrupts : bool
        Declared by the class: whether Ctrl-C waits until a call of one of its methods by an event is complete.
        Otherwise that event may be lost, and with it all that it would have planned.
    changing : tuple of str
        Declared by the class: the attributes that states hold, unless it has a `save` and a `load` of its own.
    world : World
        Its world, once it is attached.
    group : Group or None
        The group to which it is attached.
    number : int
        Its number in its world: 1, 2, … in the order in which sources were attached. No other source gets it later.
    guests : sequence of int
        The members that its `reset` takes out of the group: they take no room where the others are placed again.
    nth : int
        Which of its kind it is: 0, 1, 2, … among the sources of this class that were attached to this group, those that
        were detached included. Its random numbers depend on it, so no source of another kind changes them.

    Examples
    --------
    >>> class Blinking(EventSource):
    ...     def __init__(self, interval: float) -> None:
    ...         self.interval = interval
    ...
    ...     def begin(self) -> None:
    ...         for member in self.members:
    ...             self.plan(self.now + self.interval * self.random(member, 0), "blink", member, 1)
    ...
    ...     def blink(self, member: int, index: int) -> None:
    ...         agent = self.agent(member)
    ...         if agent is not None:
    ...             self.log("blinked", agent)
    ...             self.plan(self.now + self.interval * self.random(member, index), "blink", member, index + 1)
    """

    needs_group: ClassVar[bool] = True
    defers_interrupts: ClassVar[bool] = True
    changing: ClassVar[tuple[str, ...]] = ()
    world: Any = None
    group: Group[Any] | None = None
    number: int = 0
    nth: int = 0
    guests: Sequence[int] = ()

    # What a subclass does.

    def begin(self) -> None:
        """Plan the first events; called when it is attached, and at each reset of the world, at tick 0."""

    def check(self) -> None:
        """Refuse, by an error, what cannot be in this world: called first when it is attached."""

    def connect(self) -> None:
        """Set up what it needs in the world, such as a watcher: called before `begin` when it is attached."""

    def disconnect(self) -> None:
        """Take away what `connect` has set up: called when it is detached, or a state without it is restored."""

    def reset(self) -> None:
        """Undo what a reset of the world does not: called at a reset, before any source begins again."""

    def end(self) -> None:
        """Undo what lasts of its events, such as that agents are inactive: called before it is detached."""

    def joined(self, agent: Body, member: int) -> None:
        """Called after an agent has come to the group in the middle of a run; by default nothing is done."""

    def left(self, agent: Body, member: int) -> None:
        """Called after an agent has left the group; by default nothing is done.

        Its pending events stay planned: cancel them here, or let them test whether `agent` returns None.
        """

    def switched(self, agent: Body, member: int, channel: str | None, on: bool) -> None:
        """Called before it is set whether an agent of the group is active, or its sensor of a channel works."""

    def save(self) -> Any:
        """Return its own data: all that changes in a run, except planned events; by default the attributes `changing`.

        What it returns must be copied and pickled easily.
        """
        return {name: copy.deepcopy(getattr(self, name)) for name in self.changing}

    def load(self, data: Any) -> None:
        """Go back to what `save` returned. The planned events of that time are planned again: see `pending`."""
        vars(self).update(copy.deepcopy(data))

    # What a subclass can use.

    @property
    def clock(self) -> Clock:
        """The clock of its world."""
        clock: Clock = self.world.clock
        return clock

    @property
    def now(self) -> float:
        """The exact time of the present event; the present tick between events."""
        return float(self.world.clock._now)

    @property
    def members(self) -> list[int]:
        """The members of its group that are present, in the order of rows."""
        found: list[int] = self._its_group().bodies.member.tolist()
        return found

    def beside(self, kind: type[S]) -> list[S]:
        """Return the attached sources of a kind that concern the same group, this one among them."""
        return [one for one in self.world.sources if isinstance(one, kind) and one.group is self.group]

    def agent(self, member: int) -> Any:
        """Return the agent of the group that is this member; None if it has left."""
        row = self.row(member)
        return None if row < 0 else self._its_group()._agents[row]

    def row(self, member: int) -> int:
        """Return the present row of a member in the arrays of the group; -1 if it has left."""
        present = self._its_group().bodies.member
        # Members are in increasing order, and mostly all are there.
        row = member if member < len(present) and present[member] == member else int(np.searchsorted(present, member))
        return row if row < len(present) and present[row] == member else -1

    def member(self, agent: Body) -> int:
        """Return the member that an agent of the group is."""
        return int(self._its_group().bodies.member[agent.row])

    def plan(self, time: float, method: str, *arguments: Any) -> Planned:
        """Call a method of this source at `time` [ticks].

        Parameters
        ----------
        time : float
            The time [ticks], at least `now`. Simultaneous events happen in the order in which they were planned.
        method : str
            The name of the method.
        *arguments
            Numbers, texts, None, and tuples of these.

        Returns
        -------
        Planned
            The planned call, which `cancel` takes back.

        Raises
        ------
        TypeError, ValueError
            If the time has passed or is not a finite number, there is no such method, or an argument is something else.
        """
        if not isinstance(method, str):
            raise TypeError(
                f"plan(…, {checks.shown(method)}): must be the name of a method of {type(self).__name__}, such as "
                '"begin", so that a state can hold the call; for functions there is world.clock.at(time, function)'
            )
        if self.world is None:
            raise RuntimeError(f"{self!r}: belongs to no world; world.attach returns a copy that does")
        if (action := getattr(self, method, None)) is None:
            raise TypeError(f"plan(…, {method!r}): {type(self).__name__} has no method of this name; define it")
        for argument in arguments:
            if type(argument) not in _CONSTANT:
                raise TypeError(
                    f"plan({time!r}, {method!r}, …, {checks.shown(argument)}): the arguments of a planned call must be "
                    "numbers, texts, None or tuples of these, which a state can hold; name an agent by its member"
                )
        planned: Planned = self.world.clock.plan(time, action, *arguments)
        return planned

    def cancel(self, planned: Planned | None) -> None:
        """Take a planned call back. It has no effect on None, and on a call that has happened or was cancelled."""
        if planned is not None:
            planned.cancel()

    def pending(self, method: str | None = None) -> list[Planned]:
        """Return its planned calls to come, in order; of one method, if one is named. It looks through all events."""
        calls = [event for *_, event in self.clock.pending if getattr(event, "arguments", None) is not None]
        mine = [one for one in calls if getattr(one.action, "__self__", None) is self]
        return [one for one in mine if method in (None, one.action.__name__)]

    def when(self, event: Any, method: str, *arguments: Any) -> None:
        """Call a method when a SimPy event happens, such as a request of a resource.

        A saved state holds the call if the event is triggered. An event that waits, as a request in a queue does, is
        the source's own data: `save` returns what `load` needs to make it again, in the same order.
        """
        event.callbacks.append(When(self, method, arguments))

    def random(self, member: int, index: int) -> float:
        """Return a uniform random number in (0, 1).

        It is a function of the world's seed, the name of its class, its group, which of its kind it is, member and
        index. So what else is attached, as logs of contacts or batteries, does not change it.

        Parameters
        ----------
        member : int
            The member, or any number of at least 0 for a source without a group.
        index : int
            Which number: 0, 1, 2, …
        """
        blocks, place = vars(self)["_numbers"], (index // TICKS_A_BLOCK, member // _MEMBERS)
        block = blocks.get(place)
        if block is None:
            if len(blocks) >= _MOST_BLOCKS:
                blocks.clear()
            members = np.arange(place[1] * _MEMBERS, (place[1] + 1) * _MEMBERS)
            numbers = uniforms_of_block(self._key(), Stream.EVENTS, index, members, 1)
            block = blocks[place] = numbers[:, 0].tolist()
        number: float = block[index % TICKS_A_BLOCK][member % _MEMBERS]
        return number

    def log(self, what: str, agent: Body | None = None, /, **details: str | float | np.generic | None) -> None:
        """Add an event to the log of the world, with the name of this class as its source; see `World.log`."""
        self.world._data.sources.log(what, agent, type(self).__name__, details)

    # How it is attached.

    @property
    def is_attached(self) -> bool:
        """Whether it belongs to a world."""
        return self.world is not None

    def __repr__(self) -> str:
        given = [name for name in inspect.signature(type(self)).parameters if name in vars(self)]
        return f"{type(self).__name__}({', '.join(f'{name}={vars(self)[name]!r}' for name in given)})"

    def __getstate__(self) -> dict[str, Any]:
        if self.is_attached:
            raise TypeError(
                f"{self!r}: belongs to a world and cannot be copied or pickled; take the source that was attached, and "
                "World.state for what has happened to this one"
            )
        return vars(self)

    def _key(self) -> Any:
        group = -1 if self.group is None else self.group.number
        return key_within(self.world._data.key, f"{stable_name(type(self))} {group} {self.nth}")

    def _its_group(self) -> Group[Any]:
        if self.group is None:
            name = type(self).__name__
            raise ValueError(f"{self!r}: has no group; attach it to one, as in world.attach({name}(…), robots)")
        return self.group


class Watching(EventSource, Watcher):
    """A source that watches each step in compiled code, as long as it is attached."""

    def connect(self) -> None:
        """Begin to watch."""
        self.world._engine.watch(self)

    def disconnect(self) -> None:
        """Watch no longer."""
        self.world._engine.unwatch(self)


class When:
    """A call of a source's method when a SimPy event happens."""

    def __init__(self, source: EventSource, method: str, arguments: tuple[Any, ...]) -> None:
        self.action, self.arguments = getattr(source, method), arguments

    def __call__(self, event: Any) -> None:
        call(event.env, self.action, self.arguments)


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
        self._timeline.check_undecided("attach()")
        _check(world, source, group)
        # Numbers from `following` on are of sources that could not begin, or that a restored state does not know.
        earlier = [one for number, one in self.known.items() if number < self.following and one.group is group]
        nth = sum(type(one).__name__ == type(source).__name__ for one in earlier)
        mine = copy.copy(source)
        # A subclass may be a frozen dataclass.
        vars(mine).update(world=world, group=group, number=self.following, nth=nth, _numbers={})
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
            # They were drawn with another seed.
            vars(source)["_numbers"].clear()
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
    if group is not None:
        world._data.check_group(group, f"attach({name}(…), {{}})")
