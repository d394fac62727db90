"""Learning curves: what learners observe with and without awareness, from equal numbers of transitions."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any

import pandas as pd

from teamsight.agents.awareness import Awareness, NoAwareness, PairwiseAwareness
from teamsight.analysis.learning.evaluation import BY_HAND, DESIGNED, RANDOM
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.learners import Objective, awareness_for, learn
from teamsight.analysis.learning.registry import LEARNERS, REWARDS
from teamsight.analysis.runs.checkpoint import Checkpoint, code_digest
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.search_space import log10_size
from teamsight.core.component import Allowed, Component, Count, Probability
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.lazy.learner import LazyLearner
from teamsight.policies.lazy.sheppard_lazy_q import SheppardLazyQ
from teamsight.policies.memory import LazyMemory
from teamsight.world.limits import Length

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds

#: Numbers of transitions, from a fifteenth of the paper's memory to 64 times the memory.
SAMPLES = (40, 75, 150, 300, 600, 1200, 2400, 4800, 9600, 19200, 38400)
# Cost of a job of cost 1 for the runner, which puts each job into a chunk of its own.
_COST = 250_000.0


@dataclass(frozen=True)
class Curves(Component):
    """Settings of learning curves: what is learnt, from how many transitions, and where it is evaluated.

    The explorations are the paper's, 5 robots × 120 steps among 10 targets in an arena of radius 3 under Θ(1), as often
    as the largest sample needs. A situation under Θ(1) does not depend on the number of robots, so that one exploration
    serves all scenarios; under Θ(0) learners get the robot's own inputs of the same transitions.

    Parameters
    ----------
    learners : tuple of str
        Names of learners.
    samples : tuple of int
        Numbers of transitions. Smaller samples are subsets of larger ones.
    memories : int
        Number of explorations; all learners learn from the same ones.
    worlds : int
        Number of worlds of each scenario in which each policy is evaluated, for each exploration.
    robots : tuple of int
        Numbers of robots; each with each radius is a scenario.
    radius : tuple of float
        Radii of the arena [sensing ranges].
    targets, steps : int
        Number of targets, and of steps of each run.
    seed : int
        Root seed.
    reward : str
        "own", "team", "alone" or "keep".
    discount : float
        Discount factor γ, in [0, 1].
    k : int, optional
        Number of transitions that match a situation; by default that of each learner.

    Raises
    ------
    TypeError, ValueError
        If a name is unknown or a number too small.
    """

    learners: Annotated[tuple[Annotated[str, Allowed(choices=LEARNERS)], ...], Allowed()] = (
        "lazy", "tabular", "linear", "regression",
    )  # fmt: skip
    samples: Annotated[tuple[Count, ...], Allowed()] = SAMPLES
    memories: Count = 24
    worlds: Count = 3
    robots: Annotated[tuple[Count, ...], Allowed()] = (5, 10, 20)
    radius: Annotated[tuple[Length, ...], Allowed()] = (3.0, 5.0)
    targets: Count = 15
    steps: Annotated[Count, Allowed(unit="ticks")] = 600
    seed: Annotated[int, Allowed(least=0)] = root("learning curves")
    reward: Annotated[str, Allowed(choices=REWARDS)] = "keep"
    discount: Probability = 0.7
    k: Count | None = None

    @property
    def objective(self) -> Objective:
        """What is to be learnt."""
        return Objective(REWARDS[self.reward], self.k, self.discount)

    @property
    def scenarios(self) -> list[tuple[int, float]]:
        """Number of robots and radius of each scenario."""
        return list(product(self.robots, self.radius))

    def exploration(self, memory: int) -> Exploration:
        """Return the exploration of a memory; memories share no world."""
        runs = -(-max(self.samples) // Exploration().transitions)
        return Exploration(runs=runs, seed=self.seed + memory)

    def can_learn(self, learner: str, transitions: int) -> bool:
        """Return whether so many transitions are as many as a learner matches with a situation."""
        kind = LEARNERS[learner]
        if not issubclass(kind, LazyLearner):
            return True
        return transitions >= (kind.k if self.k is None else self.k)

    def conditions(self) -> dict[str, Any]:
        """Return all settings as JSON values."""
        return as_json(self)


@dataclass(frozen=True)
class CurveJob:
    """One learner with all numbers of transitions of one memory.

    Parameters
    ----------
    curves : Curves
        The settings.
    learner : str
        Name of the learner; empty for the policies that do not learn.
    memory : int
        Number of the memory.
    """

    curves: Curves
    learner: str
    memory: int

    @property
    def key(self) -> tuple[str, ...]:
        """See `Job`."""
        return ("learning curves", str(self.curves.conditions()), self.learner, str(self.memory), code_digest(__name__))

    @property
    def cost(self) -> float:
        """See `Job`: a lazy learner compares its transitions at each decision."""
        if not self.learner:
            return _COST
        compares = issubclass(LEARNERS[self.learner], LazyLearner)
        return _COST * (10.0 + (5.0 if compares else 1.0) * sum(self.curves.samples) / 7_500)

    def describe(self) -> str:
        """See `Job`."""
        return f"the learning curves, {self.learner or 'policies that do not learn'}, memory {self.memory}"

    def make(self, worlds: ReusedWorlds) -> list[dict[str, Any]]:
        """Return the rows of the job; see `make_curves`."""
        return _learnt_rows(self) if self.learner else _designed_rows(self)


def curve_jobs(curves: Curves) -> list[CurveJob]:
    """Return the jobs of learning curves."""
    learners = ("", *curves.learners)
    return [CurveJob(curves, learner, memory) for memory in range(curves.memories) for learner in learners]


def make_curves(
    curves: Curves,
    pool: WorkerPool | None = None,
    *,
    checkpoint: Checkpoint | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Explore, learn, and evaluate.

    Parameters
    ----------
    curves : Curves
        The settings.
    pool : WorkerPool, optional
        Processes that do the work; by default this process. The table does not depend on it.
    checkpoint : Checkpoint, optional
        File of the rows of finished jobs.
    progress : callable
        Called with the work done and the work in all, in arbitrary units.

    Returns
    -------
    DataFrame
        One row a learner, number of transitions, degree of awareness ("none" or "ring"), memory and world: learner,
        transitions, log10_size (see `search_space`), degree, memory, robots, radius, replicate, seed,
        observed_fraction, which is NaN where a learner needs more transitions. Teams that learn nothing, the random
        walk ("none"), A-CMOMMT ("pairwise") and those of `BY_HAND`, have 0 transitions.

    Raises
    ------
    JobError
        If a job fails; the message contains its settings.
    """
    rows = run_all(curve_jobs(curves), pool, progress=progress, checkpoint=checkpoint)
    return pd.concat([pd.DataFrame(part) for part in rows], ignore_index=True)


def search_space(policy: Any) -> float:
    """Return log10 of how many values a learner has to learn.

    A table has one for each state and action, a linear approximator its weights, a regression its slopes. Learners that
    compare whole situations distinguish at least p^d of them, with p = 2 and d inputs.
    """
    if isinstance(policy, LazyLearner | SheppardLazyQ):
        return log10_size(policy.inputs)
    return math.log10(policy.learned.size)


def _learnt_rows(job: CurveJob) -> list[dict[str, Any]]:
    curves = job.curves
    everything = explore(curves.exploration(job.memory))
    rows = []
    for transitions in curves.samples:
        memory = everything.sample(transitions, seed=job.memory)
        for inputs in (memory.own, memory.inputs):
            policy = _learnt(job, memory, inputs) if curves.can_learn(job.learner, transitions) else None
            size = float("nan") if policy is None else search_space(policy)
            about = {"learner": job.learner, "transitions": transitions, "log10_size": size}
            rows += _evaluated(job, about, policy, awareness_for(memory, inputs))
    return rows


def _learnt(job: CurveJob, memory: LazyMemory, inputs: int) -> Any:
    with warnings.catch_warnings():
        # Too few transitions are what the curves are about.
        warnings.simplefilter("ignore", UserWarning)
        return learn(job.learner, memory, job.curves.objective, inputs=inputs)


def _designed_rows(job: CurveJob) -> list[dict[str, Any]]:
    designed = {RANDOM: (RandomWalk(), NoAwareness()), DESIGNED: (ACmommt(idle="wander"), PairwiseAwareness())}
    rows = []
    for name, (policy, degree) in (designed | BY_HAND).items():
        rows += _evaluated(job, {"learner": name, "transitions": 0, "log10_size": float("nan")}, policy, degree)
    return rows


def _evaluated(job: CurveJob, about: dict[str, Any], policy: Any, degree: Awareness) -> list[dict[str, Any]]:
    """Return a row for each world in which a policy is evaluated; all policies of a memory get the same worlds."""
    curves = job.curves
    replicates = range(job.memory * curves.worlds, (job.memory + 1) * curves.worlds)
    rows, runs = [], []
    for (robots, radius), replicate in product(curves.scenarios, replicates):
        seed = model_seed(curves.seed, replicate, robots, curves.targets, radius)
        place = {"memory": job.memory, "robots": robots, "radius": radius, "replicate": replicate, "seed": seed}
        rows.append(about | {"degree": degree.name} | place)
        parameters: dict[str, Any] = {"robots": robots, "targets": curves.targets, "radius": radius}
        runs.append(Run(parameters | {"policy": policy, "awareness": degree}, seed, curves.steps))
    observed = [float("nan")] * len(runs)
    if policy is not None:
        observed = [outcome.observed_fraction for outcome in run_all(runs)]
    return [row | {"observed_fraction": share} for row, share in zip(rows, observed, strict=True)]
