"""Model-based policy search: a model of the world is learned from transitions, and a policy in worlds imagined by it.

Imagined steps are free, real transitions are not. What is learned is the numbers of the model. Its form is given: discs
that move straight on and are reflected, targets that turn at random, sensing within a range.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import RingAwareness
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.plans import MOST_GENERATIONS, Imagining
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.core.extras import extra
from teamsight.policies.group_forces import BY_HAND, GroupForces
from teamsight.policies.memory import LazyMemory

Floats = npt.NDArray[np.float64]

#: Root seed of the imagined worlds.
ROOT = root("imagination")
# Distances [ranges] of the readings that count: nearer ones turn too fast, farther ones are lost when they move away.
_NEAR, _FAR = 0.3, 0.7
# An imagined exploration has so many worlds; the model is corrected so often.
_IMAGINED, _CORRECTIONS = 48, 4
# In so many worlds of each cell the last policies are compared.
_FINAL = 8


class WorldModel(NamedTuple):
    """A model of the world; lengths are in sensing ranges.

    Attributes
    ----------
    robot_speed, target_speed : float
        Distances of a full step.
    awareness_range : float
        Within which a robot perceives teammates.
    turn_probability : float
        Of a target, per step.
    radius : float
        Of the arena that was explored.
    """

    robot_speed: float
    target_speed: float
    awareness_range: float
    turn_probability: float
    radius: float

    def parameters(self, scale: float = 1.0) -> dict[str, Any]:
        """Return the parameters of an imagined world whose radius is `scale` times that of the explored one."""
        radius = max(self.radius * scale, 1.0)
        return {
            "robot_speed": self.robot_speed, "target_speed": self.target_speed, "sensing_range": 1.0,
            "awareness_range": self.awareness_range, "radius": radius,
            "target_policy_options": {"turn_probability": self.turn_probability},
        }  # fmt: skip


class _Matches(NamedTuple):
    """Lone readings with the reading of the same thing in the next situation."""

    transition: npt.NDArray[np.int64]
    sector: npt.NDArray[np.int64]
    next_sector: npt.NDArray[np.int64]
    change: Floats
    approach: Floats


def _matches(memory: LazyMemory, first: int, sectors: int) -> _Matches:
    """Return the readings of a ring with nothing in the two sectors on each side, before and after the step.

    After the step they are sought around the sector in which a thing at rest would be. `change` is that of the
    distance, and `approach` the part of the robot's move toward the reading, in full steps.
    """
    around = np.arange(-2, 3)
    ring = memory.situation[:, first : first + sectors]
    following = memory.next_situation[:, first : first + sectors]
    rotation, share = memory.action.T.astype(float)
    found = []
    for sector in range(sectors):
        alone = (ring[:, (sector + around) % sectors] < 1.0).sum(axis=1) == 1
        chosen = np.flatnonzero(alone & (ring[:, sector] > _NEAR) & (ring[:, sector] < _FAR))
        bearing = 2.0 * math.pi * sector / sectors - rotation[chosen]
        places = (np.rint(bearing * sectors / (2.0 * math.pi)).astype(int)[:, None] + around) % sectors
        near = following[chosen[:, None], places]
        kept = (near < 1.0).sum(axis=1) == 1
        chosen, at = chosen[kept], near[kept].argmin(axis=1)
        change = near[kept].min(axis=1).astype(float) - ring[chosen, sector]
        approach = share[chosen] * np.cos(bearing[kept])
        following_sector = places[kept, at]
        found.append((chosen, np.full(len(chosen), sector), following_sector, change, approach))
    return _Matches(*map(np.concatenate, zip(*found, strict=True)))


class Statistics(NamedTuple):
    """What an exploration shows; each depends mainly on one number of the model."""

    step: float
    """Mean change of a lone target's distance for a full step of the robot toward it."""
    spread: float
    """Root mean square of the rest of this change."""
    straight: float
    """Correlation of this rest in successive steps."""
    teammate_step: float
    """As `step`, of lone teammates."""
    sensed: float
    """Mean share of the targets that a robot senses."""


def statistics(memory: LazyMemory) -> Statistics:
    """Return the statistics of an exploration by random walk under ring awareness; only transitions are read.

    Raises
    ------
    ValueError
        If the transitions are too few.
    """
    targets, teammates = _matches(memory, 0, memory.own), _matches(memory, memory.own, memory.added)
    step, rest = _regressed(targets)
    teammate_step, _ = _regressed(teammates)
    at = {memory.situation[i].tobytes(): i for i in range(len(memory))}
    index = {key: k for k, key in enumerate(zip(targets.transition, targets.sector, strict=True))}
    rests = []
    for k, (i, sector) in enumerate(zip(targets.transition, targets.next_sector, strict=True)):
        following = index.get((at.get(memory.next_situation[i].tobytes(), -1), sector))
        if following is not None:
            rests.append((rest[k], rest[following]))
    if len(rests) < 2:
        raise ValueError(
            f"memory: has {len(memory)} transitions and {len(rests)} times two steps with a lone target, at least 2; "
            "explore longer"
        )
    one, other = np.array(rests).T
    straight = float(one @ other / math.sqrt((one @ one) * (other @ other)))
    sensed = float(np.mean(memory.fact("sensed"))) / memory.settings["targets"]
    return Statistics(step, float(np.sqrt(np.mean(rest**2))), straight, teammate_step, sensed)


def _regressed(matches: _Matches) -> tuple[float, Floats]:
    """Return the slope of minus the change over the approach, and the rest."""
    square = float(matches.approach @ matches.approach)
    if not square > 0.0:
        raise ValueError("memory: shows no lone target or no lone teammate for two steps; explore longer")
    slope = -float(matches.change @ matches.approach) / square
    return slope, matches.change + slope * matches.approach


def learn_model(memory: LazyMemory, seed: int = 0) -> WorldModel:
    """Return the model whose imagined explorations have the statistics of a memory.

    Parameters
    ----------
    memory : LazyMemory
        An exploration by random walk under `RingAwareness`, as of `teamsight learn explore`. Of its settings only the
        numbers of robots and targets are read: speeds and ranges are learned.
    seed : int
        Seed of the imagined explorations.

    Raises
    ------
    ValueError
        If the transitions are too few, are not of CMOMMT, or show no ring of teammates.

    Notes
    -----
    *Source:* C. Gouriéroux, A. Monfort and E. Renault, "Indirect inference" (1993): each number of the model is
    multiplied by the ratio of its statistic to that of the imagined exploration, until both agree.
    """
    settings = memory.settings
    if settings.get("teammate_layout") != "sectors" or not memory.added:
        raise ValueError("memory: its inputs show no ring of teammates; explore with awareness='ring'")
    missing = [name for name in ("robots", "targets", "radius") if not isinstance(settings.get(name), int | float)]
    if missing:
        raise ValueError(f"memory: its settings lack one number for {', '.join(missing)}; explore CMOMMT, once")
    wanted = statistics(memory)
    if not min(wanted.step, wanted.teammate_step) > 0.0:
        raise ValueError(f"memory: its {len(memory)} transitions do not show the robots' own steps; explore longer")
    model = WorldModel(
        wanted.step, math.sqrt(2.0) * wanted.spread, wanted.step / wanted.teammate_step,
        _probability(1.0 - wanted.straight), 1.0 / math.sqrt(wanted.sensed),
    )  # fmt: skip
    for correction in range(_CORRECTIONS):
        world = {"robots": settings["robots"], "targets": settings["targets"], **_bounded(model).parameters()}
        got = statistics(explore(Exploration(seed=seed + correction, runs=_IMAGINED, world=world)))
        ratio = WorldModel(
            wanted.step / got.step, wanted.spread / got.spread,
            wanted.step / got.step * got.teammate_step / wanted.teammate_step,
            1.0, math.sqrt(got.sensed / wanted.sensed),
        )  # fmt: skip
        straight = (1.0 - model.turn_probability) + wanted.straight - got.straight
        scaled = (value * float(np.clip(by, 0.5, 2.0)) for value, by in zip(model, ratio, strict=True))
        model = _bounded(WorldModel(*scaled)._replace(turn_probability=_probability(1.0 - straight)))
    return model


def _probability(value: float) -> float:
    return min(max(value, 0.0), 1.0)


def _bounded(model: WorldModel) -> WorldModel:
    """Return the model within the limits of a world."""
    robot_speed, target_speed = (float(np.clip(speed, 1e-3, 0.5)) for speed in model[:2])
    return WorldModel(
        robot_speed, target_speed, float(np.clip(model.awareness_range, 0.1, 10.0)), model.turn_probability,
        max(model.radius, 1.0),
    )  # fmt: skip


def imagine(
    model: WorldModel,
    plan: Imagining | None = None,
    explored: float = 3.0,
    pool: Executor | None = None,
    progress: Progress = lambda done, total: None,
) -> GroupForces:
    """Return the policy that is found in imagined worlds, from `BY_HAND` by CMA-ES.

    All policies of a generation are tried in the same worlds, and each generation has new ones. The means of some later
    generations are then tried in further worlds, of which the best is returned.

    Parameters
    ----------
    model : WorldModel
        What the worlds are like.
    plan : Imagining, optional
        The teams and arenas for which the policy is made, and how long it is sought.
    explored : float
        Radius of the explored arena in the units of the plan's arenas.
    pool : Executor, optional
        Processes that do the work; by default this process. The policy does not depend on it.
    progress : callable
        Called with the generations done and in all.

    Raises
    ------
    ModuleNotFoundError
        If the package cma is not installed.
    ValueError
        If the plan has no team.
    """
    if not (plan or Imagining()).cells:
        raise ValueError(
            "robots, radius: so many robots observe all targets of so small an arena, whatever they do; give fewer, or "
            "a larger radius"
        )
    cma = extra("cma", "evolution", "learn imagine")
    plan = plan or Imagining()
    start = np.array(GroupForces.vector(BY_HAND))
    spread = GroupForces.deviations()
    rng, degree = np.random.default_rng(plan.seed), RingAwareness()
    options = {
        "popsize": plan.population, "randn": lambda *shape: rng.standard_normal(shape), "seed": np.nan, "verbose": -9,
        # Do not stop: with noise, equal results do not mean convergence.
        "tolfun": 0, "tolfunhist": 0, "tolflatfitness": np.inf, "tolstagnation": np.inf, "tolx": 0,
    }  # fmt: skip
    strategy = cma.CMAEvolutionStrategy(np.zeros(len(start)), 1.0, options)

    def policy(place: Floats) -> GroupForces:
        return GroupForces(tuple((start + spread * place).tolist()))

    def observed(policies: list[GroupForces], replicates: range) -> Floats:
        """Return the share of the targets that each observes."""
        runs = []
        for one in policies:
            for (robots, radius), replicate in product(plan.cells, replicates):
                world = model.parameters(radius / explored) | {"robots": robots, "targets": plan.targets}
                seed = model_seed(ROOT, plan.seed * MOST_GENERATIONS + replicate, robots, plan.targets, radius)
                runs.append(Run({"policy": one, "awareness": degree, **world}, seed, plan.steps))
        found = [outcome.observed_fraction for outcome in run_all(runs, pool)]
        return np.asarray(np.array(found).reshape(len(policies), -1).mean(axis=1))

    means = []
    for generation in range(plan.generations):
        places = strategy.ask()
        strategy.tell(places, list(-observed([policy(place) for place in places], range(generation, generation + 1))))
        means.append(policy(strategy.mean))
        progress(generation + 1, plan.generations)
    last = means[plan.generations // 2 :: max(plan.generations // 12, 1)]
    return last[int(np.argmax(observed(last, range(plan.generations, plan.generations + _FINAL))))]
