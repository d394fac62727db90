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
from teamsight.agents.teammates import of_team, teammates
from teamsight.analysis.delta import sector_occupancy
from teamsight.analysis.delta.by_group import GroupDegrees, note_sizes, with_maxima
from teamsight.analysis.delta.perceived import run_perceiving
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.delta.team_conditions import Conditions, conditions
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.teams import check_team, team_graph
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.world import World

#: Takes a seed, as ``rng``, as ``seed`` or as its first argument, and returns a model.
Factory = Callable[..., "World"]

# How many times in a run the bearings are sampled.
_SAMPLES = 10
# Bearings are sampled until they are known of so many robots and times.
_ENOUGH_SAMPLES = 500_000


class Degrees(NamedTuple):
    """Result of a run.

    ``met`` holds the conditions before and after the run, ``steps`` is the number of steps made, which is smaller if
    the model stopped, and ``groups`` what each group has met. ``largest_team`` is the size of the largest team at any
    sample. Without samples it is 0 and ``bearings`` is None.
    """

    max_neighbours: int
    met: frozenset[Conditions]
    steps: int
    groups: tuple[GroupDegrees, ...] = ()
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
        from teamsight.agents.world import World

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
    first = next(iter(parameters.values()), None)
    if isinstance(factory, type) and first is not None and first.default is not first.empty:
        raise TypeError(
            f"model={factory.__name__}: takes no seed: it has neither rng nor seed, and {first.name}={first.default!r} "
            "is another parameter; add rng=None to __init__ and pass it on: super().__init__(arena, rng=rng)"
        )
    return factory(seed)


@dataclass(frozen=True)
class CountDegrees:
    """Runs a world and returns its degrees; steps that the world has made before do not count.

    Parameters
    ----------
    team : str or None
        The only team that counts; all do for None.
    samples : int
        How many times the bearings are sampled, evenly over the run, which changes nothing in it.
    perceived : bool
        Count the neighbours of each robot only when it decides, which takes longer.
    """

    team: str | None = None
    samples: int = _SAMPLES
    perceived: bool = False

    def __call__(self, world: World, steps: int) -> Degrees:
        """Run the world and return its degrees."""
        before, first = conditions(world, self.team), world.tick
        sizes = dict[str, GroupDegrees]()
        note_sizes(sizes, world, self.team)
        made = len(world.recording.history) if first else 0
        ends = np.linspace(0, steps, min(max(self.samples, 1), steps) + 1).astype(int)
        samples, largest_team, at_decisions = [], 0, dict[tuple[str, str], int]()
        for stretch in np.diff(ends).tolist():
            # A model that has stopped itself makes no more steps, and would warn of it.
            if self.perceived:
                run_perceiving(world, stretch, self.team, at_decisions)
            elif world.running:
                world.run(stretch)
            note_sizes(sizes, world, self.team)
            if self.samples:
                groups = of_team(world.groups, self.team)
                members = teammates(groups)
                largest_team = max(largest_team, members.largest_team)
                active = np.concatenate([np.zeros(0, bool), *(group.active for group in groups)])
                # Robots without a heading are left out.
                heading = np.where(active[:, np.newaxis], members.heading, np.nan)
                samples.append(sector_occupancy.bearings(team_graph(world, self.team), heading))
        met = frozenset({before, conditions(world, self.team)})
        by_group = at_decisions if self.perceived else world.recording.max_neighbours_by_group(made)
        largest = max(at_decisions.values(), default=0)
        if not self.perceived:
            largest = world.recording.max_neighbours(self.team, made)
        bearings = sector_occupancy.gather(samples) if self.samples else None
        met_by = with_maxima(sizes, by_group, self.team)
        return Degrees(largest, met, world.tick - first, met_by, largest_team, bearings)


def degrees_of(planned: Sequence[Run], pool: WorkerPool | None, progress: Progress) -> list[Degrees]:
    """Return the degrees of runs that measure `CountDegrees`, those beyond enough samples without bearings.

    Which runs have bearings does not depend on the pool.
    """
    measure = planned[0].measure
    assert isinstance(measure, CountDegrees)
    found = [_first(planned[0], measure.team)]
    progress(1, len(planned))
    while len(found) < len(planned):
        done, samples = len(found), sum(one.samples for one in found)
        some = planned[done:]
        if samples < _ENOUGH_SAMPLES:
            some = some[: math.ceil((_ENOUGH_SAMPLES - samples) * done / max(samples, 1))]
        else:
            some = [replace(run, measure=replace(measure, samples=0)) for run in some]

        def show(cost: float, total: float, done: int = done, count: int = len(some)) -> None:
            progress(done + round(cost / total * count), len(planned))

        found += run_all(some, pool, progress=show)
    earlier = accumulate((one.samples for one in found[:-1]), initial=0)
    return [
        one if samples < _ENOUGH_SAMPLES else Degrees(one.max_neighbours, one.met, one.steps, one.groups)
        for one, samples in zip(found, earlier, strict=True)
    ]


def _first(run: Run, team: str | None) -> Degrees:
    """Make the first run in this process, where its errors keep their types and its kernels are compiled once."""
    with contextlib.closing(ReusedWorlds()) as worlds:
        world = run.begin(worlds)
        found: Degrees = run.measure(world, run.steps)
        if not (found.max_neighbours or found.largest_team or any(one.robots for one in found.met)):
            check_team(world, team, f"the world of seed {run.seed}")
    return found
