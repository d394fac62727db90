"""State: all that changes in a run, as one value."""

from __future__ import annotations

import copy
import pickle
import weakref
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import put
from teamsight.agents.body import Body
from teamsight.agents.decisions import EVERY_STEP, give_timetable
from teamsight.agents.engine.detection import Readings
from teamsight.agents.engine.interactions import InteractionSaved, check_interactions
from teamsight.agents.events.sources import EventLog
from teamsight.agents.host import note_conditions
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.mesa.bases import Agent, Model
from teamsight.agents.mesa.compat import Generators
from teamsight.agents.recording.history import History
from teamsight.agents.recording.recording import HistoryCollector, collecting_once
from teamsight.agents.resolve import IN_TABLE, columns_of_state, first_state_of_members, layout
from teamsight.agents.sensing.lidar import Lidar
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.table import Table
from teamsight.core.version import __version__
from teamsight.policies.interface import PolicyState
from teamsight.world.clock import Planned, callbacks_of
from teamsight.world.contact import Pass
from teamsight.world.drive import Free
from teamsight.world.motion import ABILITIES
from teamsight.world.noise import key_of
from teamsight.world.placement import Founders

if TYPE_CHECKING:
    from teamsight.agents.attributes import SeedLike
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.group import Group
    from teamsight.agents.mesa.bases import Model
    from teamsight.agents.recording.recording import Recording
    from teamsight.agents.world_data import FirstStates, WorldData
    from teamsight.world.contact import Contact
    from teamsight.world.drive import Drive
    from teamsight.world.placement import Starts


# With what the members of a world begin is as it was built, whatever state is restored.
_ABILITIES = [field.name for field in ABILITIES]


def lost_members(group: Group, member: npt.NDArray[np.int64]) -> list[int]:
    """Return the members that cannot come back: agents made by an ``__init__`` of the user's that nobody keeps."""
    if group.agent_class.__init__ is Body.__init__:
        return []
    missing = set(member.tolist()) - set(group.bodies.member.tolist())
    return sorted(number for number in missing if number not in group.departed)


def bring_back(model: Model, group: Group, saved: Table) -> None:
    """Give a group the agents of a saved table, in its order; columns that it does not have get rows for them.

    An agent that has left and is still in use somewhere comes back itself; else a new one takes its place.
    """
    present = dict(zip(group.bodies.member.tolist(), group._agents, strict=True))
    rows = {number: row for row, number in enumerate(present)}
    wanted = saved.member.tolist()
    group.bodies.arrange(np.array([rows.get(number, -1) for number in wanted], np.int64))
    for number in present.keys() - set(wanted):
        agent = present.pop(number)
        model.deregister_agent(agent)
        agent.row = -1
        group.departed[number] = agent
    agents = []
    for row, (number, unique_id) in enumerate(zip(wanted, saved.identity.tolist(), strict=True)):
        agent = present.get(number) or _returned(model, group, number)
        # Here agents may have come in another order; and mesa may give those that return a new one.
        agent.unique_id = unique_id
        agent.row = row
        agents.append(agent)
    group._agents = agents


def _returned(model: Model, group: Group, number: int) -> Any:
    agent = group.departed.pop(number, None)
    if agent is None:
        made: Any = group.agent_class
        agent = made.__new__(made)
        vars(agent).update(group=group, _row=-1)
        Agent.__init__(agent, model)
    else:
        model.register_agent(agent)
    return agent


class SavedPolicy:
    """A policy of single robots of a group, in a state. Copies of the state share it.

    Attributes
    ----------
    description : str
        See `described`.
    """

    def __init__(self, policy: Any, group: Group) -> None:
        self.description = described(policy)
        self._policy, self._bytes = policy, b""
        self._group: Any = weakref.ref(group)

    def is_of(self, group: Group, policy: Any) -> bool:
        """Whether a policy of a group is this one, or like it."""
        return policy is self._policy if self._is_of(group) else described(policy) == self.description

    def made_for(self, group: Group) -> Any:
        """Return the policy for a group that has none like it; None if it cannot be pickled."""
        # A copy for another group: a policy in Python may hold data, or be a method, of the world that it comes from.
        if self._is_of(group):
            return self._policy
        policy = self._bytes or _pickled(self._policy)
        try:
            return pickle.loads(policy) if policy else None
        except Exception:  # A class that is not known here, or whatever it raises.
            return None

    def _is_of(self, group: Group) -> bool:
        return self._group is not None and self._group() is group

    def __deepcopy__(self, memo: Any) -> SavedPolicy:
        return self

    def __getstate__(self) -> dict[str, Any]:
        # As bytes: a state can be loaded where the policy's class is not known.
        policy = self._bytes or _pickled(self._policy)
        return {"description": self.description, "_policy": None, "_group": None, "_bytes": policy}


def _pickled(policy: Any) -> bytes:
    """Return a pickled policy; nothing if that is not possible."""
    try:
        return b"" if policy is None else pickle.dumps(policy)
    except Exception:  # Whatever the user's class raises.
        return b""


def described(policy: Any) -> str:
    """Return a text that is equal for equal policies, also in other processes."""
    text = repr(policy)
    if " at 0x" not in text:
        return text
    # A repr that contains a memory address differs between processes.
    name: str = getattr(policy, "__qualname__", type(policy).__name__)
    if not is_dataclass(policy) or isinstance(policy, type):
        return name
    shown = (f"{one.name}={described(getattr(policy, one.name))}" for one in fields(policy) if one.repr)
    return f"{name}({', '.join(shown)})"


def _described(part: Contact | Drive) -> str:
    """Return a text that is equal for equal contacts or drives, also in other processes."""
    text = described(part)
    return text if text == repr(part) else f"{text}{tuple(part.parameters)}"


def others_of(group: Group, saved: tuple[SavedPolicy, ...]) -> list[Any]:
    """Return the policies of single robots that were saved: its own, those like them that it has, or copies.

    Raises
    ------
    ValueError
        If the group does not have a policy, and it cannot be pickled.
    """
    known, found = list(group.others), []
    for one in saved:
        alike = [policy for policy in known if one.is_of(group, policy)]
        policy = alike[0] if alike else one.made_for(group)
        if policy is None:
            raise ValueError(
                f"restore(…): the state is of a world in which single {group.name} have the policy {one.description}, "
                f"which could not be pickled and which {group.name} do not have here; give it to one of them first, "
                f"as in {group.name}[0].policy = …"
            )
        known = [other for other in known if other is not policy]
        found.append(policy)
    return found


class GroupState(NamedTuple):
    """The state of a group, and its description: name, policy, degree of awareness, first size and first cycle.

    Attributes
    ----------
    bodies, members, founders
        As in `Group`: what has a value for each agent, and how they begin a run.
    states : list
        The state of each policy; `IN_TABLE` for one that the table has.
    others : tuple of SavedPolicy
        The policies of single robots.
    sensors : dict of str to Sensor or None
        The sensor of each channel.
    readings : dict of str to Readings
        As in `Group`.
    has_timetable, has_decided : bool
        Whether the table has the columns of a timetable; and as in `Group`.
    drive : str
        The description of the drive; nothing for `Free`.
    lidar : Lidar or None
        As in `Group`.
    """

    name: str
    policy: str
    awareness: str
    first_size: int
    first_cycle: str
    bodies: Table
    members: Table
    founders: list[Founders]
    states: list[Any]
    others: tuple[SavedPolicy, ...]
    sensors: dict[str, Sensor | None]
    readings: dict[str, Readings]
    has_timetable: bool
    has_decided: bool
    drive: str = ""
    lidar: Lidar | None = None


#: The number of the form of states; a state of another form is refused.
FORMAT = 1


class State(NamedTuple):
    """The state of a world; it can be pickled.

    Attributes
    ----------
    seed, tick : int
        The seed and the number of completed steps.
    arena : tuple
        A description of the arena.
    groups : tuple of GroupState
        The states of the groups.
    history : History
        The completed steps.
    collected : HistoryCollector or None
        The world's own data collector; None if the user has set another.
    events : SavedEvents
        The planned calls, the event sources and the event log.
    generators : Generators
        Where ``world.random`` and ``world.rng`` are.
    interactions : tuple of InteractionSaved
        The states of the interactions.
    format : int
        The number of this form of states.
    version : str
        The version of teamsight that saved it.
    """

    seed: int
    tick: int
    arena: tuple[Any, ...]
    groups: tuple[GroupState, ...]
    history: History
    collected: HistoryCollector | None
    events: SavedEvents
    generators: Generators
    interactions: tuple[InteractionSaved, ...] = ()
    format: int = 0
    version: str = "an earlier version"


class StateKeeper:
    """Saves, restores and resets a world, with the counters and random numbers of its model."""

    def __init__(self, model: mesa.Model, data: WorldData, engine: Engine, recording: Recording) -> None:
        self._model, self._data, self._engine, self._recording = model, data, engine, recording

    def save(self, pending: str) -> State:
        """Return a copy of all that changes in a run; see `World.state`."""
        groups = tuple(
            GroupState(
                *_identified(group)[:-1], group.bodies, group.members, group.founders, group._states,
                tuple(SavedPolicy(policy, group) for policy in group.others),
                {name: channel.sensor for name, channel in group.channels.items()}, group.readings,
                group.timetable is not None, group.has_decided, _identified(group)[-1], group.lidar,
            )
            for group in self._data.groups
        )  # fmt: skip
        collector = self._recording.collector
        collected = collector if isinstance(collector, HistoryCollector) else None
        data = self._data
        events, arena = save_events(self._model, data, pending), _identified_space(data)
        generators = mesa_compat.generators(self._model)
        interactions = tuple(one.saved() for one in data.interactions)
        return copy.deepcopy(State(
            data.seed, data.timeline.tick, arena, groups, data.history, collected, events, generators, interactions,
            FORMAT, __version__,
        ))  # fmt: skip

    def restore(self, saved: State) -> None:
        """Go back to a saved state; see `World.restore`."""
        data, recording = self._data, self._recording
        data.timeline.check_undecided("restore()")
        _check_fits(saved, data)
        saved = copy.deepcopy(saved)
        with deferred():
            for group, old in zip(data.groups, saved.groups, strict=True):
                others = others_of(group, old.others)
                bring_back(self._model, group, old.bodies)
                # It begins its runs with the members that it had: the next to arrive get the same numbers and noise.
                # Without arrivals these are as the world was built.
                if max(len(group.members), len(old.members)) > group.first_size:
                    group.founders = old.founders
                    group.members.assign(old.members)
                group.readings = old.readings
                for name, sensor in old.sensors.items():
                    group.channels[name].sensor = sensor
                if group.timetable is None and old.has_timetable:
                    give_timetable(data, group, EVERY_STEP.numbers(len(group)))
                elif group.timetable is not None and not old.has_timetable:
                    group.timetable.drop()
                    put(group, timetable=None)
                group.bodies.write(old.bodies)
                group.members.write(old.members, but=_ABILITIES)
                note_conditions(group)
                group.set_policies(others, old.states)
                group.begin(has_decided=old.has_decided)
            for placed, kept in zip(data.interactions, saved.interactions, strict=True):
                placed.put_back(kept)
            if saved.collected is not None and isinstance(recording.collector, HistoryCollector):
                recording.collector = saved.collected
            self._continue(saved.seed, saved.tick, saved.history)
            mesa_compat.put_generators(self._model, saved.generators)
            restore_events(self._model, data, saved.events)

    def reset(self, rng: SeedLike = None) -> None:
        """Start again; see `World.reset`."""
        data = self._data
        data.timeline.check_undecided("reset()")
        seed = data.seed if rng is None else checks.seed(rng, None)
        collector = _emptied(self._recording.collector)
        # What can fail comes first, before anything changes.
        start, states = data.start_of(key_of(seed)[np.newaxis]), data.first_states()
        with deferred():
            if data.arena is not data.first_arena:
                data.put_arena(data.first_arena)
                self._engine.is_bound = False
            self.begin(seed, start, 0, states, is_kept=data.is_rewritable)
            self._recording.collector = collector
        if not isinstance(collector, HistoryCollector):
            collecting_once(collector, data.timeline).collect(self._model)

    def begin(self, seed: int, start: Starts, run: int, states: FirstStates, *, is_kept: bool) -> None:
        """Begin a run under a seed: place all agents again and set the clock to 0; see `WorldData.restart`."""
        self._data.restart(start, run, states, is_kept=is_kept)
        for group in self._data.groups:
            if group.timetable is not None:
                group.timetable.begin(slice(None), key_of(seed), 0)
        self._model.random.seed(seed)
        self._model.rng = None
        self._continue(seed, 0, History(), is_kept=is_kept)
        self._data.sources.begin()

    def _continue(self, seed: int, tick: int, history: History, *, is_kept: bool = False) -> None:
        self._data.begin(seed, tick, history)
        mesa_compat.set_counters(self._model, tick)
        self._model.running = True
        self._engine.forget(is_kept=is_kept)


def _check_fits(saved: State, data: WorldData) -> None:
    """Refuse a state of a world with another arena, other groups, policies or cycles."""
    if not isinstance(saved, State):
        raise TypeError(f"restore({type(saved).__name__}): must be what state() returned")
    if saved.format != FORMAT:
        raise ValueError(checks.other_format("restore(…)", saved.format, FORMAT, saved.version))
    if saved.arena != (space := _identified_space(data)):
        cure = "restore it in a world built in the same way"
        if saved.arena[2:] == space[2:]:
            cure += ", or set the obstacles of that time first, as in world.arena = …"
        raise ValueError(
            f"restore(…): the state is of a world in {_named(saved.arena)}, and this world is in {data.arena}"
            f"{_contact_in(space)}; {cure}"
        )
    mine = [_identified(group) for group in data.groups]
    theirs = [(*old[:5], old.drive) for old in saved.groups]
    if mine != theirs:
        raise ValueError(
            f"restore(…): the state is of a world with {_difference(theirs, mine)}; restore it in a world built in the "
            "same way"
        )
    for group, old in zip(data.groups, saved.groups, strict=True):
        if old.sensors.keys() != group.channels.keys():
            here, there = (", ".join(map(repr, names)) or "none" for names in (group.channels, old.sensors))
            raise ValueError(
                f"restore(…): the state is of a world in which {group.name} have the channels {there}, and here "
                f"{here}; restore it in a world built in the same way"
            )
        begun = min(group.first_size, len(old.members))
        if not np.array_equal(old.members.radius[:begun], group.members.radius[:begun]):
            raise ValueError(
                f"restore(…): the state is of a world in which {group.name} have another radius than here, "
                f"{_shown_radius(old.members)} and not {_shown_radius(group.members)}; restore it in a world built in "
                "the same way"
            )
        if old.lidar != group.lidar:
            raise ValueError(
                f"restore(…): the state is of a world in which {group.name} have lidar={old.lidar}, and here "
                f"{group.lidar}; restore it in a world built in the same way"
            )
        if lost := lost_members(group, old.bodies.member):
            raise ValueError(
                f"restore(…): the state is of a world with {len(old.bodies)} {group.name}, of which {len(lost)} are "
                "not here; agents whose class has an __init__ cannot be made again: keep references to those that leave"
            )
        others_of(group, old.others)
        state = layout(first_state_of_members(group.rules[0], old.bodies.member, len(old.members)))
        saved_state = old.states[0]
        if saved_state is IN_TABLE:
            saved_state = PolicyState(*(old.bodies[name] for name in columns_of_state(0)))
        if group.is_compiled and layout(saved_state) != state:
            raise ValueError(
                f"restore(…): the policy of {group.name} has the state {layout(saved_state)}, and here "
                f"{state}; restore it in a world whose policies have the same options"
            )
    check_interactions(saved.interactions, data.interactions)
    check_events(saved.events, data)


def _shown_radius(members: Table) -> str:
    return ", ".join(f"{one:g}" for one in np.unique(members.radius)[:5])


def _emptied(collector: mesa.DataCollector) -> mesa.DataCollector:
    if isinstance(collector, HistoryCollector):
        return collector.emptied()
    names = ("model_reporters", "agent_reporters", "agenttype_reporters")
    return type(collector)(**{name: getattr(collector, name) for name in names})


def _identified(group: Group) -> tuple[str, str, str, int, str, str]:
    """Return the description of a group: its name, policy, degree of awareness, first size, first cycle and drive."""
    # A cycle that was set since is in the timetable.
    return (
        group.name, described(group.policy), repr(group.awareness), group.first_size, repr(group.first_cycle),
        "" if isinstance(group.drive, Free) else _kept_by(group.drive),
    )  # fmt: skip


def _kept_by(drive: Drive) -> str:
    return f"{_described(drive)} that keeps {' and '.join(drive.state) or 'nothing'}"


def _difference(theirs: list[Any], mine: list[Any]) -> str:
    if len(theirs) != len(mine):
        return f"{len(theirs)} groups, and this one has {len(mine)}"
    one, other = next((one, other) for one, other in zip(theirs, mine, strict=True) if one != other)
    # For two policies of one class, the constants that differ.
    parts = [", ".join(map(str, group)).replace("(", ", ").replace(")", "").split(", ") for group in (one, other)]
    first, second = (", ".join(part for part in a if part and part not in b)[:120] for a, b in (parts, parts[::-1]))
    return f"{one[0]} that have {first}, and {other[0]} have {second} here"


def _identified_space(data: WorldData) -> tuple[Any, ...]:
    """Return the description of an arena, and of the contacts in it: equal for equal ones, also in other processes."""
    arena = data.arena
    box = tuple(np.ravel(arena.bounds).tolist())
    contact = () if isinstance(data.contact, Pass) else (_described(data.contact),)
    return (type(arena).__qualname__, tuple(arena.size), tuple(arena.period), box, *contact)


def _named(arena: tuple[Any, ...]) -> str:
    name, size, *_ = arena
    return f"{name} of size {', '.join(f'{side:g}' for side in size)}{_contact_in(arena)}"


def _contact_in(space: tuple[Any, ...]) -> str:
    return f" with contact={space[4]}" if len(space) > 4 else ""


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
                action = getattr(one, "action", one)
                raise _cannot_save(
                    f"the call of {getattr(action, '__qualname__', checks.shown(action))} is planned at {time:g}, and "
                    "a function cannot be saved; plan a method of the world or of an agent, or use an EventSource"
                )
    saved = [SavedSource(one.number, described(one), _group_number(one), one.save()) for one in sources.attached]
    identity = model.agent_id_counter
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
        here = "none" if known is None else described(known)
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
        model.agent_id_counter = saved.identity
    sources.replace([sources.known[one.number] for one in saved.sources])
    sources.following, data.timeline.events_end_steps = saved.following, saved.events_end_steps
    # What sources plan when they load their data comes after all that was planned.
    clock.order = saved.order
    for time, priority, order, owner, method, arguments in saved.calls:
        action = getattr(_found(model, data, owner), method)
        Planned(clock, time, priority, order, action, arguments)
    sources.events = EventLog(saved.log.rows)
    for source, one in zip(sources.attached, saved.sources, strict=True):
        vars(source)["_numbers"].clear()
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


def _group_number(source: Any) -> int | None:
    return None if source.group is None else int(source.group.number)
