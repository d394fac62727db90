"""The experiments behind the paper's figures and claims, among them the learned teams of Fig. 11.

An experiment is built, explorations are made, and their modules are imported, only when a figure or a claim reads it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache, partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.runs.experiment import Cells, Choice, Experiment, Extent, Parameters, Tables, Variant
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.stats.paired import CELL, Interval, clustered, gain, paired

if TYPE_CHECKING:
    from teamsight.policies.learner import Learner
    from teamsight.policies.memory import LazyMemory

#: Numbers of sectors δ of the figure "delta".
DELTAS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
#: Its worlds (robots, radius), from crowded to empty.
DELTA_CELLS: Cells = ((10, 2.0), (20, 3.0), (30, 2.0), (10, 4.0), (20, 5.0), (30, 4.0))
#: The most explorations of a cell for each of its runs: five runs give 25. Each exploration runs a cell at most once.
EXPLORATIONS = 5
#: The explorations of a cell before its interval is looked at; see docs/claims.md.
FIRST_EXPLORATIONS = 8
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


def _learned(reading: Reading, is_cooperative: bool, setting: Parameters, number: int) -> Variant:
    """Return the treatment of a learned team by number of the exploration, made in the world of the setting."""
    from teamsight.agents.cmommt import DEFAULTS

    world = tuple((name, setting[name]) for name in _WORLD if setting.get(name, DEFAULTS[name]) != DEFAULTS[name])
    policy = _learner(reading, is_cooperative, world, number)
    treatment = {"policy": policy, "awareness": "ring" if is_cooperative else "none"}
    return Variant(treatment, described(policy.memory))


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


def _scaled(setting: Parameters, number: int) -> Variant:
    """Return A-CMOMMT with half the awareness range and a repulsion that scales with it."""
    from teamsight.agents.resolve import shared_options
    from teamsight.policies import ACmommt

    options = shared_options("a-cmommt", setting.get("policy_options", {}))
    return Variant({**_A_CMOMMT, **_HALF, "policy": ACmommt(repulsion_scale="awareness", **options)})


def _are_small(robots: int, radius: float) -> bool:
    return robots >= 10 and radius <= 2


def _have_larger_teams(robots: int, radius: float) -> bool:
    return robots >= 10 and 3 <= radius <= 9


def _largest_gain(tables: Tables, extent: Extent) -> dict[tuple[int, float], range]:
    """Ask for the cell in which A-CMOMMT gained most over the policy centroid, in worlds that no surface contains."""
    if "a-cmommt" not in tables:
        return {}
    cells = gain(tables["a-cmommt"], tables["centroid"]).T.unstack()
    robots, radius = cells.index[int(cells.to_numpy().argmax())]
    return {(int(robots), float(radius)): range(extent.runs, extent.runs * (1 + _MANY))}


def _teams(reading: Reading) -> tuple[str, str]:
    """Return the names of the experiments of a reading: the cooperative and the collective team."""
    return f"{reading.name}-cooperative", f"{reading.name}-collective"


def order_of(robots: int, explorations: int) -> NDArray[np.int64]:
    """Return the order in which a team size has the explorations, so that few runs of all cells are of all of them."""
    return (robots * FIRST_EXPLORATIONS + np.arange(explorations)) % explorations


def _until_narrow(reading: Reading) -> Choice:
    """Return what asks for explorations of each cell until the interval of its gain is narrow enough."""

    def choose(tables: Tables, extent: Extent) -> dict[tuple[int, float], list[int]]:
        limit = EXPLORATIONS * extent.runs
        counts = np.full(len(extent.grid.cells), limit)
        if extent.interval:
            cooperative, collective = (tables.get(name) for name in _teams(reading))
            counts = needed_explorations(cooperative, collective, extent)
        return {
            cell: sorted(order_of(cell[0], limit)[:count].tolist())
            for cell, count in zip(extent.grid.cells, counts, strict=True)
        }

    return choose


def needed_explorations(
    cooperative: pd.DataFrame | None, collective: pd.DataFrame | None, extent: Extent
) -> NDArray[np.int64]:
    """Return how many explorations each cell of the grid needs, as far as its present ones show.

    It is the rule of adaptive studies with another first look, for the width of the interval of the paired gain. Where
    that interval lies has no effect.

    Parameters
    ----------
    cooperative, collective : DataFrame or None
        What is made of both teams.
    extent : Extent
        The grid, the largest width and the runs, of which the limit is `EXPLORATIONS` times as many.
    """
    # Slow to import.
    from teamsight.analysis.studies.definition.model import Until
    from teamsight.analysis.studies.standing import Present, all_needed

    cells, limit = extent.grid.cells, EXPLORATIONS * extent.runs
    setting = replicate = np.zeros(0, np.int64)
    value = np.zeros(0)
    if cooperative is not None and collective is not None:
        runs = paired(cooperative, collective)
        number = {cell: at for at, cell in enumerate(cells)}
        setting = np.array([number[cell] for cell in zip(runs["robots"], runs["radius"], strict=True)], np.int64)
        robots = runs["robots"].to_numpy()
        # The place in `order_of`.
        replicate = (runs["replicate"].to_numpy() - robots * FIRST_EXPLORATIONS) % limit
        value = 100.0 * runs["difference"].to_numpy()
    present = Present(setting, replicate, np.zeros(len(value), bool), value, is_flag=False)
    return all_needed(Until(extent.interval, "gain", limit), 1, present, len(cells), FIRST_EXPLORATIONS)[0]


def _as_learned(tables: Tables, extent: Extent) -> dict[tuple[int, float], list[int]]:
    """Ask for the worlds in which learned teams were run."""
    found: dict[tuple[int, float], set[int]] = {cell: set() for cell in extent.grid.cells}
    for reading in READINGS:
        if (table := tables.get(_teams(reading)[0])) is not None:
            for robots, radius, replicate in zip(table["robots"], table["radius"], table["replicate"], strict=True):
                found[robots, radius].add(replicate)
    return {cell: sorted(replicates) for cell, replicates in found.items()}


#: Every experiment by name.
EXPERIMENTS: Mapping[str, Experiment] = {
    one.name: one
    for one in (
        Experiment("random-walk", _WALK),
        Experiment("centroid", _CENTROID),
        Experiment("a-cmommt", _A_CMOMMT),
        Experiment("a-cmommt-small-arenas", _A_CMOMMT, _are_small),
        Experiment("random-walk-small-arenas", _WALK, _are_small),
        Experiment("random-walk-crowded", _WALK, ((30, 2.0),), replicates=_RARE),
        Experiment("random-walk-half-range", {**_WALK, **_HALF}),
        Experiment("centroid-larger-teams", _CENTROID, _have_larger_teams, replicates=_MANY),
        Experiment("random-walk-larger-teams", _WALK, _have_larger_teams, replicates=_MANY),
        Experiment("half-range", {**_A_CMOMMT, **_HALF}),
        Experiment("half-range-scaled", _scaled),
        Experiment("ring-16", {**_A_CMOMMT, "awareness": "ring", "delta": 16}),
        Experiment("evasive", {**_A_CMOMMT, "target_policy": "evasive"}, lambda robots, radius: radius >= 2),
        *(Experiment(f"targets-{targets}", _A_CMOMMT, _CROWDED, targets) for targets in (5, 15, 30)),
        *(Experiment(f"random-walk-targets-{targets}", _WALK, _CROWDED, targets) for targets in (5, 15, 30)),
        Experiment("a-cmommt-r10", _A_CMOMMT, _LARGEST, replicates=_MORE),
        Experiment("random-walk-r10", _WALK, _LARGEST, replicates=_MORE),
        Experiment("stationary-r10", {"policy": "stationary", **_ALONE}, _LARGEST, replicates=_MORE),
        Experiment(
            "delta-ring", {**_A_CMOMMT, "awareness": "ring"}, DELTA_CELLS, sweep={"delta": DELTAS}, replicates=4
        ),
        Experiment("delta-none", {**_A_CMOMMT, **_ALONE}, DELTA_CELLS, replicates=4),
        Experiment("delta-pairwise", _A_CMOMMT, DELTA_CELLS, replicates=4),
        *(
            Experiment(name, partial(_learned, one, number == 0), choose=_until_narrow(one), reads=_teams(one))
            for one in READINGS
            for number, name in enumerate(_teams(one))
        ),
        *(
            Experiment(f"{name}-more", treatment, choose=_as_learned, reads=tuple(_teams(one)[0] for one in READINGS))
            for name, treatment in (("a-cmommt", _A_CMOMMT), ("random-walk", _WALK))
        ),
        Experiment("a-cmommt-largest-gain", _A_CMOMMT, choose=_largest_gain, reads=("a-cmommt", "centroid")),
        Experiment("centroid-largest-gain", _CENTROID, choose=_largest_gain, reads=("a-cmommt", "centroid")),
    )
}
#: Experiments whose policy was learned from transitions.
LEARNED = frozenset(name for name, one in EXPERIMENTS.items() if getattr(one.treatment, "func", None) is _learned)


def experiments_of(names: Iterable[str]) -> list[Experiment]:
    """Return the named experiments and those whose results they need, each once, in the order of `EXPERIMENTS`."""
    wanted = set(names)
    while more := {one for name in wanted for one in EXPERIMENTS[name].reads} - wanted:
        wanted |= more
    return [one for name, one in EXPERIMENTS.items() if name in wanted]


class Gains(NamedTuple):
    """What awareness adds to learned teams: a gain by exploration and cell.

    Attributes
    ----------
    values : ndarray, shape (explorations, team sizes, radii), float64
        The gain [percentage points]; NaN where an exploration has not run a cell.
    robots : ndarray, shape (team sizes,), int64
        Team sizes, ascending.
    radius : ndarray, shape (radii,), float64
        Radii of the arena, ascending.
    """

    values: NDArray[np.float64]
    robots: NDArray[np.int64]
    radius: NDArray[np.float64]

    def mean(self) -> NDArray[np.float64]:
        """Return the mean of each cell over its explorations, shape (team sizes, radii)."""
        found: NDArray[np.float64] = np.nanmean(self.values, axis=0)
        return found

    def average(self, robots: Any = True, radius: Any = True) -> Interval:
        """Return the mean over the cells of some team sizes and radii, with its interval over explorations."""
        return clustered(self.values, self.weights(robots, radius))

    def weights(self, robots: Any = True, radius: Any = True) -> NDArray[np.float64]:
        """Return the weights of all cells in the mean over those of some team sizes and radii, given as truths."""
        chosen = np.ones(len(self.robots), bool)[:, None] & np.ones(len(self.radius), bool)
        chosen &= np.reshape(robots, (-1, 1)) & np.asarray(radius)
        return chosen / np.count_nonzero(chosen)


def gains_of(table: pd.DataFrame, base: pd.DataFrame) -> Gains:
    """Return the paired gain of one experiment over another; replicate k of a cell is exploration k.

    Runs of the base without a counterpart are left out.
    """
    known = [*CELL, "replicate"]
    return gains_in(paired(table, base.merge(table[known], on=known)))


def gains_in(runs: pd.DataFrame) -> Gains:
    """Return the gains in a table of paired runs."""
    grid = runs.pivot(index="replicate", columns=["robots", "radius"], values="difference").sort_index(axis=1)
    robots, radius = (np.unique(runs[name].to_numpy()) for name in ("robots", "radius"))
    return Gains(100.0 * grid.to_numpy().reshape(len(grid), len(robots), len(radius)), robots, radius)
