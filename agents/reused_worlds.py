"""Reused worlds: runs that differ only in their seed, or in numbers that can be rewritten, use one built world."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from itertools import islice, takewhile
from typing import Any

import numpy as np

from teamsight.agents.cmommt import CMOMMT, DEFAULTS, REWRITTEN
from teamsight.agents.decisions import EVERY_STEP
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.presets import PRESETS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.world.noise import key_of
from teamsight.world.placement import Starts

# Seeds whose starts are computed in one call: more would not be faster, and cost memory in large worlds.
_STARTS_PER_CALL = 64


class ReusedWorlds:
    """Begins one run after the other, reusing the last built world if possible.

    A run in a reused world gives the same bits as one in a new world. A world is reused if only the seed differs, and
    of `CMOMMT` also what is declared as rewritten; if its class and all its components are this package's own; and if
    nothing was added to it. A class of one's own may do in its constructor what `World.reset` does not repeat.
    """

    def __init__(self) -> None:
        self._world: World | None = None
        self._built: _Built | None = None
        self._expected: deque[tuple[Mapping[str, Any], int]] = deque()

    def expect(self, runs: Iterable[tuple[Mapping[str, Any], int]]) -> None:
        """Announce the parameters and seeds of the coming runs, so that the starts of many are computed in one call.

        Other runs may come all the same.
        """
        self._expected = deque(runs)

    def begin(self, model: Callable[..., World], parameters: Mapping[str, Any], seed: int) -> World:
        """Return a world before its first step; it is valid until the next one is begun.

        Parameters
        ----------
        model : callable
            A class or function that is called as ``model(**parameters, rng=seed)``.
        parameters : mapping
            Its keyword parameters.
        seed : int
            The seed of the run.

        Raises
        ------
        TypeError, ValueError
            As for the model.
        """
        if self._expected and self._expected[0][1] == seed:
            self._expected.popleft()
        if self._built is not None and self._built.begin(model, parameters, seed, self._expected):
            return self._built.world
        self.close()
        self._world = world = model(**parameters, rng=seed)
        if type(world) is model and model.__module__.startswith("teamsight.") and world._data.is_rewritable:
            self._built = _Built(world, parameters)
        return world

    def rest(self) -> None:
        """Close the present world, unless a later run can use it as it is. Idempotent."""
        if self._built is None or not self._built.is_unchanged:
            self.close()

    def close(self) -> None:
        """Close the present world. Idempotent."""
        # A model may have returned something that cannot be closed, which the caller refuses.
        close = getattr(self._world, "close", None)
        if callable(close):
            close()
        self._world = self._built = None


class _Built:
    """A world and the parameters with which it was built."""

    def __init__(self, world: World, parameters: Mapping[str, Any]) -> None:
        self.world = world
        self._collector = world.recording.collector
        self._has_begun = self._collector.has_begun
        # The trace is that of a world that is ready to run.
        world._engine.prepare()
        self._numbers, kind = self._divided(parameters)
        # Mappings are copied, because their owner may change them.
        self._kind = {name: dict(value) if isinstance(value, dict) else value for name, value in kind.items()}
        self._trace, self._names, self._settings = _trace(world), {*vars(world)}, _settings(world)
        # The identity of an object is in the trace, and is its own as long as the object lives.
        self._alive = [group.rules for group in world.groups], *_attached(world)
        self._states = world._data.first_states()
        self._start: Starts | None = None
        self._runs: dict[int, int] = {}

    @property
    def is_unchanged(self) -> bool:
        """Whether nothing was added to the world, removed or replaced since it was built."""
        world = self.world
        is_whole = _trace(world) == self._trace and vars(world).keys() <= self._names
        return is_whole and _settings(world) == self._settings

    def begin(
        self,
        model: Callable[..., World],
        parameters: Mapping[str, Any],
        seed: int,
        expected: Iterable[tuple[Mapping[str, Any], int]],
    ) -> bool:
        """Begin a run in this world if possible; return whether it was."""
        world = self.world
        if model is not type(world) or not self.is_unchanged:
            return False
        numbers, kind = self._divided(parameters)
        if not _are_same(kind, self._kind):
            return False
        if isinstance(world, CMOMMT) and not _are_same(numbers, self._numbers):
            chosen = PRESETS.get(parameters.get("preset", ""), {})
            plan = {**DEFAULTS, **chosen, **parameters}
            world._take_numbers({name: plan[name] for name in REWRITTEN})
            self._numbers, self._runs, self._settings = numbers, {}, _settings(world)
        following = (each for _, each in takewhile(lambda run: _are_same(run[0], parameters), expected))
        run = self._run_of(checks.seed(seed, None), following)
        assert self._start is not None
        # The last run is no longer valid, so its history's memory can be reused.
        world._engine.stretch.steps.cut(0)
        world._begin(seed, self._start, run, self._states)
        world.recording.collector = self._collector.emptied()
        world._stepper.warned.clear()
        if self._has_begun:
            world._stepper.begin_to_collect()
        return True

    def _divided(self, parameters: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the parameters that can be rewritten in the built world, and the others."""
        rewritten = REWRITTEN if isinstance(self.world, CMOMMT) else frozenset()
        numbers = {name: value for name, value in parameters.items() if name in rewritten}
        return numbers, {name: value for name, value in parameters.items() if name not in rewritten}

    def _run_of(self, seed: int, following: Iterable[int]) -> int:
        """Return the index of a seed among the computed starts, computing more if it is not there."""
        if seed not in self._runs:
            seeds = list(dict.fromkeys([seed, *islice(following, _STARTS_PER_CALL - 1)]))
            self._start = self.world._data.start_of(np.array([key_of(each) for each in seeds]))
            self._runs = {each: run for run, each in enumerate(seeds)}
        return self._runs[seed]


def _settings(world: World) -> dict[str, Any]:
    """Return a copy of the settings of a `CMOMMT`; other worlds have none."""
    return {**world.settings} if isinstance(world, CMOMMT) else {}


def _trace(world: World) -> tuple[Any, ...]:
    """Return a value that changes when something is added to a world, removed or replaced."""
    groups = [
        (
            id(group), *map(id, group.rules), len(group), group.members_so_far, len(group.bodies.fields),
            sum(map(len, map(vars, group._agents))), len(group.others),
            group.timetable.first_cycle if group.timetable else EVERY_STEP,
        )
        for group in world.groups
    ]  # fmt: skip
    recording = world.recording
    mesas = len(world.agents), id(vars(world).get("step")), mesa_compat.has_events(world)
    attached = [*map(id, _attached(world))]
    has_first_arena = world._data.arena is world._data.first_arena
    return (
        groups, len(recording.callbacks), type(recording.collector), world._engine.extras, mesas, attached,
        has_first_arena,
    )  # fmt: skip


def _attached(world: World) -> list[Any]:
    """Return what acts in a world beside its groups; recordings too, which would go on in the next run."""
    return [*world.sources, *world._data.watchers, *world._data.interactions]


def _are_same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two mappings certainly hold the same settings."""
    return one.keys() == other.keys() and all(_is_same(value, other[name]) for name, value in one.items())


def _is_same(one: Any, other: Any) -> bool:
    """Whether two settings are equal and cannot change."""
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return _are_same(one, other)
    if one is None or isinstance(one, (str, int, float)):
        return bool(one == other)
    # This package's policies, degrees of awareness and sensors are frozen; lists and arrays may change.
    return one is other and type(one).__module__.startswith("teamsight.")
