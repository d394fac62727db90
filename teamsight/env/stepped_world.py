"""One world of an environment: it is stepped by compiled code, or by Python where that is needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.engine.relation import counted_groups
from teamsight.agents.group import Group
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.recording.recording import HistoryCollector, Rows
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.agents.world import World
from teamsight.core.interrupts import deferred
from teamsight.env.loop import SHOW
from teamsight.env.observations import Observation
from teamsight.env.records import DONE, SIGHT, UNFINISHED, SightArrays
from teamsight.env.settings import Settings
from teamsight.policies.steered import Steered
from teamsight.world.arena import Arena
from teamsight.world.motion import is_watched

if TYPE_CHECKING:
    from teamsight.core.kernel import Packed

Floats = npt.NDArray[np.float64]

# How many steps a history has room for before Python makes more.
_ROWS = 1024
# How often the buffers of a percept may grow; each time they grow by a quarter.
_MOST_GROWTH = 16


class Shown(NamedTuple):
    """The arrays of one world into which is written what is shown of it; see `SightArrays`."""

    observation: npt.NDArray[np.float32]
    of_robots: Floats
    of_world: Floats


class SteppedWorld:
    """One world after the other, each for an episode.

    Parameters
    ----------
    settings : Settings
        What the worlds are.

    Attributes
    ----------
    sight : Packed of SightArrays
        The record of the world.
    quiet_until : int
        The tick from which a step needs Python.
    is_shown : bool
        Whether there is a world, of an episode.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings, self._worlds = settings, ReusedWorlds()
        self._world: World
        self._group: Group
        self.sight: Packed[SightArrays]
        self.quiet_until, self.is_shown = 0, False
        self._robots: list[int] = []
        self._bound: tuple[Any, Any, int] | None = None
        self._is_shared = False
        # The tick and the row of the history of which Python knows.
        self._tick = self._row = 0

    def begin(self, seed: int) -> tuple[World, Group]:
        """Begin an episode; `show_in` comes before the first step."""
        self._is_shared, self._bound, self.is_shown = False, None, False
        self._world, self._group = world, group = self._settings.begin(self._worlds, seed)
        self._robots = group.bodies.identity.tolist()
        self._tick = self._row = 0
        return world, group

    def observation(self) -> Observation:
        """Return how observations are made of the present world."""
        world, group = self._world, self._group
        world._engine.prepare()
        team = [other for other in world.groups if other.team == group.team] if group.team is not None else []
        return Observation(group, sum(map(len, team)), self._settings.layout)

    def show_in(self, shown: Shown, observation: Observation) -> None:
        """Show the start of an episode in these arrays, and all that follows."""
        self._shown, self._observation = shown, observation
        self._bind()
        self._show()
        self.is_shown = True

    @property
    def world(self) -> World:
        """The world, up to date. From now on its steps are made in Python, since the user may change it."""
        self.sync()
        self._is_shared, self.quiet_until = True, 0
        return self._world

    @property
    def arena(self) -> Arena:
        """The arena of the present world."""
        return self._world._data.arena

    @property
    def groups(self) -> dict[Group, int]:
        """The groups of the present world, the robots first, with the numbers of agents that they began with."""
        others = [group for group in self._world.groups if group is not self._group]
        return {group: group.first_size for group in (self._group, *others)}

    @property
    def is_running(self) -> bool:
        """Whether nothing has stopped the world."""
        return bool(self._world.running)

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

    def step(self, steering: Floats) -> None:
        """Make a step in Python: events are due, or a policy, an arena or a recorder needs it.

        Parameters
        ----------
        steering : ndarray, shape (robots, 3), float64
            The actions, for `Steered`.
        """
        if not self._settings.is_kept:
            self.sync()
        self._check_robots()
        self._group.policy_state.floats[:, 0] = steering
        # mesa's wrapper, which counts the step.
        step: Any = self._world.step
        step()
        self._tick, self._row = self._world._data.timeline.tick, self._world._engine.stretch.rows
        self._bind()
        self._show()

    def finish(self, status: int) -> None:
        """Complete a step that compiled code has begun, enlarging the buffers that are full."""
        if status == UNFINISHED:
            self._world._engine._call(self._world._engine._binding.run)
        self._bind()
        self._show()

    def close(self) -> None:
        """Release the world. Idempotent."""
        self.is_shown = False
        self._worlds.close()

    def _check_robots(self) -> None:
        group = self._group
        if group.bodies.identity.tolist() != self._robots:
            raise RuntimeError(
                f"{group.name}: robots have come or left, and an environment has the same {len(self._robots)} in all "
                "episodes; let them fail instead, as by Failures(500, 50), or reset()"
            )
        if len(group.policies) > 1 or not isinstance(group.policy, Steered):
            raise RuntimeError(f"{group.name}: have another policy, so nothing steers them; reset() does so again")

    def _bind(self) -> None:
        """Bind the record to the present arrays, if they have changed."""
        world, engine = self._world, self._world._engine
        self._check_robots()
        world._stepper.begin_to_collect()
        engine._make_room(min(self._settings.max_cycles, _ROWS))
        present = engine._binding, self._group.perception.record, engine.fits
        # Neither records nor bindings are equal to others.
        if present != self._bound:
            before = self.sight.value if self._bound is not None else None
            self.sight = SIGHT.pack(self._sight(before))
            self._bound = present
        self._row = engine.stretch.rows
        self.quiet_until = 0 if self._needs_python() else self._next_event()

    def _next_event(self) -> int:
        data, steps = self._world._data, self._world._engine.stretch.steps
        tick = data.timeline.tick
        return int(tick + min(data.timeline.clock.ticks_until_event(tick), steps.room - len(steps)))

    def _needs_python(self) -> bool:
        world, data = self._world, self._world._data
        return bool(
            self._is_shared
            or world._stepper.needs_python()
            or data.watchers
            or data.timeline.events_end_steps
            or mesa_compat.has_events(world)
            or is_watched(data.arena)
        )

    def _sight(self, before: SightArrays | None) -> SightArrays:
        engine, group = self._world._engine, self._group
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
        return arrays if before is None else _continued(arrays, before)

    def _show(self) -> None:
        """Show the present in the arrays."""
        for _ in range(_MOST_GROWTH):
            if SHOW(self.sight) == DONE:
                return
            with deferred():
                self._world._engine.perceive(self._group)
            self._bind()
        raise ValueError(f"{self._group.awareness}: perceive asks for more room on every call; return what is needed")


def _continued(arrays: SightArrays, before: SightArrays) -> SightArrays:
    """Return a record that knows of the last step, if the bodies are the same."""
    if len(arrays.before) != len(before.before) or len(arrays.kept_start) != len(before.kept_start):
        return arrays
    used = int(before.kept_start[-1])
    arrays.kept_start[:], arrays.before[:], arrays.is_new[:] = before.kept_start, before.before, before.is_new
    arrays.kept_index[:used] = before.kept_index[:used]
    return arrays
