"""Many worlds that make their steps together: what all kinds of environments are made of."""

from __future__ import annotations

import hashlib
import weakref
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.engine.loop import RUN
from teamsight.agents.engine.relation import counted_groups
from teamsight.agents.group import Group
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.recording.recording import HistoryCollector, Rows
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.env.loop import (
    BATCH,
    DONE,
    NEEDS_PYTHON,
    SHOW,
    SIGHT,
    STEP_ALL,
    UNFINISHED,
    WAITS,
    BatchArrays,
    SightArrays,
)
from teamsight.env.observations import Observation
from teamsight.env.rewards import OF_ROBOTS, OF_WORLDS, Facts, rewards_of
from teamsight.env.settings import Settings
from teamsight.policies.steered import Steered
from teamsight.world.motion import is_watched

if TYPE_CHECKING:
    from teamsight.core.kernel import Packed

Floats = npt.NDArray[np.float64]
#: Numbers of each body in a state: x, y, heading x, heading y, and whether it is active.
PER_BODY = 5
# How many steps a history has room for before Python makes more.
_ROWS = 1024
# How often the buffers of a percept may grow; each time they grow by a quarter.
_MOST_GROWTH = 16


def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of an episode, which depends on no other world; that of episode 0 is `seed` itself."""
    if episode == 0:
        return seed
    digest = hashlib.blake2b(f"episode {seed} {episode}".encode(), digest_size=8).digest()
    return int.from_bytes(digest, "big") % checks.MOST_SEED


class Shown(NamedTuple):
    """The arrays of one world into which is written what is shown of it; see `SightArrays`."""

    observation: npt.NDArray[np.float32]
    of_robots: Floats
    of_world: Floats


class Place:
    """One world after the other, each for an episode; it is stepped by compiled code, or by Python where needed.

    Parameters
    ----------
    settings : Settings
        What the worlds are.

    Attributes
    ----------
    group : Group
        The robots of the present world that are steered.
    sight : Packed of SightArrays
        The record of the world.
    quiet_until : int
        The tick from which a step needs Python.
    is_shown : bool
        Whether there is a world, of an episode.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings, self._worlds = settings, ReusedWorlds()
        self._seed: int | None = None
        self._episode = 0
        self._world: World
        self.group: Group
        self.sight: Packed[SightArrays]
        self.quiet_until, self.is_shown = 0, False
        self._robots: list[int] = []
        self._bound: tuple[Any, Any, int] | None = None
        self._is_shared = False
        # The tick and the row of the history of which Python knows.
        self._tick = self._row = 0

    def next_seed(self, seed: int | None) -> int:
        """Return the seed of the next episode: `seed`, or one that derives from the last that was given."""
        if seed is not None or self._seed is None:
            self._seed, self._episode = checks.seed(None, seed), 0
        else:
            self._episode += 1
        return episode_seed(self._seed, self._episode)

    def begin(self, seed: int) -> Observation:
        """Begin an episode, and return how observations are made; `show_in` comes before the first step."""
        self._is_shared, self._bound, self.is_shown = False, None, False
        self._world, self.group = world, group = self._settings.begin(self._worlds, seed)
        self._robots = group.bodies.identity.tolist()
        self._tick = self._row = 0
        world._engine.prepare()
        team = [other for other in world.groups if group.team is not None and other.team == group.team]
        return Observation(group, sum(map(len, team)), self._settings.layout)

    def show_in(self, shown: Shown, observation: Observation) -> None:
        """Show the start of an episode in these arrays, and all that follows."""
        self._shown, self._observation = shown, observation
        self._show()
        self.is_shown = True

    def world(self) -> World:
        """Return the world, up to date. From now on its steps are made in Python, since the user may change it."""
        if not self.is_shown:
            raise RuntimeError("world: no episode has begun; call reset() first")
        self.sync()
        self._is_shared, self.quiet_until = True, 0
        return self._world

    @property
    def arena(self) -> Any:
        """The arena of the present world."""
        return self._world._data.arena

    @property
    def groups(self) -> list[Group]:
        """The groups of the present world, the robots first."""
        return [self.group, *(group for group in self._world.groups if group is not self.group)]

    def state(self, size: int) -> npt.NDArray[np.float32]:
        """Return the state of so many bodies, robots first: x and y in [−1, 1], heading, and 1 if it is active.

        Places are relative to the middle of the box around the arena, in halves of its longer side. Bodies that have
        left are 0, and those that came later are not shown.

        Returns
        -------
        ndarray, shape (bodies, 5), float32
        """
        low, high = np.asarray(self.arena.bounds, float)
        middle, half = (low + high) / 2, (high - low).max() / 2
        rows, at = np.zeros((size, PER_BODY), np.float32), 0
        for group in self.groups:
            bodies = group.bodies
            is_first = bodies.member < group.first_size
            here = at + bodies.member[is_first]
            rows[here, :2] = np.clip((bodies.position[is_first] - middle) / half, -1.0, 1.0)
            rows[here, 2:4] = np.clip(bodies.heading[is_first], -1.0, 1.0)
            rows[here, 4] = bodies.active[is_first]
            at += group.first_size
        return rows

    @property
    def has_changed(self) -> bool:
        """Whether a world that the user has was changed or stepped since the last step of the environment."""
        world, engine = self._world, self._world._engine
        return not (engine.is_bound and engine.is_seen and world.running and world._data.timeline.tick == self._tick)

    def sync(self) -> None:
        """Let Python know of the steps that compiled code has made."""
        world, engine = self._world, self._world._engine
        # Python makes all steps of a world that the user has asked for, and the user may make some too.
        if self._is_shared or self._bound is None:
            return
        engine._read_back()
        tick, rows = world._data.timeline.tick, engine.stretch.rows
        mesa_compat.count_steps(world, tick - self._tick)
        collector = world.recording.collector
        if rows > self._row and isinstance(collector, HistoryCollector):
            collector.collect_rows(Rows(engine.stretch, self._row, rows, tick, world._data.history.earlier))
        self._tick, self._row = tick, rows

    def go_on(self, status: int, steering: Floats) -> None:
        """Complete a step that compiled code could not make alone.

        Parameters
        ----------
        status : int
            What was done: `NEEDS_PYTHON`, since events are due, or a policy, an arena or a recorder needs it;
            `UNFINISHED` or `UNSEEN`, since a buffer is full, which is enlarged.
        steering : ndarray, shape (robots, 3), float64
            The actions, for `Steered`.
        """
        world, engine = self._world, self._world._engine
        if status == NEEDS_PYTHON:
            if not self._settings.is_kept:
                self.sync()
            self._check_robots()
            self.group.policy_state.floats[:, 0] = steering
            # mesa's wrapper, which counts the step.
            step: Any = world.step
            step()
            self._tick, self._row = world._data.timeline.tick, engine.stretch.rows
        elif status == UNFINISHED:
            engine._call(engine._binding.run)
        self._show()

    def close(self) -> None:
        """Release the world. Idempotent."""
        self.is_shown = False
        self._worlds.close()

    def _check_robots(self) -> None:
        group = self.group
        if group.bodies.identity.tolist() != self._robots:
            raise RuntimeError(
                f"{group.name}: robots have come or left, and an environment has the same {len(self._robots)} in all "
                "episodes; let them fail instead, as by Failures(500, 50), or reset()"
            )
        if len(group.policies) > 1 or not isinstance(group.policy, Steered):
            raise RuntimeError(f"{group.name}: have another policy, so nothing steers them; reset() does so again")

    def _show(self) -> None:
        """Show the present in the arrays."""
        for _ in range(_MOST_GROWTH):
            self._bind()
            if SHOW(self.sight) == DONE:
                return
            with deferred():
                self._world._engine.perceive(self.group)
        raise ValueError(f"{self.group.awareness}: perceive asks for more room on every call; return what is needed")

    def _bind(self) -> None:
        """Bind the record to the present arrays, if they have changed."""
        world, engine, data = self._world, self._world._engine, self._world._data
        self._check_robots()
        world._stepper.begin_to_collect()
        engine._make_room(min(self._settings.max_cycles, _ROWS))
        present = engine._binding, self.group.perception.record, engine.fits
        # Neither records nor bindings are equal to others.
        if present != self._bound:
            before = self.sight.value if self._bound is not None else None
            self.sight = SIGHT.pack(self._sight(before))
            self._bound = present
        self._row = engine.stretch.rows
        if (
            self._is_shared or world._stepper.needs_python() or data.watchers or data.timeline.events_end_steps
            or mesa_compat.has_events(world) or is_watched(data.arena)
        ):  # fmt: skip
            self.quiet_until = 0
        else:
            tick, steps = data.timeline.tick, engine.stretch.steps
            self.quiet_until = int(
                tick + min(data.timeline.clock.ticks_until_event(tick), steps.room - len(steps))
            )

    def _sight(self, before: SightArrays | None) -> SightArrays:
        """Return the record; it knows of the last step, if the bodies are those of the record before."""
        engine, group = self._world._engine, self.group
        binding, relations = engine._binding, engine.relations
        records = dict(zip(map(id, relations), binding._relation_records, strict=True))
        targets, teammates = (group.relations.get(name) for name in (TARGETS, TEAMMATES))
        team = [
            records[id(one)]
            for one in relations
            if one.name == TARGETS and (one.observers is group or (group.team and one.observers.team == group.team))
        ]
        observable = sum(len(group) for groups in counted_groups(relations) for group in groups)
        roles = [1 if one.counts else 2 * (one.name == TEAMMATES) for one in relations]
        sensing = group.perception.record
        seen = type(sensing)(sensing.record, self._observation.seen(sensing.value, self._shown.observation))
        bodies = sum(map(len, self._world.groups))
        kept = targets.true_lists if targets else (np.zeros(len(group) + 1, np.int64), np.zeros(0, np.int64))
        arrays = SightArrays(
            binding.world, binding._group_records[self._world.groups.index(group)],
            records[id(targets)] if targets else None, records[id(teammates)] if teammates else None, team,
            np.array(roles, np.int64), observable, group.policy_state.floats,
            self._observation.perceive, sensing, group.perception.room, self._observation.show, seen,
            self._shown.of_robots, self._shown.of_world,
            np.zeros_like(kept[0]), np.zeros_like(kept[1]), np.zeros(bodies, np.int64), np.zeros(bodies, np.int64),
            np.ones(1, np.int64), group.bodies.last_rewards,
        )  # fmt: skip
        if before and bodies == len(before.before) and len(arrays.kept_start) == len(before.kept_start):
            used = int(before.kept_start[-1])
            arrays.kept_start[:], arrays.before[:], arrays.is_new[:] = before.kept_start, before.before, before.is_new
            arrays.kept_index[:used] = before.kept_index[:used]
        return arrays


class Batch:
    """Worlds of the same settings, one after the other at each place.

    Parameters
    ----------
    settings : Settings
        What the worlds are.
    worlds : int
        Their number.

    Attributes
    ----------
    places : list of Place
        The places.
    robots, bodies : int
        The numbers of robots that are steered, and of bodies, of a world.
    observation : Observation
        How observations are made.
    observations : ndarray, shape (worlds, robots, width), float32
        What the robots perceive now; the next step overwrites it.
    facts : Facts
        What has happened in the last step.
    of_robots, of_worlds : ndarray, shape (worlds, robots, facts) and (worlds, facts), float64
        The same numbers, in the order of `OF_ROBOTS` and `OF_WORLDS`.
    cycles : ndarray, shape (worlds,), int64
        The number of steps of each episode so far.
    has_begun : ndarray, shape (worlds,), bool
        Whether an episode has begun.
    """

    def __init__(self, settings: Settings, worlds: int) -> None:
        self.settings = settings
        self.places = [Place(settings) for _ in range(worlds)]
        # One world says how many robots there are, and what they perceive.
        first = self.places[0]
        self.observation, self.robots = first.begin(0), len(first.group)
        self.bodies = sum(group.first_size for group in first.groups)
        self.observations = np.zeros((worlds, self.robots, self.observation.width), np.float32)
        self.of_robots = np.zeros((worlds, self.robots, len(OF_ROBOTS)))
        self.of_worlds = np.zeros((worlds, len(OF_WORLDS)))
        self._teammates = np.zeros((worlds, 1))
        self.facts = Facts(self.of_robots, self.of_worlds, self._teammates)
        self.cycles, self.has_begun = np.zeros(worlds, np.int64), np.zeros(worlds, bool)
        self._given = np.zeros((worlds, self.robots, settings.form.none.size))
        self._steering = np.zeros((worlds, self.robots, 3))
        self._status, self._quiet_until = np.zeros(worlds, np.int64), np.zeros(worlds, np.int64)
        # The worlds whose last step was completed in Python.
        self._in_python: list[int] = []
        self._record: Any = None
        # mesa 3.3 would keep the worlds of an environment that is never closed.
        weakref.finalize(self, _close, self.places)

    def reset(self, places: Sequence[int], seeds: Sequence[int | None]) -> None:
        """Begin an episode at some places.

        Parameters
        ----------
        places : sequence of int
            The worlds.
        seeds : sequence of int or None
            Their seeds; None continues the seeds of a place.

        Raises
        ------
        TypeError, ValueError
            If a seed is not a whole number of at least 0, or the model refuses its parameters.
        """
        self._record = None
        for place, given in zip(places, seeds, strict=True):
            self.has_begun[place] = False
            one = self.places[place]
            observation = one.begin(one.next_seed(given))
            robots, width = len(one.group), observation.width
            if robots != self.robots or width != self.observation.width:
                raise ValueError(
                    f"model: returned a world with {robots} robots and observations of {width} numbers, and the first "
                    f"had {self.robots} and {self.observation.width}; return the same for all seeds"
                )
            self.observation = observation
            one.show_in(Shown(self.observations[place], self.of_robots[place], self.of_worlds[place]), observation)
            self.cycles[place], self._teammates[place] = 0, observation.teammates
            self.has_begun[place], self._quiet_until[place] = True, one.quiet_until

    def step(self, actions: Any, waits: npt.NDArray[np.bool_] | None, names: Callable[[int, int], str]) -> None:
        """Make a step of all worlds but those that wait.

        Parameters
        ----------
        actions : array_like, shape (worlds, robots, …)
            See `ActionForm`.
        waits : ndarray, shape (worlds,), bool, optional
            The worlds that make no step; by default none.
        names : callable
            ``names(world, robot)`` returns the name of an action in errors.

        Raises
        ------
        RuntimeError
            If a world was not reset, or robots have come or left.
        TypeError, ValueError
            If an action is wrong; then no world has made a step. After any other error, all worlds must be reset.
        """
        form, is_kept = self.settings.form, self.settings.is_kept
        form.take(actions, self._given, names)
        ready = self.has_begun if waits is None else self.has_begun | waits
        if not ready.all():
            raise RuntimeError(f"step(): world {int(np.argmin(ready))} has not begun an episode; call reset() first")
        if is_kept:
            for place in np.flatnonzero(self.has_begun).tolist():
                if self.places[place].has_changed:
                    self._quiet_until[place] = 0
        if self._record is None:
            self._record = BATCH.pack(BatchArrays(
                RUN, [one.sight for one in self.places], form.number, form.table, self._given, self._steering,
                self._quiet_until, self._status,
            ))  # fmt: skip
        self._status[:] = DONE if waits is None else waits
        try:
            with deferred():
                result = STEP_ALL(self._record)
            self._in_python = np.flatnonzero(self._status > WAITS).tolist() if result < 0 else []
            for place in self._in_python:
                one = self.places[place]
                sight = one.sight
                try:
                    one.go_on(int(self._status[place]), self._steering[place])
                except Exception as error:
                    if len(self.places) > 1:
                        error.add_note(f"teamsight.env: in world {place}")
                    raise
                self._quiet_until[place] = one.quiet_until
                if one.sight is not sight:
                    self._record = None
        except BaseException:
            # Some worlds are a step ahead of others now, or between two steps.
            self.has_begun[:] = False
            raise
        if result > 0:
            raise form.refusal(self._given, result - 1, names)
        if is_kept:
            for one in self.places:
                one.sync()
        self.cycles += 1 if waits is None else ~waits

    @property
    def rewards(self) -> Floats:
        """The rewards of the last step, shape (worlds, robots)."""
        return rewards_of(self.settings.reward, self.facts)

    @property
    def are_stopped(self) -> npt.NDArray[np.bool_]:
        """Whether something has stopped each world, shape (worlds,)."""
        # Only Python can stop a world, so the others need not be asked.
        stopped = np.zeros(len(self.places), bool)
        for place in self._in_python:
            stopped[place] = not self.places[place]._world.running
        return stopped

    def begun(self, place: int, what: str) -> Place:
        """Return a place with an episode; `what` names in an error what was called without one."""
        if not self.has_begun[place]:
            raise RuntimeError(f"{what}: no episode has begun; call reset() first")
        return self.places[place]

    def world(self, place: int) -> World:
        """Return the world of a place; from now on its steps are made in Python, until it is reset.

        Raises
        ------
        RuntimeError
            Before `reset`, and after `close`. After an error the world can be looked at.
        """
        world = self.places[place].world()
        self._quiet_until[place] = 0
        return world

    def close(self) -> None:
        """Release the worlds. Idempotent."""
        self.has_begun[:] = False
        _close(self.places)


def _close(places: list[Place]) -> None:
    for one in places:
        one.close()
