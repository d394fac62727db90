"""Learning curves: what learners observe under each degree of awareness, from equal numbers of transitions."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import pandas as pd

from teamsight.agents.awareness import AWARENESS, Awareness, NoAwareness, PairwiseAwareness
from teamsight.analysis.learning.evaluation import DESIGNED, RANDOM
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.learners import Objective, awareness_for, learn
from teamsight.analysis.learning.registry import LEARNERS, REWARDS
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.analysis.search_space import log10_size
from teamsight.core import checks
from teamsight.policies.eager.state_grid import TooManyStatesError
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.random_walk import RandomWalk

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds

#: Numbers of transitions, from a quarter of the paper's memory to 64 times the memory.
SAMPLES = (150, 300, 600, 1200, 2400, 4800, 9600, 19200, 38400)
# Cost of a job of cost 1 for the runner, which puts each job into a chunk of its own.
_COST = 250_000.0


@dataclass(frozen=True)
class Curves:
    """Settings of learning curves: what is learnt, from how many transitions, and where it is evaluated.

    Parameters
    ----------
    degrees, learners : tuple of str
        Names of degrees of awareness and of learners.
    samples : tuple of int
        Numbers of transitions.
    memories : int
        Number of explorations; all learners learn from the same ones.
    worlds : int
        Number of worlds on which each policy is evaluated.
    robots, targets, radius, steps
        Numbers of robots and targets, arena radius [sensing ranges] and steps of these worlds. The explorations have
        the same number of robots, which Θ(N) and o(N) require, and otherwise the paper's 120 steps among 10 targets.
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

    degrees: tuple[str, ...] = tuple(AWARENESS)
    learners: tuple[str, ...] = ("lazy", "tabular", "linear")
    samples: tuple[int, ...] = SAMPLES
    memories: int = 10
    worlds: int = 4
    robots: int = 5
    targets: int = 15
    radius: float = 3.0
    steps: int = 600
    seed: int = 0
    reward: str = "own"
    discount: float = 0.7
    k: int | None = None

    def __post_init__(self) -> None:
        for name, allowed in (("degrees", AWARENESS), ("learners", LEARNERS)):
            for value in getattr(self, name):
                checks.choice(name.removesuffix("s"), value, allowed)
        checks.choice("reward", self.reward, REWARDS)
        for name in ("memories", "worlds", "robots", "targets", "steps"):
            checks.count(name, getattr(self, name))
        for transitions in self.samples:
            checks.count("samples", transitions)

    @property
    def objective(self) -> Objective:
        """What is to be learnt."""
        return Objective(REWARDS[self.reward], self.k, self.discount)

    def exploration(self, degree: str, memory: int) -> Exploration:
        """Return the exploration of a memory; memories share no world.

        Parameters
        ----------
        degree : str
            Name of a degree of awareness.
        memory : int
            Number of the memory.
        """
        steps = Exploration.steps
        runs = -(-max(self.samples) // (self.robots * steps))
        seed = self.seed + memory
        return Exploration(
            robots=self.robots, radius=self.radius, steps=steps, runs=runs, awareness=AWARENESS[degree](), seed=seed
        )

    def conditions(self) -> dict[str, Any]:
        """Return all settings as JSON values."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}


@dataclass(frozen=True)
class CurveJob:
    """One memory under one degree, with all learners and numbers of transitions.

    Parameters
    ----------
    curves : Curves
        The settings.
    degree : str
        Degree of awareness; empty for the policies that do not learn.
    memory : int
        Number of the memory.
    """

    curves: Curves
    degree: str
    memory: int

    @property
    def key(self) -> tuple[str, ...]:
        """See `Job`."""
        return ("learning curves", str(self.curves.conditions()), self.degree, str(self.memory))

    @property
    def cost(self) -> float:
        """See `Job`: a lazy learner compares all inputs of its transitions."""
        if not self.degree:
            return _COST
        inputs = sum(AWARENESS[self.degree]().width(self.curves.robots))
        return _COST * (10.0 + inputs * sum(self.curves.samples) / 20_000)

    def describe(self) -> str:
        """See `Job`."""
        return f"the learning curves, {self.degree or 'policies that do not learn'}, memory {self.memory}"

    def make(self, worlds: ReusedWorlds) -> list[dict[str, Any]]:
        """Return the rows of the job; see `make_curves`."""
        return _learnt_rows(self) if self.degree else _designed_rows(self)


def curve_jobs(curves: Curves) -> list[CurveJob]:
    """Return the jobs of learning curves."""
    degrees = ("", *curves.degrees)
    return [CurveJob(curves, degree, memory) for memory in range(curves.memories) for degree in degrees]


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
        One row a learner, degree, number of transitions, memory and world: learner, degree, transitions, inputs,
        log10_size (of the search space p^d with p = 2), memory, replicate, seed, observed_fraction, which is NaN where
        a table would have too many states. The random walk and A-CMOMMT have 0 transitions.

    Raises
    ------
    JobError
        If a job fails; the message contains its settings.
    """
    rows = run_all(curve_jobs(curves), pool, progress=progress, checkpoint=checkpoint)
    return pd.concat([pd.DataFrame(part) for part in rows], ignore_index=True)


def _learnt_rows(job: CurveJob) -> list[dict[str, Any]]:
    curves, degree = job.curves, job.degree
    everything = explore(curves.exploration(degree, job.memory))
    rows = []
    for transitions in curves.samples:
        whole = transitions == len(everything)
        memory = everything if whole else everything.sample(transitions, seed=job.memory)
        about = {"degree": degree, "transitions": transitions}
        about |= {"inputs": memory.inputs, "log10_size": log10_size(memory.inputs)}
        for name in curves.learners:
            try:
                policy = learn(name, memory, curves.objective)
            except TooManyStatesError:
                policy = None
            rows += _evaluated(job, {"learner": name} | about, policy, awareness_for(memory))
    return rows


def _designed_rows(job: CurveJob) -> list[dict[str, Any]]:
    rows = []
    for name, policy, degree in (
        (RANDOM, RandomWalk(), NoAwareness()),
        (DESIGNED, ACmommt(idle="wander"), PairwiseAwareness()),
    ):
        inputs = sum(degree.width(job.curves.robots))
        about = {"learner": name, "degree": degree.name, "transitions": 0}
        about |= {"inputs": inputs, "log10_size": log10_size(inputs)}
        rows += _evaluated(job, about, policy, degree)
    return rows


def _evaluated(job: CurveJob, about: dict[str, Any], policy: Any, degree: Awareness) -> list[dict[str, Any]]:
    """Return a row for each world on which a policy is evaluated; all policies of a memory get the same worlds."""
    curves = job.curves
    replicates = range(job.memory * curves.worlds, (job.memory + 1) * curves.worlds)
    seeds = [model_seed(curves.seed, one, curves.robots, curves.targets, curves.radius) for one in replicates]
    observed = [float("nan")] * curves.worlds
    if policy is not None:
        parameters: dict[str, Any] = {"robots": curves.robots, "targets": curves.targets, "radius": curves.radius}
        parameters |= {"policy": policy, "awareness": degree}
        found = run_all([Run(parameters, seed, curves.steps) for seed in seeds])
        observed = [outcome.observed_fraction for outcome in found]
    return [
        about | {"memory": job.memory, "replicate": replicate, "seed": seed, "observed_fraction": share}
        for replicate, seed, share in zip(replicates, seeds, observed, strict=True)
    ]
