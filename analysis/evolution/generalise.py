"""Compare the evolved policy with A-CMOMMT in worlds unlike those in which it was evolved."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from teamsight.agents.awareness import Awareness, PairwiseAwareness, RingAwareness
from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.evolution.cma import DELTA, GENERALISE, STEPS
from teamsight.analysis.evolution.compare import Gain, overall
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Model, Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.policies.evolved import Evolved
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.interface import Policy

if TYPE_CHECKING:
    from teamsight.agents.world import World


def boxed(*, ratio: float, robots: int, targets: int, radius: float, policy: Policy, awareness: Awareness,
          rng: int) -> World:  # fmt: skip
    """Return the world of `CMOMMT` with its defaults, but in a box.

    Parameters
    ----------
    ratio : float
        Length of the box over its width.
    robots, targets : int
        Numbers of agents.
    radius : float
        Radius of the disc whose area the box has [length].
    policy, awareness
        Those of the robots.
    rng : int
        Seed of the world.
    """
    from teamsight.agents.body import Robot, Target
    from teamsight.agents.world import World
    from teamsight.world.arena import Box

    width = radius * math.sqrt(math.pi / ratio)
    world = World(Box(ratio * width, width), rng=rng)
    team = world.add(Robot, robots, policy=policy, awareness=awareness, speed=DEFAULTS["robot_speed"])
    prey = world.add(Target, targets, policy=RandomWalk(turn_probability=0.05), speed=DEFAULTS["target_speed"])
    world.senses(team, prey)
    return world


class Variation(NamedTuple):
    """Worlds that differ in one respect from those in which the policy was evolved.

    Attributes
    ----------
    name : str
        What is different.
    settings : mapping
        Parameters of the model.
    robots, radius : tuple
        Team sizes and radii; all combinations are cells.
    targets : int
        Number of targets.
    model : callable, optional
        See `Run`.
    """

    name: str
    settings: Mapping[str, Any] = {}
    robots: tuple[int, ...] = (5, 10, 20, 30)
    radius: tuple[float, ...] = (4.0, 8.0)
    targets: int = 15
    model: Model | None = None


#: What is varied. The first row is for comparison.
VARIATIONS = (
    Variation("nothing"),
    Variation("robots and targets half as fast", {"robot_speed": 0.05, "target_speed": 0.0375}),
    Variation("robots and targets twice as fast", {"robot_speed": 0.2, "target_speed": 0.15}),
    Variation("targets half as fast as robots", {"target_speed": 0.05}),
    Variation("targets as fast as robots", {"target_speed": 0.1}),
    Variation("each target with its own speed", {"uniform_target_speed": True}),
    Variation("5 targets", targets=5),
    Variation("40 targets", targets=40),
    Variation("evasive targets", {"target_policy": "evasive"}),
    Variation("square of the disc's area", {"ratio": 1.0}, model=boxed),
    Variation("box 4:1 of the disc's area", {"ratio": 4.0}, model=boxed),
    Variation("sensing range halved", {"sensing_range": 0.5}),
    Variation("sensing range doubled", {"sensing_range": 2.0}),
    Variation("awareness range halved", {"awareness_range": 0.5}),
    Variation("awareness range doubled", {"awareness_range": 2.0}),
    Variation("R = 12", robots=(10, 20, 30), radius=(12.0,)),
    Variation("R = 16", robots=(10, 20, 30), radius=(16.0,)),
    Variation("N = 1", robots=(1,)),
    Variation("N = 2", robots=(2,)),
    Variation("N = 3", robots=(3,)),
    Variation("N = 60", robots=(60,)),
)


def generalise(
    policy: Evolved,
    options: Mapping[str, Any],
    pool: WorkerPool | None = None,
    *,
    runs: int,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Return the gain of the policy in each of the `VARIATIONS`.

    Parameters
    ----------
    policy : Evolved
        Runs under ring awareness.
    options : mapping
        Options of A-CMOMMT, which runs under pairwise awareness.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    runs : int
        Runs of each cell.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    DataFrame
        Columns name, observed (by A-CMOMMT) [%], and mean, low, high of the gain [percentage points].
    """
    rivals = (
        {"policy": policy, "awareness": RingAwareness(DELTA)},
        {"policy": ACmommt(**options), "awareness": PairwiseAwareness()},
    )
    planned = [
        (variation.name, replicate, [_run(variation, rival, robots, radius, replicate) for rival in rivals])
        for variation in VARIATIONS
        for robots in variation.robots
        for radius in variation.radius
        for replicate in range(runs)
    ]
    outcomes = iter(run_all([run for *_, pair in planned for run in pair], pool, progress=progress))
    rows = []
    for name, replicate, _ in planned:
        evolved, base = (next(outcomes).observed_fraction for _ in rivals)
        rows.append({"name": name, "replicate": replicate, "difference": evolved - base, "base": base})
    table = pd.DataFrame(rows)
    return pd.DataFrame([_row(str(name), found) for name, found in table.groupby("name", sort=False)])


def _run(variation: Variation, rival: Mapping[str, Any], robots: int, radius: float, replicate: int) -> Run:
    targets = variation.targets
    scenario = {"robots": robots, "targets": targets, "radius": radius}
    seed = model_seed(GENERALISE, replicate, robots, targets, radius)
    return Run({**variation.settings, **rival, **scenario}, seed, STEPS, model=variation.model)


def _row(name: str, found: pd.DataFrame) -> dict[str, Any]:
    gain: Gain = overall(found)
    return {"name": name, "observed": 100.0 * float(found["base"].mean()), **gain._asdict()}
