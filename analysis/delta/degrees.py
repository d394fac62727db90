"""Degrees in runs: the largest number of neighbours of any robot, samples of their bearings, and the conditions."""

from __future__ import annotations

import contextlib
import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.agents.teammates import are_all_sensed, of_team, teammates
from teamsight.analysis.delta import closed_form, sector_occupancy
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.teams import check_team, team_graph
from teamsight.world.arena import Disc

if TYPE_CHECKING:
    from teamsight.agents.world import World

#: A note on reports.
SQUARE_RANGES = (
    "Ranges are squares: neighbours are at most the awareness range away along either axis, and up to √2 times as far."
)
# How many times in a run the bearings are sampled.
_SAMPLES = 10
# Bearings are sampled until they are known of so many robots and times.
_ENOUGH_SAMPLES = 500_000


class Conditions(NamedTuple):
    """The conditions in one world at one time.

    ``robots`` is the size of the largest team, ``teams`` the number of teams with robots. ``awareness_range`` is None
    if robots differ, ``radius`` if the arena is not a disc. ``speed`` is the root mean square over robots.
    ``is_sensed`` is False if a sensor in order or an obstacle may hide teammates within the range, ``is_reliable`` if a
    robot has been inactive or one of its sensors out of order, ``are_discs`` if the ranges of some are squares.
    """

    robots: int
    teams: int
    awareness_range: float | None
    radius: float | None
    speed: float
    is_sensed: bool = True
    is_reliable: bool = True
    are_discs: bool = True


def conditions(world: World, team: str | None = None) -> Conditions:
    """Return the present conditions of a world.

    Parameters
    ----------
    world : World
        The world.
    team : str, optional
        The only team that counts; by default all do.
    """
    groups = of_team(world.groups, team)
    members = teammates(groups)
    reach = members.awareness_range
    return Conditions(
        robots=members.largest_team,
        teams=int(np.count_nonzero(members.sizes)),
        awareness_range=float(reach[0]) if len(reach) and reach.min() == reach.max() else None,
        radius=world.arena.radius if isinstance(world.arena, Disc) else None,
        speed=float(np.sqrt(np.mean(np.square(members.speed)))) if len(members.speed) else 0.0,
        is_sensed=are_all_sensed(groups, world.arena),
        is_reliable=not any(group.has_conditions for group in groups),
        are_discs=all(group.range_shape == "disc" for group in groups),
    )


def predict(met: set[Conditions], size: int, steps: int) -> Prediction | None:
    """Return the closed form for one run, or None if it does not apply.

    Parameters
    ----------
    met : set of Conditions
        Conditions before and after each run.
    size : int
        Size of the largest team.
    steps : int
        T, the length of a run.

    Notes
    -----
    The closed form is for one constant team in a disc, with discs for ranges and without failures, so all
    conditions must be equal.
    """
    if len(met) > 1:
        return None
    (same,) = met
    if not same.is_reliable or not same.are_discs or (same.robots, same.teams) != (size, 1):
        return None
    if same.radius is None or same.awareness_range is None:
        return None
    return closed_form.predict(size, same.radius, steps=steps, awareness_range=same.awareness_range, speed=same.speed)


def notes(met: Iterable[Conditions], size: int) -> list[str]:
    """Return notes on the conditions of a simulation.

    Parameters
    ----------
    met : iterable of Conditions
        Conditions before and after each run.
    size : int
        Size of the largest team, N.
    """
    met = list(met)
    said = {
        f"There are several teams: only teammates are neighbours, and N = {size} is the largest team; give team to "
        "choose δ for one of them.": any(one.teams > 1 for one in met),
        f"The number of robots changes: N = {size} is the largest number in one team at any time.": any(
            one.robots != size for one in met
        ),
        "Robots fail, or their sensors do: a robot has neighbours while it is active and its sensor for teammates is "
        "in order, and only active robots are neighbours. N counts all.": not all(one.is_reliable for one in met),
        SQUARE_RANGES: not all(one.are_discs for one in met),
        "Neighbours are teammates within the awareness range, also those that a sensor in order misses or an obstacle "
        "hides: the number that a robot really senses is at most as large.": not all(one.is_sensed for one in met),
    }
    return [text for text, holds in said.items() if holds]


class GroupDegrees(NamedTuple):
    """Of one group in a run: its team, the largest size of that, and the largest number of neighbours of its robots."""

    group: str
    team: str
    robots: int
    max_neighbours: int


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
        team, before, first = self.team, conditions(world, self.team), world.tick
        sizes: dict[str, tuple[str, int]] = {}
        _note_sizes(sizes, world, team)
        made = len(world.recording.history) if first else 0
        ends = np.linspace(0, steps, min(max(self.samples, 1), steps) + 1).astype(int)
        samples, largest_team, maxima = [], 0, dict[tuple[str, str], int]()
        for stretch in np.diff(ends).tolist():
            # A model that has stopped itself makes no more steps, and would warn of it.
            if self.perceived:
                _run_perceiving(world, stretch, team, maxima)
            elif world.running:
                world.run(stretch)
            _note_sizes(sizes, world, team)
            if self.samples:
                groups = of_team(world.groups, team)
                members = teammates(groups)
                largest_team = max(largest_team, members.largest_team)
                active = np.concatenate([np.zeros(0, bool), *(group.active for group in groups)])
                # Robots without a heading are left out.
                heading = np.where(active[:, np.newaxis], members.heading, np.nan)
                samples.append(sector_occupancy.bearings(team_graph(world, team), heading))
        largest = max(maxima.values(), default=0)
        if not self.perceived:
            maxima = dict(world.recording.max_neighbours_by_group(made))
            largest = world.recording.max_neighbours(team, made)
        # A group that has come and left between two counts is in the maxima only.
        found = {name: (of, 0) for name, of in maxima if team in (None, of)} | sizes
        by_group = (GroupDegrees(name, of, size, maxima.get((name, of), 0)) for name, (of, size) in found.items())
        bearings = sector_occupancy.gather(samples) if self.samples else None
        met = frozenset({before, conditions(world, team)})
        return Degrees(largest, met, world.tick - first, tuple(by_group), largest_team, bearings)


def _note_sizes(sizes: dict[str, tuple[str, int]], world: World, team: str | None) -> None:
    """Add the present groups of a team, or of all, and raise the sizes of teams that have grown."""
    groups = of_team(world.groups, team)
    for group in groups:
        members = sum(len(other) for other in groups if other.team == group.team)
        sizes[group.name] = str(group.team), max(members, sizes.get(group.name, ("", 0))[1])


def _run_perceiving(world: World, steps: int, team: str | None, largest: dict[tuple[str, str], int]) -> None:
    """Run a world step by step; raise, for (group, team), the largest number of neighbours of a robot that decided.

    Neighbours are counted after all events that precede a step, in whatever order these were planned: robots perceive
    what there is then.
    """
    found: dict[tuple[str, str], tuple[np.ndarray[tuple[int], np.dtype[np.int64]], int]] = {}

    def count(model: World) -> None:
        degree, row = team_graph(model, team).degree, 0
        for group in of_team(model.groups, team):
            found[group.name, str(group.team)] = degree[row : row + len(group)].copy(), model.tick
            row += len(group)

    world.recording.before_steps.append(count)
    try:
        with warnings.catch_warnings():
            # Single steps of robots that sense rarely have no decision.
            warnings.filterwarnings("ignore", "none of .* decides before", UserWarning)
            for _ in range(steps):
                if not world.running:
                    return
                found.clear()
                world.run(1)
                for group in of_team(world.groups, team):
                    if (name := (group.name, str(group.team))) in found:
                        degree, tick = found[name]
                        most = int(degree[group.decided_at == tick].max(initial=0))
                        largest[name] = max(largest.get(name, 0), most)
    finally:
        world.recording.before_steps.remove(count)


def degrees_of(planned: Sequence[Run], pool: Executor | None, progress: Progress) -> list[Degrees]:
    """Return the degrees of runs that measure `CountDegrees`, those beyond enough samples without bearings.

    Which runs have bearings does not depend on the pool.
    """
    measure = planned[0].measure
    assert isinstance(measure, CountDegrees)
    # In this process, where errors keep their types and kernels are compiled once.
    with contextlib.closing(ReusedWorlds()) as worlds:
        world = planned[0].begin(worlds)
        found = [measure(world, planned[0].steps)]
        if not (found[0].max_neighbours or found[0].largest_team or any(one.robots for one in found[0].met)):
            check_team(world, measure.team, f"the world of seed {planned[0].seed}")
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
