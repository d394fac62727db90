"""Degrees in runs: the largest number of neighbours of any robot, and samples of the bearings of neighbours."""

from __future__ import annotations

import contextlib
import inspect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.delta import sector_occupancy
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.delta.team_conditions import Conditions, conditions
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.model import World

#: Takes a seed, as ``rng``, as ``seed`` or as its first argument, and returns a model.
Factory = Callable[..., "World"]

# How many times in a run the bearings are sampled.
_SAMPLES = 10
# Bearings are sampled until they are known of so many robots and times.
_ENOUGH_SAMPLES = 500_000


class Degrees(NamedTuple):
    """Result of a run.

    ``met`` holds the conditions before and after the run, ``steps`` is the number of steps made, which is smaller if
    the model stopped, and ``largest_team`` the size of the largest team at any sample. Without samples it is 0 and
    ``bearings`` is None.
    """

    max_neighbours: int
    met: frozenset[Conditions]
    steps: int
    largest_team: int = 0
    bearings: Bearings | None = None

    @property
    def samples(self) -> int:
        """Number of robots and times whose bearings were sampled."""
        return 0 if self.bearings is None else len(self.bearings.degree)


@dataclass(frozen=True)
class FromSeed:
    """A factory as a model of a `Run`."""

    factory: Factory

    def __call__(self, *, rng: int) -> World:
        """Return the world of a seed, after checking that it is one."""
        from teamsight.agents.model import World

        world: Any = _called_with(self.factory, rng)
        if not isinstance(world, World):
            raise TypeError(f"model({rng}) is {checks.shown(world)}: must be a World, such as CMOMMT(rng={rng})")
        return world


def _called_with(factory: Factory, seed: int) -> Any:
    """Call a class or function with a seed: as ``rng`` or ``seed`` if it has a parameter of that name."""
    try:
        parameters = inspect.signature(factory).parameters
    except (TypeError, ValueError):
        return factory(seed)
    for name in ("rng", "seed"):
        if name in parameters and parameters[name].kind is not inspect.Parameter.POSITIONAL_ONLY:
            return factory(**{name: seed})
    return factory(seed)


def degrees(world: World, steps: int) -> Degrees:
    """Run a world and return its degrees; steps that the world has made before do not count."""
    before, made, first = conditions(world), _steps_made(world), world.tick
    world.run(steps)
    return Degrees(_largest(world, made), frozenset({before, conditions(world)}), world.tick - first)


def degrees_with_bearings(world: World, steps: int) -> Degrees:
    """Run a world in stretches, which changes nothing in the run, and sample the bearings after each."""
    before, made, first = conditions(world), _steps_made(world), world.tick
    ends = np.linspace(0, steps, min(_SAMPLES, steps) + 1).astype(int)
    samples, largest_team = [], 0
    for stretch in np.diff(ends).tolist():
        world.run(stretch)
        members = world.teammates
        largest_team = max(largest_team, members.largest_team)
        samples.append(sector_occupancy.bearings(world.neighbours, members.heading))
    met = frozenset({before, conditions(world)})
    return Degrees(_largest(world, made), met, world.tick - first, largest_team, sector_occupancy.gather(samples))


def _steps_made(world: World) -> int:
    return len(world.recording.history) if world.tick else 0


def _largest(world: World, made: int) -> int:
    if not made:
        return int(world.max_neighbours)
    return int(world.recording.history["max_neighbours"].to_numpy()[made:].max(initial=0))


def degrees_of(planned: Sequence[Run], pool: WorkerPool | None, progress: Progress) -> list[Degrees]:
    """Return the degrees of runs that measure `degrees_with_bearings`, those beyond enough samples without bearings.

    Which runs have bearings does not depend on the pool.
    """
    found = [_first(planned[0])]
    progress(1, len(planned))
    while len(found) < len(planned):
        done, samples = len(found), sum(one.samples for one in found)
        some = planned[done:]
        if samples < _ENOUGH_SAMPLES:
            some = some[: math.ceil((_ENOUGH_SAMPLES - samples) * done / max(samples, 1))]
        else:
            some = [replace(run, measure=degrees) for run in some]

        def show(cost: float, total: float, done: int = done, count: int = len(some)) -> None:
            progress(done + round(cost / total * count), len(planned))

        found += run_all(some, pool, progress=show)
    earlier = accumulate((one.samples for one in found[:-1]), initial=0)
    return [
        one if samples < _ENOUGH_SAMPLES else Degrees(one.max_neighbours, one.met, one.steps)
        for one, samples in zip(found, earlier, strict=True)
    ]


def _first(run: Run) -> Degrees:
    """Make the first run in this process, where its errors keep their types and its kernels are compiled once."""
    with contextlib.closing(ReusedWorlds()) as worlds:
        found: Degrees = run.make(worlds)
        if not (found.max_neighbours or found.largest_team or any(one.robots for one in found.met)):
            raise ValueError(
                f"model={run.model or run.parameters!r}: no agent is on a team in the world of seed {run.seed}, so "
                "none has neighbours; add a group of Robot, or of an agent class with a team"
            )
    return found
