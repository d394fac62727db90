"""The world: a mesa model in which groups of agents perceive, decide and move."""

from __future__ import annotations

import os
from collections.abc import Mapping
from inspect import Parameter
from types import EllipsisType
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Unpack, overload

import numpy as np
import pandas as pd

from teamsight.agents.attributes import (
    AwarenessLike,
    Numbers,
    PlacementName,
    Points,
    PolicyLike,
    SeedLike,
    refusing,
)
from teamsight.agents.body import Body
from teamsight.agents.channel import note_of_inactive
from teamsight.agents.decisions import EVERY_STEP, CycleLike
from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Changes, Group
from teamsight.agents.host import WorldHost
from teamsight.agents.mesa.model import MesaModel
from teamsight.agents.recording.recording import Recording
from teamsight.agents.sensing.lidar import Lidar
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import RangeShape
from teamsight.agents.state import State, StateKeeper
from teamsight.agents.stepping import Stepper
from teamsight.agents.teammates import Teammates, neighbours, teammates
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.card import shown
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Arena
from teamsight.world.contact import Contact, contact_of
from teamsight.world.drive import Drive
from teamsight.world.interaction import Interaction
from teamsight.world.registry import ContactName, DriveName

if TYPE_CHECKING:
    from teamsight.agents.events.contact_log import ContactLog
    from teamsight.agents.events.observation_counts import ObservationCounts
    from teamsight.agents.events.sources import EventSource
    from teamsight.agents.events.until import Until
    from teamsight.agents.recording.world_replay import WorldReplay
    from teamsight.agents.world_data import FirstStates
    from teamsight.world.placement import Starts

S = TypeVar("S", bound="EventSource")
A = TypeVar("A", bound=Body)
Rule = TypeVar("Rule", bound=Interaction)
_NONE: Any = Parameter.empty


class SettingOfGroups:
    """A setting of groups that a world does not have: setting it on a world raises an error.

    In a subclass of `World` it is an ordinary attribute, so that models can have parameters of these names.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._owner, self._name = owner, name

    def __get__(self, model: Any, owner: type | None = None) -> Any:
        if model is None:
            return self
        try:
            return vars(model)[self._name]
        except KeyError:
            name = self._name
            kind = type(model).__name__
            raise AttributeError(f"{kind!r} object has no attribute {name!r}; use that of a group") from None

    def __set__(self, model: Any, value: Any) -> None:
        if type(model) is self._owner:
            name = self._name
            raise AttributeError(f"{name}={checks.shown(value)}: belongs to each group; set group.{name}")
        model.__dict__[self._name] = value


@refusing(
    contacts="log_contacts(group) fills it",
    events="it is what happened; world.log(…) adds to it, and reset() empties it",
    sources="world.attach(…) and world.detach(…) change them",
    until="its methods return the events for which a process can wait, as in world.until.observed(target)",
    contact="all agents were placed for it; build another world",
    seed_used="start again with reset(rng)",
    tick="run(n) makes steps, reset() starts again, and restore(state) goes back",
    groups="add() adds one",
    interactions="interact() adds one, and adjust() changes one",
    path="it follows from the policies and from what is recorded",
    observed="it is measured",
    observed_fraction="it is measured; reset() starts again",
    mean_degree="it is measured",
    mean_neighbours="it is measured; reset() starts again",
    max_neighbours="it is measured; reset() starts again",
)
class World(MesaModel):
    """A mesa model of groups of agents in an arena.

    Parameters
    ----------
    arena : Arena
        The arena: `Disc`, `Box`, `Torus`, or a class of your own.
    contact : Contact or {"pass", "stop", "slide"}
        What happens when bodies that have a radius meet: they pass through each other; whoever drives into another
        stops, or slides along it; or a class of your own.
    rng : int, array_like of int, SeedSequence, BitGenerator or Generator, optional
        The seed; see `seed_used`. By default a new one is drawn, and from anything but a whole number, as
        ``numpy.random.default_rng(rng).integers(2**53)``: a generator goes on by that, so the next world differs.
    seed : int or as `rng`, optional
        Another name for `rng`.

    Attributes
    ----------
    clock : Clock
        The SimPy environment of the world, in ticks: events and processes.
    recording : Recording
        The history, and the positions and transitions that were recorded.
    running : bool
        Set it to False to stop `run`.

    Raises
    ------
    TypeError, ValueError
        If `arena` is missing or not an arena, a seed is negative or of another type, or `rng` and `seed` differ.

    Notes
    -----
    One step is: process due events → perceive → decide → move → interact → find neighbours → record. `step` makes one
    step, `run` makes many, with the same kernels in the same order and the same result to the last bit.

    An operation that fails changes nothing.
    """

    # Without a default for the arena, Python's own error would come first, which names no cure. With this one the
    # signature says that it has none.
    def __init__(
        self,
        arena: Arena = _NONE,
        *,
        contact: Contact | ContactName = "pass",
        rng: SeedLike = None,
        seed: SeedLike = None,
    ) -> None:
        if arena is _NONE:
            made = "World" if type(self) is World else "super().__init__"
            raise TypeError(f"{type(self).__name__}: has no arena; give it one, as in {made}(Box(10, 10), rng=rng)")
        if not isinstance(arena, Arena):
            shown = checks.shown(arena)
            raise TypeError(f"arena={shown}: must be an arena, such as Disc(5.0), Box(10, 8) or Torus(10, 8)")
        self._data = data = WorldData(arena, checks.seed(rng, seed), contact_of(contact, arena))
        super().__init__(data.seed)
        self.clock = data.timeline.clock
        self._engine = Engine(data)
        self.recording = Recording(data, self._engine)
        self._host = WorldHost(self, data, self._engine)
        self._stepper = Stepper(self, data, self._engine, self.recording, type(self).step is not World.step)
        self._states = StateKeeper(self, data, self._engine, self.recording)

    policy = SettingOfGroups()
    awareness = SettingOfGroups()
    speed = SettingOfGroups()
    turn_limit = SettingOfGroups()
    cycle = SettingOfGroups()
    sensing_range = SettingOfGroups()
    awareness_range = SettingOfGroups()
    radius = SettingOfGroups()
    drive = SettingOfGroups()

    def add(
        self,
        agent_class: type[A],
        count: int,
        *,
        policy: PolicyLike | None = None,
        policy_options: Mapping[str, Any] | None = None,
        awareness: AwarenessLike = "none",
        team: str | EllipsisType | None = ...,
        sensing_range: Numbers = 1.0,
        awareness_range: Numbers = 1.0,
        range_shape: RangeShape = "disc",
        speed: Numbers = 0.1,
        turn_limit: Numbers | None = None,
        placement: PlacementName | Points = "uniform",
        position: Points | None = None,
        heading: Points | None = None,
        cycle: CycleLike = EVERY_STEP,
        radius: Numbers = 0.0,
        drive: Drive | DriveName = "free",
        lidar: Lidar | None = None,
        name: str | None = None,
        **arguments: Any,
    ) -> Group[A]:
        """Add a group of agents.

        Parameters
        ----------
        agent_class : type
            `Robot`, `Target`, `Body`, or a subclass.
        count : int
            The number of agents, at least 1. More can join later; see `Group.add`.
        policy : Policy, callable or str, optional
            The policy of all agents: an object, a callable for one robot ``f(percept, rng) -> (turn, distance)``, or
            the name of a policy. It may be left out if the class overrides `Body.decide`.
        policy_options : mapping of str to object, optional
            The options of a policy given by name: the parameters of its class.
        awareness : Awareness or str
            What they perceive of teammates: an object or a name.
        team : str or None, optional
            The name of their team; agents of groups of one team are teammates. None for no team. By default that of the
            class: "robots" for `Robot`, None for others.
        sensing_range, awareness_range : float or array_like, shape (count,)
            Distances within which they sense targets and teammates [length].
        range_shape : {"disc", "square"}
            The shape of all their ranges. In a square range is whatever is at most the range away along either axis of
            the arena; offsets and distances are Euclidean even so.
        speed : float or array_like, shape (count,)
            The largest distance they can move in a step [length].
        turn_limit : float or array_like, shape (count,), optional
            The largest angle they can turn in a step [rad], at most 2π; unlimited by default, and from π on.
        placement : {"uniform", "spread", "cells"}
            The rule for the initial positions: uniform over the area; spread so that sensing discs do not overlap; or
            at the centres of random cells of side 1.
        position : array_like, shape (count, 2) or (2,), optional
            The initial positions, or one for all [length].
        heading : array_like, shape (count, 2) or (2,), optional
            The initial directions, or one for all; they are normalised. By default they are drawn.
        cycle : Cycle or float
            When they sense and decide; a number is a period [ticks]. By default at every step.
        radius : float or array_like, shape (count,)
            The radius of their bodies [length]; it cannot be changed. Bodies that have one start apart, and meet as the
            `contact` of the world says; see `World`. By default they are points.
        drive : Drive or {"free", "differential", "car"}
            How they carry out their actions; it cannot be changed. By default they turn at once and go straight ahead.
        lidar : Lidar, optional
            A lidar that each of them has; its readings are ``percept.lidar``.
        name : str, optional
            The group's name; by default the class's, in lower case and plural.
        **arguments
            Passed on to the ``__init__`` of the class. As with mesa's ``create_agents``, a list, tuple or array of
            `count` values gives one to each agent, and any other value is for all.

        Raises
        ------
        TypeError, ValueError
            If a value is of the wrong type, shape or size, the policy does not fit the degree of awareness, or the
            class does not take an argument. Nothing is changed then.
        """
        given = {
            "policy": policy, "policy_options": policy_options, "awareness": awareness, "team": team,
            "sensing_range": sensing_range, "awareness_range": awareness_range, "range_shape": range_shape,
            "speed": speed, "turn_limit": turn_limit, "placement": placement, "position": position, "heading": heading,
            "cycle": cycle, "radius": radius, "drive": drive, "lidar": lidar, "name": name,
        }  # fmt: skip
        return self._host.add(agent_class, count, given, arguments)

    def senses(
        self,
        observers: Group,
        observed: Group,
        *,
        as_: str = "targets",
        sensor: Sensor | None = None,
        counts: bool | None = None,
    ) -> None:
        """Let one group sense another.

        Parameters
        ----------
        observers, observed : Group
            Groups of this world.
        as_ : str
            The channel, under which policies see them: ``percept.targets`` by default, and otherwise
            ``percept.channels.NAME``. Several groups can be sensed in one channel.
        sensor : Sensor, optional
            The sensor of the channel. By default all within the observers' sensing range are sensed, unless an obstacle
            or a wall blocks the line of sight. See also `Group.sensors`.
        counts : bool, optional
            Whether what is sensed counts in `observed_fraction`; by default that of the channel "targets" of groups on
            a team.

        Raises
        ------
        TypeError, ValueError
            If a group is of another world, the name cannot be an attribute, or the sensor or `counts` differ from those
            of the same channel.
        """
        self._host.declare((observers, observed), as_, sensor, counts)

    def interact(self, interaction: Rule, /, **groups: Group) -> Rule:
        """Let something happen between the bodies of some groups, in each step after all have moved.

        Parameters
        ----------
        interaction : Interaction
            What happens, such as a capture.
        **groups : Group
            The group of each role.

        Returns
        -------
        Interaction
            The same object, for `adjust`.

        Raises
        ------
        TypeError, ValueError
            If a role has no group, a group two roles, or a score the name of another. Nothing is changed then.
        """
        from teamsight.agents.engine.interactions import interact

        interact(self._data, self._engine, interaction, groups)
        return interaction

    def __repr__(self) -> str:
        data = vars(self).get("_data")
        if data is None:
            return f"<{type(self).__name__}, not built>"
        groups = "".join(f", {len(one):,} {one.name}{note_of_inactive(one.bodies.active)}" for one in data.groups)
        return f"<{type(self).__name__}: tick {data.timeline.tick:,}, seed {data.seed}, {data.arena}{groups}>"

    def _repr_html_(self) -> str | None:
        from teamsight.agents.drawing import world_html

        return shown(lambda: world_html(type(self).__name__, self._data, self._engine))

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError("a World holds a clock and compiled records, which cannot be copied; use state() and restore()")

    _states: StateKeeper

    def step(self) -> None:
        """Make one step, unless an event before it stops the model."""
        self._stepper.step()

    def run(self, steps: int, *, progress: bool = True) -> None:
        """Make `steps` steps, in one compiled call unless something needs Python in between.

        It stops early when `running` becomes False, and warns if it was False before. After two seconds, a terminal or
        a notebook shows how far it is, unless `progress` is False.
        """
        self._stepper.run(steps, progress=progress)

    @overload
    def adjust(self, group: Group, **settings: Unpack[Changes]) -> None: ...
    @overload
    def adjust(self, group: Interaction, **settings: float | str) -> None: ...
    def adjust(self, group: Group | Interaction, **settings: object) -> None:
        """Change a group or an interaction from the next step on; what is not given stays.

        A new policy starts with a new state.

        Parameters
        ----------
        group : Group or Interaction
            A group of this world; or an interaction that is a dataclass: one of `interactions`, or what `interact` has
            returned, which keeps the values that were declared.
        **settings
            Of a group `Changes`: policy, policy_options, awareness, sensing_range, awareness_range, speed, turn_limit
            and cycle, as for `add`; a cycle begins at the present tick, and actions on their way take effect when they
            were to. Of an interaction its fields: `reset` goes back to those that were declared, `restore` to those
            that were saved.

        Raises
        ------
        TypeError, ValueError
            As for `add` and `interact`; also if more than constants of the kernel of an interaction would change: what
            it declares, or the state in which a run begins. Nothing is changed then.
        """
        if isinstance(group, Interaction):
            from teamsight.agents.engine.interactions import adjust_interaction

            adjust_interaction(self._data, group, settings)
        else:
            self._host.adjust(group, settings)

    def record(
        self,
        file: str | os.PathLike[str] | None = None,
        *,
        steps: int | None = None,
        every: int = 1,
        title: str | None = None,
        force: bool = False,
    ) -> WorldReplay:
        """Record the run from now on, to watch it in any browser, or as a film or a picture.

        ::

            world.record("run.html", steps=600)         # makes the run

            with world.record("run.html"):              # or records what the block does
                world.run(600)

            replay = world.record()                     # or without a file
            world.run(600)
            replay.stop().save("run.gif")

        Parameters
        ----------
        file : path, optional
            The file to write: ``.html``, ``.gif``, ``.mp4`` or ``.png``. It is written when the recording stops: by
            `Replay.stop`, at the end of the block, by `close`, or when the program ends. A file that is there is
            replaced only if teamsight has written it as a recording.
        steps : int, optional
            Make so many steps, and stop.
        every : int
            Ticks from one frame to the next; the present is recorded too.
        title : str, optional
            What is recorded, for people; by default the class of the world, the policy and the seed.
        force : bool
            Replace any regular file.

        Returns
        -------
        Replay
            What is recorded. It grows with the run, and notebooks show it. A reset begins it anew; after a state is
            restored, the frames that follow it are dropped.

        Raises
        ------
        TypeError, ValueError
            If the world has no agents, the ending of the file is unknown, the file cannot be written or must not be
            replaced, or a value has the wrong type or is outside its limits. Nothing is changed then.
        ImportError
            For ``.mp4``, if imageio-ffmpeg is not installed.
        """
        from teamsight.agents.recording.world_replay import WorldReplay

        if steps is not None:
            checks.count("steps", steps, least=0)
        replay = WorldReplay(
            self._data, self._engine, type(self).__name__, file=file, every=every, title=title, force=force
        )
        if steps is not None:
            with replay:
                self.run(steps)
        return replay

    def state(self, *, pending: Literal["keep", "drop"] = "keep") -> State:
        """Return a copy of all that changes in a run; `restore` goes back to it. It can be pickled.

        It holds the event sources, the event log, and the planned calls of sources and of methods of the world and its
        agents. Other functions, and processes, which are running generators, cannot be saved.

        Parameters
        ----------
        pending : {"keep", "drop"}
            Whether planned functions and processes are an error, or are left out.

        Raises
        ------
        TypeError
            If there are any, and `pending` is "keep".
        """
        return self._states.save(pending)

    def restore(self, saved: State) -> None:
        """Go back to a saved state of this world, or of one that was built in the same way.

        Columns that were added after the state was saved keep their values.

        Raises
        ------
        TypeError, ValueError
            If `saved` is not a state, or is that of a world with another arena, other groups, policies or cycles.
            Nothing is changed then.
        """
        self._states.restore(saved)

    def reset(self, rng: SeedLike = None) -> None:
        """Start again: place all remaining agents anew and set the clock to 0, without events.

        Speeds, turning limits and ranges are those with which the groups were added. Policies, degrees of awareness and
        columns stay. `rng` is the seed, as for `World`; by default the present one.
        """
        self._states.reset(rng)

    def _begin(self, seed: int, start: Starts, run: int, states: FirstStates) -> None:
        """Begin a run in the existing arrays; see `StateKeeper.begin`."""
        self._states.begin(seed, start, run, states, is_kept=True)

    def close(self) -> None:
        """Stop the model for good; recordings stop and are written."""
        self.running = False
        self._stepper.is_closed = True
        for watcher in list(self._data.watchers):
            watcher.close()

    _stepper: Stepper

    # Type checkers would take every attribute to exist.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if "_states" not in vars(self):
                what = f"{type(self).__name__}.__init__ uses {name!r} of a world that is not made"
                raise AttributeError(f"{what}; call super().__init__(arena, rng=rng), which makes it, first")
            # The error as it was: properties may have raised one of their own.
            return super().__getattribute__(name)

    @property
    def contact(self) -> Contact:
        """What happens when bodies that have a radius meet."""
        return self._data.contact

    @property
    def arena(self) -> Arena:
        """The arena. Its obstacles can be changed in a run; a reset goes back to those with which it was built.

        ``world.arena = world.arena.with_obstacles(Circle((1, 0), 0.5))`` adds one. No body may be in one. What senses,
        moves or meets walls takes the new ones from the next step on. A recording shows the last ones.
        """
        return self._data.arena

    @arena.setter
    def arena(self, value: Arena) -> None:
        self._host.change_obstacles(value)

    @property
    def seed_used(self) -> int:
        """The seed. `reset` can set another."""
        return self._data.seed

    @property
    def tick(self) -> int:
        """The number of completed steps."""
        return self._data.timeline.tick

    @property
    def path(self) -> str:
        """How `run` makes its steps now: ``"compiled"``, or ``"step by step: "`` and the reason.

        The results are the same to the last bit; compiled steps take less time. With mesa's own events pending, single
        steps are made too.
        """
        reason = self._stepper.needs_python()
        return f"step by step: {reason}" if reason else "compiled"

    @property
    def observed(self) -> float:
        """The fraction of targets that at least one robot senses now, in [0, 1]."""
        return self._engine.present("observed")

    @property
    def observed_fraction(self) -> float:
        """The mean over the completed steps of the fraction of targets that at least one robot senses, in [0, 1]."""
        return self._data.history.sums.observed.mean_share

    @property
    def mean_degree(self) -> float:
        """The mean number of neighbours of a robot now: of robots within its awareness range."""
        return self._engine.present("mean_degree")

    @property
    def mean_neighbours(self) -> float:
        """The mean over robots and completed steps of the number of neighbours; `mean_degree` is the present one."""
        return self._data.history.sums.edges.mean_share

    @property
    def max_neighbours(self) -> int:
        """The largest number of robots within any robot's awareness range in the completed steps."""
        return self._data.history.sums.largest

    @property
    def teammates(self) -> Teammates:
        """The agents that are on a team now, in the order of groups; `neighbours` refers to their rows."""
        return teammates(self._data.groups)

    @property
    def neighbours(self) -> NeighbourList:
        """The present neighbours of each of `teammates`, by row: agents of its team within its awareness range."""
        self._engine.prepare()
        return neighbours(self._data.groups)

    @property
    def groups(self) -> tuple[Group[Body], ...]:
        """The groups, in the order in which they were added; `World.add` adds one."""
        return tuple(self._data.groups)

    @property
    def interactions(self) -> tuple[Interaction, ...]:
        """What happens between bodies in each step, in this order, as it is now; `World.interact` adds to it."""
        return tuple(placed.interaction for placed in self._data.interactions)

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
