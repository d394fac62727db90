"""An event source: a component that plans events in a world, such as failures, arrivals or charging."""

from __future__ import annotations

import copy
import inspect
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from teamsight.agents.engine.watching import Watcher
from teamsight.agents.group import Group
from teamsight.core import checks
from teamsight.core.references import stable_name
from teamsight.world.clock import Planned, call
from teamsight.world.noise import TICKS_A_BLOCK, Stream, key_within, uniforms_of_block

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.world.clock import Clock

# The numbers of so many members are drawn at once: more cost hardly more time than one.
_MEMBERS = 16
_MOST_BLOCKS = 1024
# What a planned call can be given: what a saved state can hold, and agents cannot be.
_PLAIN = frozenset({int, float, str, bool, type(None), np.int64, np.float64, tuple})


class EventSource:
    """A component that plans events in a world; a subclass says which.

    `World.attach` copies it, so one object can serve many worlds, be a parameter of a sweep, and be pickled. The copy
    belongs to the world: `begin` plans its first events, and each event is the call of one of its methods by name,
    which may plan the next. So a saved state can hold all that is pending.

    Agents are named by their *member*, a number that they never lose, while rows change when others leave.

    Attributes
    ----------
    needs_group : bool
        Declared by the class: whether it can only be attached to a group.
    defers_interrupts : bool
        Declared by the class: whether Ctrl-C waits until a call of one of its methods by an event is complete.
        Otherwise that event may be lost, and with it all that it would have planned.
    world : World
        Its world, once it is attached.
    group : Group or None
        The group to which it is attached.
    number : int
        Its number in its world: 1, 2, … in the order in which sources were attached. No other source gets it later.
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
    world: Any = None
    group: Group[Any] | None = None
    number: int = 0
    nth: int = 0

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
        """Return its own data: all that changes in a run, except planned events; must be copied and pickled easily."""
        return None

    def load(self, data: Any) -> None:
        """Go back to what `save` returned. The planned events of that time are planned again: see `pending`."""

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
        action = getattr(self, method, None) if isinstance(method, str) else None
        if action is None or self.world is None:
            raise self._cannot_plan(method)
        for argument in arguments:
            if type(argument) not in _PLAIN:
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

    def attached_copy(self, world: Any, group: Group[Any] | None, number: int, nth: int) -> Self:
        """Return a copy that belongs to a world."""
        mine = copy.copy(self)
        # A subclass may be a frozen dataclass.
        vars(mine).update(world=world, group=group, number=number, nth=nth, _numbers={})
        return mine

    def forget_numbers(self) -> None:
        """Forget the random numbers that were drawn, because the seed has changed."""
        vars(self)["_numbers"].clear()

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

    def _cannot_plan(self, method: Any) -> Exception:
        if not isinstance(method, str):
            return TypeError(
                f"plan(…, {checks.shown(method)}): must be the name of a method of {type(self).__name__}, such as "
                '"begin", so that a state can hold the call; for functions there is world.clock.at(time, function)'
            )
        if self.world is None:
            return RuntimeError(f"{self!r}: belongs to no world; world.attach returns a copy that does")
        return TypeError(f"plan(…, {method!r}): {type(self).__name__} has no method of this name; define it")


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
