"""The experiments behind the paper's figures and claims, among them the learned teams of Fig. 11.

An experiment is built, explorations are made, and their modules are imported, only when a figure or a claim reads it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.experiment import Experiment, Request, Variant, make_tables
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import Progress
from teamsight.analysis.stats.paired import Interval, gain, interval_of, paired

if TYPE_CHECKING:
    from teamsight.policies.learner import Learner
    from teamsight.policies.memory import LazyMemory

#: Keyword parameters of CMOMMT.
Parameters: TypeAlias = Mapping[str, Any]
Cells: TypeAlias = tuple[tuple[int, float], ...]

#: Numbers of sectors δ of the figure "delta".
DELTAS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
#: Its worlds (robots, radius), from crowded to empty.
DELTA_CELLS: Cells = ((10, 2.0), (20, 3.0), (30, 2.0), (10, 4.0), (20, 5.0), (30, 4.0))
#: Explorations for each run of a cell: five runs give 25. Each exploration runs every cell once.
EXPLORATIONS = 5
# Parameters of a setting that change the world that is explored.
_WORLD = ("sensing_range", "awareness_range", "robot_speed", "target_speed", "uniform_target_speed", "target_policy")

_ALONE: Parameters = {"awareness": "none"}
_A_CMOMMT: Parameters = {"policy": "a-cmommt", "awareness": "pairwise"}
_HALF: Parameters = {"awareness_range": 0.5}
_WALK: Parameters = {"policy": "random-walk", **_ALONE}
_CENTROID: Parameters = {"policy": "centroid", **_ALONE}
_CROWDED: Cells = ((30, 3.0), (30, 5.0))
_LARGEST: Cells = ((30, 10.0),)
# Few targets pass few stationary robots in a run: with five runs the mean would be uncertain by 5 points.
_MORE = 10
# At least 40 runs where the noise of five would enter the statistic: a range, or a maximum over many cells.
_MANY = 8
# A probability of a few per cent.
_RARE = 80


class Reading(NamedTuple):
    """A way to read the paper's lazy learning.

    Attributes
    ----------
    name : str
        What the names of its two experiments begin with: "-cooperative" has all 32 inputs under ring awareness,
        "-collective" the robot's own 16 inputs of the same transitions without awareness.
    title : str
        In words.
    learner, reward : str
        Names of the learner and of the reward.
    alone : tuple of (str, value)
        Constants of the collective learner that differ from the defaults.
    """

    name: str
    title: str
    learner: str
    reward: str
    alone: tuple[tuple[str, Any], ...] = ()


#: As the paper describes it: the best action of the nearest situations (eq. 1), rewarded by the robot's own targets.
LITERAL = Reading("literal", "lazy Q-learning, the literal reading", "lazy", "own")
#: Slopes of the reward of the team, by locally weighted regression. The default bandwidth is bad for the collective
#: team, and a gain over a team that is weaker than need be would not be one from awareness.
SLOPES = Reading("slopes", "slopes by local regression", "regression", "team", (("bandwidth", 0.2),))
#: Both readings.
READINGS = (LITERAL, SLOPES)


@cache
def exploration(number: int, world: tuple[tuple[str, Any], ...] = ()) -> LazyMemory:
    """Return the 600 transitions of an exploration of the paper's size.

    Its seed derives from a root that serves nothing else: none is searched for, and none left out. It does not depend
    on the root seed of the reproduction.

    Parameters
    ----------
    number : int
        Number of the exploration, from 0.
    world : tuple of (str, value)
        Parameters in which its world differs from the default.

    Notes
    -----
    *Source:* §8.2: the exploration phase is unique. *Departs:* here each of several explorations gives a team, because
    one exploration says little about the others.
    """
    from teamsight.analysis.learning.explore import Exploration, explore

    plan = Exploration(world=MappingProxyType(dict(world)))
    scenario = plan.scenario
    seed = model_seed(
        root("figure 11: explore"), number, scenario["robots"], scenario["targets"], scenario["radius"]
    )  # fmt: skip
    return explore(Exploration(seed=seed, world=plan.world))


@cache
def _learner(reading: Reading, is_cooperative: bool, world: tuple[tuple[str, Any], ...], number: int) -> Learner:
    from teamsight.analysis.learning.registry import LEARNERS, REWARDS

    memory = exploration(number, world)
    inputs, constants = (memory.inputs, ()) if is_cooperative else (memory.own, reading.alone)
    return LEARNERS[reading.learner](memory, REWARDS[reading.reward], inputs, **dict(constants))


def _learned(reading: Reading, is_cooperative: bool, setting: Parameters) -> Callable[[int], Variant]:
    """Return the treatment by number of the exploration, which is made in the world of the setting."""
    from teamsight.agents.cmommt import DEFAULTS

    world = tuple((name, setting[name]) for name in _WORLD if setting.get(name, DEFAULTS[name]) != DEFAULTS[name])

    def variant(number: int) -> Variant:
        policy = _learner(reading, is_cooperative, world, number)
        treatment = {"policy": policy, "awareness": "ring" if is_cooperative else "none"}
        return Variant(treatment, described(policy.memory))

    return variant


def described(memory: LazyMemory) -> dict[str, Any]:
    """Return the columns that describe an exploration in a table of runs.

    Returns
    -------
    dict
        exploration (its seed), transitions, explorers, explored_targets, explored_radius, explored_steps, and the
        p-values of rotations and distances against a uniform distribution (Kolmogorov and Smirnov): rotation_p and
        distance_p.
    """
    from scipy.stats import kstest

    settings = memory.settings
    shares = memory.action[:, 0] / (2 * np.pi) % 1.0, memory.action[:, 1]
    rotation, distance = (float(kstest(one.astype(float), "uniform", method="asymp").pvalue) for one in shares)
    return {
        "exploration": settings["seed"],
        "transitions": len(memory),
        "explorers": settings["robots"],
        "explored_targets": settings["targets"],
        "explored_radius": settings["radius"],
        "explored_steps": settings["steps"],
        "rotation_p": rotation,
        "distance_p": distance,
    }


def _scaled(setting: Parameters) -> Parameters:
    """Return A-CMOMMT with half the awareness range and a repulsion that scales with it."""
    from teamsight.agents.resolve import shared_options
    from teamsight.policies import ACmommt

    options = shared_options("a-cmommt", setting.get("policy_options", {}))
    return {**_A_CMOMMT, **_HALF, "policy": ACmommt(repulsion_scale="awareness", **options)}


class Design(NamedTuple):
    """An `Experiment` before its grid and its setting are known; see there for what is not explained here.

    Attributes
    ----------
    treatment : mapping or callable
        Keyword parameters of CMOMMT, or a function that returns for a setting these, or the treatment of a replicate.
    cells : tuple or callable
        The cells (robots, radius), or a function of both that says which cells of the grid they are.
    is_again : bool
        Whether it measures again, on fresh worlds, the cell in which A-CMOMMT gained most over the policy centroid.
    """

    treatment: Parameters | Callable[[Parameters], Parameters | Callable[[int], Variant]]
    cells: Cells | Callable[[int, float], bool] = lambda robots, radius: True
    targets: int = 15
    sweep: Mapping[str, tuple[Any, ...]] = MappingProxyType({})
    replicates: int = 1
    is_again: bool = False

    def treatment_under(self, setting: Parameters) -> Parameters | Callable[[int], Variant]:
        """Return the treatment under a setting."""
        return self.treatment(setting) if callable(self.treatment) else self.treatment

    def cells_of(self, grid: Grid) -> Cells:
        """Return the cells (robots, radius)."""
        return tuple(one for one in grid.cells if self.cells(*one)) if callable(self.cells) else self.cells


def _are_small(robots: int, radius: float) -> bool:
    return robots >= 10 and radius <= 2


def _have_larger_teams(robots: int, radius: float) -> bool:
    return robots >= 10 and 3 <= radius <= 9


#: Every experiment by name.
EXPERIMENTS: Mapping[str, Design] = {
    "random-walk": Design(_WALK),
    "centroid": Design(_CENTROID),
    "a-cmommt": Design(_A_CMOMMT),
    "a-cmommt-small-arenas": Design(_A_CMOMMT, _are_small),
    "random-walk-small-arenas": Design(_WALK, _are_small),
    "random-walk-crowded": Design(_WALK, ((30, 2.0),), replicates=_RARE),
    "random-walk-half-range": Design({**_WALK, **_HALF}),
    "centroid-larger-teams": Design(_CENTROID, _have_larger_teams, replicates=_MANY),
    "random-walk-larger-teams": Design(_WALK, _have_larger_teams, replicates=_MANY),
    "a-cmommt-largest-gain": Design(_A_CMOMMT, replicates=_MANY, is_again=True),
    "centroid-largest-gain": Design(_CENTROID, replicates=_MANY, is_again=True),
    "half-range": Design({**_A_CMOMMT, **_HALF}),
    "half-range-scaled": Design(_scaled),
    "ring-16": Design({**_A_CMOMMT, "awareness": "ring", "delta": 16}),
    "evasive": Design({**_A_CMOMMT, "target_policy": "evasive"}, lambda robots, radius: radius >= 2),
    **{f"targets-{targets}": Design(_A_CMOMMT, _CROWDED, targets) for targets in (5, 15, 30)},
    **{f"random-walk-targets-{targets}": Design(_WALK, _CROWDED, targets) for targets in (5, 15, 30)},
    "a-cmommt-r10": Design(_A_CMOMMT, _LARGEST, replicates=_MORE),
    "random-walk-r10": Design(_WALK, _LARGEST, replicates=_MORE),
    "stationary-r10": Design({"policy": "stationary", **_ALONE}, _LARGEST, replicates=_MORE),
    "delta-ring": Design({**_A_CMOMMT, "awareness": "ring"}, DELTA_CELLS, sweep={"delta": DELTAS}, replicates=4),
    "delta-none": Design({**_A_CMOMMT, **_ALONE}, DELTA_CELLS, replicates=4),
    "delta-pairwise": Design(_A_CMOMMT, DELTA_CELLS, replicates=4),
    **{
        f"{reading.name}-{team}": Design(partial(_learned, reading, team == "cooperative"), replicates=EXPLORATIONS)
        for reading in READINGS
        for team in ("cooperative", "collective")
    },
    # On the same worlds as the learned teams.
    "a-cmommt-more": Design(_A_CMOMMT, replicates=EXPLORATIONS),
    "random-walk-more": Design(_WALK, replicates=EXPLORATIONS),
}
#: Experiments whose policy was learned from transitions.
LEARNED = frozenset(name for name, design in EXPERIMENTS.items() if getattr(design.treatment, "func", None) is _learned)


def chosen(
    names: Iterable[str], grid: Grid, setting: Parameters, made: Mapping[str, pd.DataFrame] | None = None
) -> list[Experiment]:
    """Return the named experiments and those whose results they need, each once.

    Parameters
    ----------
    names : iterable of str
        Names of experiments.
    grid : Grid
        Team sizes and radii of the surfaces.
    setting : mapping
        Keyword parameters of CMOMMT that hold in all experiments.
    made : mapping of str to DataFrame, optional
        The tables of these experiments: those that measure a cell again are returned. Without it, all others are.
    """
    wanted = set(names)
    if any(EXPERIMENTS[name].is_again for name in wanted):
        wanted |= {"a-cmommt", "centroid"}
    return [
        Experiment(
            name, design.treatment_under(setting),
            design.cells_of(grid) if made is None else _largest_gain(made["a-cmommt"], made["centroid"]),
            design.targets, design.sweep, design.replicates, design.is_again,
        )
        for name, design in EXPERIMENTS.items()
        if name in wanted and design.is_again == (made is not None)
    ]  # fmt: skip


def _largest_gain(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Cells:
    cells = gain(acmommt, centroid).T.unstack()
    robots, radius = cells.index[int(cells.to_numpy().argmax())]
    return ((int(robots), float(radius)),)


def make_chosen(
    asked: Sequence[tuple[Parameters, Iterable[str]]],
    grid: Grid,
    pool: Executor | None = None,
    *,
    progress: Progress = lambda done, total: None,
    later: Progress = lambda done, total: None,
    **how: Any,
) -> list[dict[str, pd.DataFrame]]:
    """Run experiments, then those that measure a cell again, and return all tables by name of the experiment.

    Parameters
    ----------
    asked : sequence of (mapping, iterable of str)
        A setting, and the names of the experiments that are made under it.
    grid : Grid
        Team sizes and radii of the surfaces.
    pool, progress, **how
        See `make_tables`.
    later : callable
        As `progress`, for the experiments that measure again.
    """
    first = [Request(setting, chosen(names, grid, setting)) for setting, names in asked]
    made = make_tables(first, pool, progress=progress, **how)
    again = [
        Request(setting, chosen(names, grid, setting, tables))
        for (setting, names), tables in zip(asked, made, strict=True)
    ]
    more = make_tables(again, pool, progress=later, **how)
    return [tables | others for tables, others in zip(made, more, strict=True)]


class Gains(NamedTuple):
    """What awareness adds to learned teams: a gain by exploration and cell.

    Attributes
    ----------
    values : ndarray, shape (explorations, team sizes, radii), float64
        The gain [percentage points].
    robots : ndarray, shape (team sizes,), int64
        Team sizes, ascending.
    radius : ndarray, shape (radii,), float64
        Radii of the arena, ascending.
    """

    values: NDArray[np.float64]
    robots: NDArray[np.int64]
    radius: NDArray[np.float64]

    def average(self) -> Interval:
        """Return the mean over all cells, with its interval over explorations."""
        return interval_of(self.values.mean(axis=(1, 2)))


def gains_of(table: pd.DataFrame, base: pd.DataFrame) -> Gains:
    """Return the paired gain of one experiment over another; replicate k of every cell is exploration k."""
    runs = paired(table, base)
    grid = runs.pivot(index="replicate", columns=["robots", "radius"], values="difference").sort_index(axis=1)
    robots, radius = (np.unique(runs[name].to_numpy()) for name in ("robots", "radius"))
    return Gains(100.0 * grid.to_numpy().reshape(len(grid), len(robots), len(radius)), robots, radius)
