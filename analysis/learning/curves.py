"""Learning curves: what learners observe from equal numbers of transitions, and the gain from awareness."""

from __future__ import annotations

import math
import warnings
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.agents.awareness import Awareness, NoAwareness, PairwiseAwareness
from teamsight.analysis.learning.evaluation import BY_HAND, DESIGNED, RANDOM
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.learners import LearningJob, awareness_for, learn, made_rows
from teamsight.analysis.learning.plans import Curves
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.search_space import log10_size
from teamsight.analysis.stats.paired import half_width
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.lazy.learner import LazyLearner
from teamsight.policies.lazy.sheppard_lazy_q import SheppardLazyQ
from teamsight.policies.memory import LazyMemory

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds

#: Name under which the best learner with awareness is compared with the best one without.
BEST = "best"
_SCENARIO = ["robots", "radius"]
_POINT = ["learner", "transitions"]


def can_learn(curves: Curves, learner: str, transitions: int) -> bool:
    """Return whether so many transitions are as many as a learner matches with a situation."""
    kind = LEARNERS[learner]
    if not issubclass(kind, LazyLearner):
        return True
    return transitions >= (kind.k if curves.k is None else curves.k)


class CurveJob(LearningJob):
    """One learner, or the policies that do not learn, with all numbers of transitions of one memory."""

    @property
    def cost(self) -> float:  # type: ignore[override]
        """See `Job`: a lazy learner compares its transitions at each decision."""
        if not self.learner:
            return LearningJob.cost
        compares = issubclass(LEARNERS[self.learner], LazyLearner)
        return LearningJob.cost * (10.0 + (5.0 if compares else 1.0) * float(sum(self.settings.samples)) / 7_500)

    def make(self, worlds: ReusedWorlds) -> list[dict[str, Any]]:
        """Return the rows of the job; see `make_curves`."""
        return _learnt_rows(self) if self.learner else _designed_rows(self)


def curve_jobs(curves: Curves) -> list[CurveJob]:
    """Return the jobs of learning curves."""
    learners = ("", *curves.learners)
    return [CurveJob(curves, memory, learner) for memory in range(curves.memories) for learner in learners]


def make_curves(curves: Curves, pool: Executor | None = None, **how: Any) -> pd.DataFrame:
    """Explore, learn, and evaluate.

    Parameters
    ----------
    curves : Curves
        The settings.
    pool : Executor, optional
        Processes that do the work; by default this process. The table does not depend on it.
    **how
        checkpoint, the file of the rows of finished jobs, and progress; see `run_all`.

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
    return made_rows(curve_jobs(curves), pool, **how)


def search_space(policy: Any) -> float:
    """Return log10 of how many values a learner has to learn.

    A table has one for each state and action, a linear approximator its weights, a regression its slopes. Learners that
    compare whole situations distinguish at least p^d of them, with p = 2 and d inputs.
    """
    if isinstance(policy, LazyLearner | SheppardLazyQ):
        return log10_size(policy.inputs)
    return math.log10(policy.learned.size)


def _learnt_rows(job: CurveJob) -> list[dict[str, Any]]:
    curves = job.settings
    everything = explore(Exploration(**curves.exploration(job.memory)))
    rows = []
    for transitions in curves.samples:
        memory = everything.sample(transitions, seed=job.memory)
        for inputs in (memory.own, memory.inputs):
            policy = _learnt(job, memory, inputs) if can_learn(curves, job.learner, transitions) else None
            size = float("nan") if policy is None else search_space(policy)
            about = {"learner": job.learner, "transitions": transitions, "log10_size": size}
            rows += _evaluated(job, about, policy, awareness_for(memory, inputs))
    return rows


def _learnt(job: CurveJob, memory: LazyMemory, inputs: int) -> Any:
    with warnings.catch_warnings():
        # Too few transitions are what the curves are about.
        warnings.simplefilter("ignore", UserWarning)
        return learn(job.learner, memory, job.settings.objective, inputs=inputs)


def _designed_rows(job: CurveJob) -> list[dict[str, Any]]:
    designed = {RANDOM: (RandomWalk(), NoAwareness()), DESIGNED: (ACmommt(idle="wander"), PairwiseAwareness())}
    rows = []
    for name, (policy, degree) in (designed | BY_HAND).items():
        rows += _evaluated(job, {"learner": name, "transitions": 0, "log10_size": float("nan")}, policy, degree)
    return rows


def _evaluated(job: CurveJob, about: dict[str, Any], policy: Any, degree: Awareness) -> list[dict[str, Any]]:
    """Return a row for each world in which a policy is evaluated; all policies of a memory get the same worlds."""
    curves = job.settings
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


def awareness_gains(table: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return what each learner observes without and with awareness, and the gain with its interval over memories.

    Parameters
    ----------
    table : DataFrame
        From `make_curves`.
    level : float
        Confidence of the intervals.

    Returns
    -------
    DataFrame
        learner, transitions, robots, radius, log10_size (with awareness), collective, cooperative, gain, low, high,
        worst (the least that a memory gave with awareness), count (of memories). The mean over all scenarios has NaN as
        robots and radius. The gain is paired on explorations and worlds; all worlds of a memory are one trial. Points
        without an observed fraction are left out; policies that do not learn have no gain.

    Notes
    -----
    The rows of the learner "best" compare, at each point, the learner of the largest mean with awareness and the one of
    the largest mean without: a gain over a learner that is poor without awareness is no evidence for awareness.
    """
    by = [*_POINT, *_SCENARIO, "memory"]
    kept = table.dropna(subset="observed_fraction")
    kept = kept.assign(degree=kept["degree"].where(kept["degree"] == "none", "other"))
    trials = kept.pivot_table("observed_fraction", by, "degree", sort=False).rename_axis(columns=None).reset_index()
    trials = trials.rename(columns={"none": "collective", "other": "cooperative"})
    trials = pd.concat([trials, _best(trials[trials["transitions"] > 0])], ignore_index=True)
    trials["gain"] = trials["cooperative"] - trials["collective"]
    means = trials.groupby([*_POINT, "memory"], sort=False)[["collective", "cooperative", "gain"]].mean().reset_index()
    parts = [_intervals(trials, [*_POINT, *_SCENARIO], level), _intervals(means, _POINT, level)]
    gains = pd.concat(parts, ignore_index=True)
    gains["log10_size"] = gains["learner"].map(kept.groupby("learner")["log10_size"].max())
    values = ["log10_size", "collective", "cooperative", "gain", "low", "high", "worst", "count"]
    return gains[[*_POINT, *_SCENARIO, *values]]


def _best(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the trials of the best learner at each point, chosen separately with and without awareness."""
    point = ["transitions", *_SCENARIO]
    means = trials.groupby(["learner", *point], sort=False)[["cooperative", "collective"]].mean()
    found = trials[[*point, "memory"]].drop_duplicates().assign(learner=BEST)
    for which in ("cooperative", "collective"):
        chosen = means[which].groupby(point, sort=False).idxmax()
        of = trials.set_index(["learner", *point]).loc[list(chosen)].reset_index()
        found = found.merge(of[[*point, "memory", which]], on=[*point, "memory"])
    return found


def _intervals(trials: pd.DataFrame, by: list[str], level: float) -> pd.DataFrame:
    """Return the means over the memories of each point, with the interval of the gain."""
    points = trials.groupby(by, sort=False)
    means = points[["collective", "cooperative", "gain"]].mean()
    spread = points["gain"].agg(se="sem", count="count")
    wide = half_width(spread["se"].to_numpy(), spread["count"].to_numpy(), level)
    means = means.assign(low=means["gain"] - wide, high=means["gain"] + wide, worst=points["cooperative"].min())
    return means.assign(count=points.size()).reset_index()


def crossings(gains: pd.DataFrame) -> pd.DataFrame:
    """Return from how many transitions awareness pays, for each learner and scenario.

    It is the smallest number of transitions from which the lower end of the gain's interval stays above 0, at this and
    at all larger numbers, of which there must be one: the largest number alone is too easily decided by noise, once in
    forty times for intervals of 95 %.

    Parameters
    ----------
    gains : DataFrame
        From `awareness_gains`.

    Returns
    -------
    DataFrame
        learner, log10_size, robots, radius, crossing (transitions; NaN if there is none), largest (number of
        transitions).
    """
    learned = gains[gains["transitions"] > 0].sort_values("transitions", kind="stable")
    rows = []
    for place, points in learned.groupby(["learner", "log10_size", *_SCENARIO], sort=False, dropna=False):
        above = (points["low"] > 0).to_numpy()
        stays = np.logical_and.accumulate(above[::-1])[::-1]
        numbers = points["transitions"].to_numpy()
        crossing = float(numbers[stays].min()) if stays.sum() > 1 else np.nan
        rows.append((*place, crossing, int(numbers.max())))
    return pd.DataFrame(rows, columns=["learner", "log10_size", *_SCENARIO, "crossing", "largest"])


def mean_gains(gains: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of `awareness_gains` or `crossings` that are means over all scenarios."""
    return gains[gains["robots"].isna()]


def pays_from(crossing: float, largest: int) -> str:
    """Return a crossing in words, as in "pays from 600 transitions"."""
    if np.isnan(crossing):
        return f"is not shown to pay within {largest:,} transitions"
    return f"pays from {int(crossing):,} transitions"
