"""What a state holds of events: planned calls, sources and the log. Users' functions and processes cannot be saved."""

from __future__ import annotations

from typing import Any, NamedTuple

from teamsight.agents.body import Body
from teamsight.agents.events.sources import EventLog
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.mesa.compat import Model
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.world.clock import Planned, callbacks_of

# Whose method a planned call is: ("world", 0, 0), ("source", number, 0) or ("agent", number of its group, member).
Owner = tuple[str, int, int]


class SavedCall(NamedTuple):
    """A planned call; see `Planned`."""

    time: float
    priority: float
    order: int
    owner: Owner
    method: str
    arguments: tuple[Any, ...]


class SavedSource(NamedTuple):
    """An attached source: its number and description, the number of its group, and its own data."""

    number: int
    description: str
    group: int | None
    data: Any


class SavedEvents(NamedTuple):
    """The events of a world.

    Attributes
    ----------
    calls : list of SavedCall
        The planned calls of sources, and those of methods of the world and of agents.
    sources : list of SavedSource
        The attached sources.
    following, order, identity : int
        The numbers of the next source, of the next event on the clock, and of the next agent.
    log : EventLog
        The event log.
    events_end_steps : bool
        See `Timeline`.
    """

    calls: list[SavedCall]
    sources: list[SavedSource]
    following: int
    order: int
    identity: int
    log: EventLog
    events_end_steps: bool


def save_events(model: Model, data: WorldData, pending: str) -> SavedEvents:
    """Return the events of a world; see `World.state` for `pending`.

    Raises
    ------
    TypeError
        If a process has not ended, or a planned call is a function of the user's, unless `pending` is "drop".
    ValueError
        If `pending` is neither "keep" nor "drop".
    """
    clock, sources = data.timeline.clock, data.sources
    checks.choice("pending", pending, ("keep", "drop"))
    if pending == "keep":
        for process in clock.processes:
            raise _cannot_save(f"the process {process.name} has not ended, and a running generator cannot be saved")
    calls = []
    for time, priority, order, event in clock.pending:
        # The callbacks of a planned call are itself, and processes that wait for it.
        for one in [event] if isinstance(event, Planned) else callbacks_of(event):
            owner = _owner(model, data, one)
            if owner is not None:
                calls.append(SavedCall(time, priority, order, owner, one.action.__name__, one.arguments))
            elif pending == "keep":
                raise _cannot_save(
                    f"{_named(one)} is planned at {time:g}, and a function cannot be saved; plan a method of the world "
                    "or of an agent, or use an EventSource"
                )
    saved = [SavedSource(one.number, _described(one), _group_number(one), one.save()) for one in sources.attached]
    identity = mesa_compat.next_identity(model)
    log = EventLog(sources.events.rows)
    return SavedEvents(calls, saved, sources.following, clock.order, identity, log, data.timeline.events_end_steps)


def check_events(saved: SavedEvents, data: WorldData) -> None:
    """Refuse the events of a world with other sources.

    Raises
    ------
    ValueError
        If a source is missing or has other parameters.
    """
    for one in saved.sources:
        known = data.sources.known.get(one.number)
        here = "none" if known is None else _described(known)
        if known is None or (here, _group_number(known)) != (one.description, one.group):
            raise ValueError(
                f"restore(…): the state is of a world whose source {one.number} is {one.description}, and here it is "
                f"{here}; restore it in a world to which the same sources are attached in the same order"
            )


def restore_events(model: Model, data: WorldData, saved: SavedEvents) -> None:
    """Go back to saved events, after all else is restored and the clock is empty."""
    clock, sources = data.timeline.clock, data.sources
    if all(agent.unique_id < saved.identity for agent in model.agents):
        # The next to arrive get the numbers that they would have had.
        mesa_compat.set_next_identity(model, saved.identity)
    sources.replace([sources.known[one.number] for one in saved.sources])
    sources.following, data.timeline.events_end_steps = saved.following, saved.events_end_steps
    # What sources plan when they load their data comes after all that was planned.
    clock.order = saved.order
    for time, priority, order, owner, method, arguments in saved.calls:
        action = getattr(_found(model, data, owner), method)
        clock.plan_again(time, priority, order, action, arguments)
    sources.events = EventLog(saved.log.rows)
    for source, one in zip(sources.attached, saved.sources, strict=True):
        source.forget_numbers()
        source.load(one.data)


def _owner(model: Model, data: WorldData, call: Any) -> Owner | None:
    """Return whose method is called, if it can be found again by its name."""
    action = getattr(call, "action", None)
    owner = getattr(action, "__self__", None)
    if owner is None or getattr(owner, getattr(action, "__name__", ""), None) != action:
        return None
    if owner is model:
        return ("world", 0, 0)
    if isinstance(owner, Body) and owner.model is model and owner._row >= 0:
        return ("agent", owner.group.number, int(owner.group.bodies.member[owner._row]))
    if any(owner is source for source in data.sources.attached):
        return ("source", owner.number, 0)
    return None


def _found(model: Model, data: WorldData, owner: Owner) -> Any:
    kind, number, member = owner
    if kind == "world":
        return model
    if kind == "source":
        return data.sources.known[number]
    group = data.groups[number]
    return group._agents[group.bodies.member.tolist().index(member)]


def _cannot_save(reason: str) -> TypeError:
    return TypeError(f"state(): {reason}; state(pending='drop') saves the world without it")


def _named(call: Any) -> str:
    action = getattr(call, "action", call)
    return f"the call of {getattr(action, '__qualname__', checks.shown(action))}"


def _described(source: Any) -> str:
    text = repr(source)
    # A repr that contains a memory address differs between processes.
    return type(source).__name__ if " at 0x" in text else text


def _group_number(source: Any) -> int | None:
    return None if source.group is None else int(source.group.number)
