"""Diagnosis of learners: how actions affect the reward, what eq. 1 matches, and whether learned moves approach targets.

All three are measured for situations that show a single target, against its distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.learners import LearningJob, learn, made_rows
from teamsight.analysis.learning.plans import Diagnosis, Objective
from teamsight.analysis.learning.registry import REWARDS
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.stats.paired import cell_means
from teamsight.core.neighbour_list import no_neighbours
from teamsight.policies.eager import TooManyStatesError
from teamsight.policies.interface import Floats, Percept
from teamsight.policies.lazy.lazy_q import LazyQ
from teamsight.policies.lazy.readings import unit_vectors
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import Reward, rewards_of

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds

#: Number of intervals of equal width into which distances are divided.
BINS = 20
#: The middle of each interval [sensing ranges].
DISTANCES: Floats = (np.arange(BINS) + 0.5) / BINS
# Toward a target: within 45° of its bearing, by more than half a step. Away from it: the same, in the other direction.
_NEAR_BEARING, _HALF_STEP = math.cos(math.pi / 4), 0.5
# Columns of a point, which is a mean over explorations.
_POINT = ("quantity", "learner", "inputs", "transitions", "distance")


def memory_of(diagnosis: Diagnosis, number: int, transitions: int) -> LazyMemory:
    """Return the first transitions of an exploration; where they end within a world, a sample of all."""
    plan = Exploration(**diagnosis.exploration(number, transitions))
    memory = explore(plan)
    return memory if len(memory) == transitions else memory.sample(transitions, seed=plan.seed)


class DiagnosisJob(LearningJob):
    """The diagnosis of one exploration."""

    def make(self, worlds: ReusedWorlds) -> list[dict[str, Any]]:
        """Return the rows of the job; see `diagnose_explorations`."""
        found = _rows(self.settings, lambda transitions: memory_of(self.settings, self.memory, transitions))
        return [row | {"memory": self.memory} for row in found]


def diagnosis_jobs(diagnosis: Diagnosis) -> list[DiagnosisJob]:
    """Return the jobs of a diagnosis, one for each exploration."""
    return [DiagnosisJob(diagnosis, number) for number in range(diagnosis.memories)]


def diagnose_explorations(diagnosis: Diagnosis, pool: Executor | None = None, **how: Any) -> pd.DataFrame:
    """Explore, learn and measure.

    Parameters
    ----------
    diagnosis : Diagnosis
        The settings.
    pool : Executor, optional
        Processes that do the work; by default this process. The table does not depend on it.
    **how
        checkpoint, the file of the rows of finished explorations, and progress; see `run_all`.

    Returns
    -------
    DataFrame
        One row a measurement: quantity, learner, inputs, transitions, distance (the middle of an interval) [sensing
        ranges], memory, value. The quantities are "toward", "away" and "effect", see `action_effect`, and "rewarded by
        chance", the share of all transitions with a reward above 0, from the most transitions; "matches", see
        `matched_share`; "matches by chance", see `shown_share`; "approach", see `approach`; and for the learner "lazy"
        "rewarded", see `rewarded_share`.
    """
    return made_rows(diagnosis_jobs(diagnosis), pool, **how)


def diagnose_memory(diagnosis: Diagnosis, memory: LazyMemory) -> pd.DataFrame:
    """Return the same table for samples of one memory.

    Parameters
    ----------
    diagnosis : Diagnosis
        The settings; `memories` is not used.
    memory : LazyMemory
        It has at least as many transitions as the largest of `samples`.
    """
    found = _rows(diagnosis, lambda transitions: memory.sample(transitions, seed=diagnosis.seed))
    return pd.DataFrame([row | {"memory": 0} for row in found])


def diagnosis_points(table: pd.DataFrame) -> pd.DataFrame:
    """Return the mean of each quantity over the explorations, with its 95 % interval.

    Returns
    -------
    DataFrame
        quantity, learner, inputs, transitions, distance, mean, se, low, high, count; the interval of one exploration is
        infinite.
    """
    return cell_means(table.dropna(subset="value"), "value", _POINT)


def _rows(diagnosis: Diagnosis, memory_of: Callable[[int], LazyMemory]) -> Iterator[dict[str, Any]]:
    most = max(diagnosis.samples)
    for transitions in diagnosis.samples:
        memory = memory_of(transitions)
        about = {"learner": "", "inputs": memory.own, "transitions": transitions}
        yield from _each("matches by chance", about, np.full(BINS, shown_share(memory)))
        if transitions == most:
            reward = REWARDS[diagnosis.reward]
            toward, away = action_effect(memory, reward)
            rewarded = np.full(BINS, (rewards_of(memory, reward) > 0.0).mean())
            found = {"toward": toward, "away": away, "effect": toward - away, "rewarded by chance": rewarded}
            for quantity, values in found.items():
                yield from _each(quantity, about, values)
        for inputs in dict.fromkeys((memory.own, memory.inputs)):
            about = {"learner": "", "inputs": inputs, "transitions": transitions}
            yield from _each("matches", about, matched_share(memory, inputs, diagnosis.matches))
            for name in diagnosis.learners:
                yield from _learned_rows(name, memory, about | {"learner": name}, diagnosis.objective)


def _learned_rows(
    name: str, memory: LazyMemory, about: dict[str, Any], objective: Objective
) -> Iterator[dict[str, Any]]:
    try:
        policy = learn(name, memory, objective, inputs=about["inputs"])
    except TooManyStatesError:
        return
    yield from _each("approach", about, approach(policy))
    if isinstance(policy, LazyQ):
        yield from _each("rewarded", about, rewarded_share(policy))


def _each(quantity: str, about: dict[str, Any], values: Floats) -> Iterator[dict[str, Any]]:
    for distance, value in zip(DISTANCES.tolist(), values.tolist(), strict=True):
        yield {"quantity": quantity} | about | {"distance": distance, "value": value}


def action_effect(memory: LazyMemory, reward: Reward) -> tuple[Floats, Floats]:
    """Return the mean reward of moves toward a target, and of those away from it, by the distance of the target.

    Situations count that show a single target. A move goes toward it if it is more than half a step and within 45° of
    the target's bearing, and away from it in the same way.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    reward : callable
        See `teamsight.policies.rewards`.

    Returns
    -------
    toward, away : ndarray, shape (BINS,), float64
        NaN without such a move.
    """
    own = np.asarray(memory.situation[:, : memory.own])
    single = np.flatnonzero((own < 1.0).sum(axis=1) == 1)
    sector = (own[single] < 1.0).argmax(axis=1)
    place = np.minimum((own[single, sector] * BINS).astype(np.int64), BINS - 1)
    rotation, share = np.asarray(memory.action, float)[single].T
    along = np.cos(rotation - 2.0 * math.pi * sector / memory.own)
    rewards = rewards_of(memory, reward)[single]
    far = share > _HALF_STEP
    toward, away = (_mean_by(place, rewards, far & (side * along > _NEAR_BEARING)) for side in (1.0, -1.0))
    return toward, away


def _mean_by(place: npt.NDArray[np.int64], values: Floats, chosen: npt.NDArray[np.bool_]) -> Floats:
    count = np.bincount(place[chosen], minlength=BINS)
    total = np.bincount(place[chosen], values[chosen], minlength=BINS)
    return np.asarray(np.divide(total, count, out=np.full(BINS, np.nan), where=count > 0))


def single_targets(own: int, inputs: int) -> npt.NDArray[np.float32]:
    """Return the situations that show one target at one of `DISTANCES` and nothing else.

    Returns
    -------
    ndarray, shape (BINS, own, inputs), float32
        By distance and sector.
    """
    found = np.ones((BINS, own, inputs), np.float32)
    sectors = np.arange(own)
    found[:, sectors, sectors] = DISTANCES[:, np.newaxis]
    return found


def matched_share(memory: LazyMemory, inputs: int, k: int) -> Floats:
    """Return how many of the transitions that match a single target show one where it is, by its distance.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    inputs : int
        Number of components that are compared.
    k : int
        Number of nearest transitions.

    Returns
    -------
    ndarray, shape (BINS,), float64
        The share of the k nearest situations with a target in the same sector or the next one on either side, averaged
        over the sectors.
    """
    own = memory.own
    queries = single_targets(own, inputs).reshape(-1, inputs)
    index, _ = memory.nearest(queries, k, inputs)
    shown = np.asarray(memory.situation[:, :own])[index].reshape(BINS, own, k, own) < 1.0
    near = _within_one_sector(own)
    return np.asarray((shown & near[:, np.newaxis]).any(axis=-1).mean(axis=(1, 2)))


def shown_share(memory: LazyMemory) -> float:
    """Return the same share for transitions drawn at random: how many show a target near a given sector."""
    shown = np.asarray(memory.situation[:, : memory.own]) < 1.0
    return float((shown[:, np.newaxis] & _within_one_sector(memory.own)).any(axis=-1).mean())


def _within_one_sector(own: int) -> npt.NDArray[np.bool_]:
    sectors = np.arange(own)
    apart = (sectors - sectors[:, np.newaxis]) % own
    return np.asarray(np.minimum(apart, own - apart) <= 1)


def rewarded_share(policy: LazyQ) -> Floats:
    """Return how often the transition whose action `LazyQ` repeats was rewarded, by the distance of a single target.

    Returns
    -------
    ndarray, shape (BINS,), float64
        The share of situations, one for each sector, whose chosen transition has a reward above 0.
    """
    memory, inputs = policy.memory, policy.inputs
    queries = single_targets(memory.own, inputs).reshape(-1, inputs)
    index, _ = memory.nearest(queries, policy.k, inputs)
    best = np.take_along_axis(index, policy.values[index].argmax(axis=1)[:, np.newaxis], axis=1)
    rewarded = rewards_of(memory, policy.reward)[best] > 0.0
    return np.asarray(rewarded.reshape(BINS, memory.own).mean(axis=1))


def approach(policy: Any) -> Floats:
    """Return by how much of a step a policy's moves approach a single target, by the target's distance.

    Parameters
    ----------
    policy : Learner
        A learner whose actions depend on the situation alone.

    Returns
    -------
    ndarray, shape (BINS,), float64
        Share of the full step · cos(rotation − bearing of the target), averaged over the sectors: 1 is a full step
        toward the target, −1 a full step away from it.
    """
    own, inputs = policy.memory.own, policy.inputs
    situation = single_targets(own, inputs).reshape(-1, inputs)
    size = len(situation)
    heading, speed, nobody = np.tile([1.0, 0.0], (size, 1)), np.ones(size), no_neighbours(size)
    percept = Percept(heading, np.zeros((size, 2)), speed, speed, speed, nobody, nobody, nobody, situation)
    action, _ = policy.decide(percept, policy.start(size), np.zeros((policy.draws, size)))
    bearing = np.tile(unit_vectors(own, 0, ""), (BINS, 1))
    gained = action.distance * (action.heading * bearing).sum(axis=1)
    return np.asarray(gained.reshape(BINS, own).mean(axis=1))
