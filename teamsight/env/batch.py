"""Many worlds that make their steps together: what all kinds of environments are made of."""

from __future__ import annotations

import hashlib
import os
import weakref
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from itertools import pairwise
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
from teamsight.env.block import Block, BuiltWorld, stands_for_others
from teamsight.env.loop import (
    BATCH,
    DONE,
    FIND_BAD,
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
    """The arrays of all worlds into which is written what is shown of one of them; see `SightArrays`."""

    observations: npt.NDArray[np.float32]
    of_robots: Floats
    of_worlds: Floats
    world: int = 0

    def of(self, world: int) -> Shown:
        """Return that of another world."""
        return self._replace(world=world)


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
    """

    def __init__(self, settings: Settings) -> None:
        self._settings, self._worlds = settings, ReusedWorlds()
        self._world: World
        self.group: Group
        self.sight: Packed[SightArrays]
        self.quiet_until = 0
        self._robots: list[int] = []
        self._bound: tuple[Any, Any, int] | None = None
        self._is_shared = False
        # The tick and the row of the history of which Python knows.
        self._tick = self._row = 0

    def begin(self, seed: int) -> Observation:
        """Begin an episode, and return how observations are made; `show_in` comes before the first step."""
        self._is_shared, self._bound = False, None
        self._world, self.group = world, group = self._settings.begin(self._worlds, seed)
        self._robots = group.bodies.identity.tolist()
        self._tick = self._row = 0
        world._engine.prepare()
        team = [other for other in world.groups if group.team is not None and other.team == group.team]
        size, settings = sum(map(len, team)), self._settings
        self._observation = Observation(group, size, settings.layout, settings.encoding)
        return self._observation

    def can_stand_for_others(self) -> bool:
        """Whether its world, before the first step, can make the steps of other worlds of the same settings."""
        world = self._world
        # A model of the user's can return another world for each seed.
        if self._settings.is_kept or not stands_for_others(self):
            return False
        self.begin(0)
        return self._world is world

    def bind_to(self, shown: Shown) -> None:
        """Let these arrays be those in which the present and all that follows is shown."""
        self._shown = shown
        self._bind()

    def show_in(self, shown: Shown) -> None:
        """Show the present in these arrays, and all that follows."""
        self._shown = shown
        self._show()

    def world(self) -> World:
        """Return the world, up to date. From now on its steps are made in Python, since the user may change it."""
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

    def go_on(self, status: int, shown: Shown, steering: Floats | None = None) -> None:
        """Complete a step that compiled code could not make alone.

        Parameters
        ----------
        status : int
            What was done: `NEEDS_PYTHON`, since events are due, or a policy, an arena or a recorder needs it;
            `UNFINISHED` or `UNSEEN`, since a buffer is full, which is enlarged.
        shown : Shown
            The arrays in which it is shown.
        steering : ndarray, shape (robots, 3), float64, optional
            The actions, for `Steered`; needed for `NEEDS_PYTHON`.
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
        self.show_in(shown)

    def close(self) -> None:
        """Release the world. Idempotent."""
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
        engine, group, shown = self._world._engine, self.group, self._shown
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
        seen = self._observation.seen(sensing, shown.observations[shown.world])
        bodies = sum(map(len, self._world.groups))
        kept = targets.true_lists if targets else (np.zeros(len(group) + 1, np.int64), np.zeros(0, np.int64))
        arrays = SightArrays(
            binding.world, binding._group_records[self._world.groups.index(group)],
            records[id(targets)] if targets else None, records[id(teammates)] if teammates else None, team,
            np.array(roles, np.int64), observable, group.policy_state.floats,
            self._observation.perceive, sensing, group.perception.room, self._observation.show, seen,
            np.zeros((len(group), len(OF_ROBOTS))), shown.of_robots, shown.world, shown.of_worlds[shown.world],
            np.zeros_like(kept[0]), np.zeros_like(kept[1]), np.zeros(bodies, np.int64), np.zeros(bodies, np.int64),
            np.ones(1, np.int64), group.bodies.last_rewards,
        )  # fmt: skip
        if before and bodies == len(before.before) and len(arrays.kept_start) == len(before.kept_start):
            used = int(before.kept_start[-1])
            arrays.kept_start[:], arrays.before[:], arrays.is_new[:] = before.kept_start, before.before, before.is_new
            arrays.kept_index[:used] = before.kept_index[:used]
        return arrays


class Batch:
    """Worlds of the same settings.

    Each is a row of a `Block`, if nothing in it can need Python; else it has arrays of its own, at a `Place`.

    Parameters
    ----------
    settings : Settings
        What the worlds are.
    worlds : int
        Their number.
    threads : int
        How many threads make their steps.

    Attributes
    ----------
    robots, bodies : int
        The numbers of robots that are steered, and of bodies, of a world.
    observation : Observation
        How observations are made.
    observations : ndarray, shape (worlds, robots, width), float32
        What the robots perceive now; the next step overwrites it.
    facts : Facts
        What has happened in the last step.
    of_robots, of_worlds : ndarray, shape (facts, worlds, robots) and (worlds, facts), float64
        The same numbers, in the order of `OF_ROBOTS` and `OF_WORLDS`.
    cycles : ndarray, shape (worlds,), int64
        The number of steps of each episode so far.
    has_begun : ndarray, shape (worlds,), bool
        Whether an episode has begun.
    """

    def __init__(self, settings: Settings, worlds: int, threads: int = 1) -> None:
        self.settings = settings
        # One world says how many robots there are, and what they perceive.
        first = Place(settings)
        self.observation, self.robots = first.begin(0), len(first.group)
        self.bodies = sum(group.first_size for group in first.groups)
        self.observations = np.zeros((worlds, self.robots, self.observation.width), np.float32)
        self.of_robots = np.zeros((len(OF_ROBOTS), worlds, self.robots))
        self.of_worlds = np.zeros((worlds, len(OF_WORLDS)))
        self._shown = Shown(self.observations, self.of_robots, self.of_worlds)
        self._teammates = np.full((worlds, 1), float(self.observation.teammates))
        self.facts = Facts(self.of_robots, self.of_worlds, self._teammates)
        self.cycles, self.has_begun = np.zeros(worlds, np.int64), np.zeros(worlds, bool)
        # Whether there is a world to look at, also after an error.
        self._is_there = np.zeros(worlds, bool)
        self._given = np.zeros((worlds, self.robots, settings.form.none.size))
        self._steering = np.zeros((worlds, self.robots, 3))
        self._status, self._quiet_until = np.zeros(worlds, np.int64), np.zeros(worlds, np.int64)
        self._sights, self._next = np.zeros(worlds, np.int64), np.zeros(threads, np.int64)
        # The last seed that was given for each world, and the number of the episode since.
        self._seeds: list[tuple[int, int] | None] = [None] * worlds
        # The worlds whose last step was completed in Python.
        self._in_python: list[int] = []
        # The worlds with arrays of their own, and the places of all built ones.
        self._own: dict[int, Place] = {}
        self._places = [first]
        # mesa 3.3 would keep the worlds of an environment that is never closed.
        weakref.finalize(self, _close, self._places)
        edges = [worlds * number // threads for number in range(threads + 1)]
        self._parts = [slice(*edge) for edge in pairwise(edges)]
        self._block: Block | None = None
        if worlds > 1 and first.can_stand_for_others():
            self._block = Block(worlds, min(settings.max_cycles, _ROWS), first)
            for part in self._parts:
                place = first if part.start == 0 else self._new_place()
                place.begin(0)
                BuiltWorld(place, self._block, part, self._shown)
        else:
            self._own = {0: first} | {world: self._new_place() for world in range(1, worlds)}
        built: list[BuiltWorld | None] = [*self._block.built] if self._block else [None] * threads
        self._records = [
            BATCH.pack(BatchArrays(
                RUN, self._sights[part], one.record if one else None, settings.form.number, settings.form.table,
                self._given[part], self._steering[part], self._quiet_until[part], self._status[part],
                self._next[number : number + 1],
            ))
            for number, (part, one) in enumerate(zip(self._parts, built, strict=True))
        ]  # fmt: skip
        self._all = BATCH.pack(self._records[0].value._replace(
            sights=self._sights, given=self._given, steering=self._steering, quiet_until=self._quiet_until,
            status=self._status,
        ))  # fmt: skip
        self._pool: tuple[int, ThreadPoolExecutor] | None = None

    def _new_place(self) -> Place:
        place = Place(self.settings)
        self._places.append(place)
        return place

    def _next_seed(self, world: int, seed: int | None) -> int:
        """Return the seed of the next episode: `seed`, or one that derives from the last that was given."""
        last = self._seeds[world]
        if seed is not None or last is None:
            self._seeds[world] = checks.seed(None, seed), 0
        else:
            self._seeds[world] = last[0], last[1] + 1
        return self._seed(world)

    def _seed(self, world: int) -> int:
        return episode_seed(*(self._seeds[world] or (0, 0)))

    def _coming(self, world: int, part: slice) -> Iterator[int]:
        """Yield the seeds of the next episodes of a part of the worlds, of those after one first."""
        for other in [*range(world + 1, part.stop), *range(part.start, world)]:
            seed, episode = self._seeds[other] or (0, 0)
            yield episode_seed(seed, episode + 1)

    def _built_of(self, world: int) -> BuiltWorld:
        assert self._block is not None
        return next(one for one, part in zip(self._block.built, self._parts, strict=True) if world < part.stop)

    def reset(self, worlds: Sequence[int], seeds: Sequence[int | None]) -> None:
        """Begin an episode in some worlds.

        Parameters
        ----------
        worlds : sequence of int
            The worlds.
        seeds : sequence of int or None
            Their seeds; None continues the seeds of a world.

        Raises
        ------
        TypeError, ValueError
            If a seed is not a whole number of at least 0, or the model refuses its parameters.
        """
        # An array, which is used faster than a list as an index.
        chosen = np.asarray(worlds, np.int64)
        self.has_begun[chosen] = False
        following = {world: self._next_seed(world, seed) for world, seed in zip(worlds, seeds, strict=True)}
        if self._block is not None:
            for world in self._own.keys() & following.keys():
                place = self._own.pop(world)
                place.close()
                self._places.remove(place)
                self._sights[world] = 0
            for one, part in zip(self._block.built, self._parts, strict=True):
                here = {world: seed for world, seed in following.items() if part.start <= world < part.stop}
                if here:
                    one.begin(here, self._coming(max(here), part))
        else:
            for world, seed in following.items():
                self._begin(world, seed)
        self.cycles[chosen], self.has_begun[chosen], self._is_there[chosen] = 0, True, True

    def _begin(self, world: int, seed: int) -> None:
        """Begin an episode in a world with arrays of its own."""
        place = self._own[world]
        self.observation = observation = place.begin(seed)
        robots, width = len(place.group), observation.width
        if (robots, width) != self.observations.shape[1:]:
            raise ValueError(
                f"model: returned a world with {robots} robots and observations of {width} numbers, and the first "
                f"had {self.robots} and {self.observations.shape[2]}; return the same for all seeds"
            )
        place.show_in(self._shown.of(world))
        self._teammates[world] = observation.teammates
        self._note(world)

    def _note(self, world: int) -> None:
        """Note where the arrays of a world with its own are now."""
        place = self._own[world]
        self._sights[world], self._quiet_until[world] = place.sight.address, place.quiet_until

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
            for world in np.flatnonzero(self.has_begun).tolist():
                if self._own[world].has_changed:
                    self._quiet_until[world] = 0
        self._status[:] = DONE if waits is None else waits
        if bad := FIND_BAD(self._all):
            raise form.refusal(self._given, bad - 1, names)
        if self._block is not None and self._block.is_full(self.cycles):
            self._block.make_steps(self.settings.max_cycles)
        try:
            self._step_all()
        except BaseException:
            # Some worlds are a step ahead of others now, or between two steps.
            self.has_begun[:] = False
            raise
        if is_kept:
            for one in self._own.values():
                one.sync()
        self.cycles += 1 if waits is None else ~waits

    def _step_all(self) -> None:
        """Let each thread step its part of the worlds, then complete what needs Python."""
        self._next[:] = 0
        with deferred():
            stopped = [STEP_ALL(self._records[0])] if len(self._records) == 1 else self._in_threads()
            for number, result in enumerate(stopped):
                while result > 0:
                    world = result - 1 + self._parts[number].start
                    self._built_of(world).go_on(world, int(self._status[world]))
                    self._status[world] = DONE
                    result = stopped[number] = STEP_ALL(self._records[number])
        self._in_python = np.flatnonzero(self._status > WAITS).tolist() if min(stopped) < 0 else []
        for world in self._in_python:
            try:
                self._own[world].go_on(int(self._status[world]), self._shown.of(world), self._steering[world])
            except Exception as error:
                if len(self.cycles) > 1:
                    error.add_note(f"teamsight.env: in world {world}")
                raise
            self._note(world)

    def _in_threads(self) -> list[int]:
        """Let each thread step its part, and return what `STEP_ALL` has returned in each."""
        others = [self._threads.submit(STEP_ALL, record) for record in self._records[1:]]
        try:
            first = STEP_ALL(self._records[0])
        finally:
            # Nothing is touched before all threads are done.
            wait(others)
        return [first, *(other.result() for other in others)]

    @property
    def _threads(self) -> ThreadPoolExecutor:
        """The threads beside that of the caller; those of a process are not there in one that was forked from it."""
        if self._pool is None or self._pool[0] != os.getpid():
            self._pool = os.getpid(), ThreadPoolExecutor(len(self._parts) - 1, "teamsight.env")
        return self._pool[1]

    @property
    def rewards(self) -> Floats:
        """The rewards of the last step, shape (worlds, robots)."""
        return rewards_of(self.settings.reward, self.facts)

    @property
    def are_stopped(self) -> npt.NDArray[np.bool_]:
        """Whether something has stopped each world, shape (worlds,)."""
        # Only Python can stop a world, so the others need not be asked.
        stopped = np.zeros(len(self.cycles), bool)
        for world in self._in_python:
            stopped[world] = not self._own[world]._world.running
        return stopped

    def begun(self, world: int, what: str) -> Place:
        """Return a built world with the episode of a world, to look at before the next step.

        `what` names in an error what was called without an episode.
        """
        if not self.has_begun[world]:
            raise RuntimeError(f"{what}: no episode has begun; call reset() first")
        return self._own[world] if world in self._own else self._built_of(world).look(world)

    def world(self, world: int) -> World:
        """Return a world; from now on its steps are made in Python, until it is reset.

        Raises
        ------
        RuntimeError
            Before `reset`, and after `close`. After an error the world can be looked at.
        """
        if not self._is_there[world]:
            raise RuntimeError("world: no episode has begun; call reset() first")
        if world not in self._own:
            self._own[world] = place = self._new_place()
            place.begin(self._seed(world))
            self._built_of(world).put_into(place, world)
        made = self._own[world].world()
        self._note(world)
        return made

    def close(self) -> None:
        """Release the worlds. Idempotent."""
        self.has_begun[:] = self._is_there[:] = False
        _close(self._places)
        if self._pool is not None:
            self._pool[1].shutdown()
            self._pool = None


def _close(places: list[Place]) -> None:
    for one in places:
        one.close()
