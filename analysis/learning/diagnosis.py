"""Diagnosis of learners: how actions affect the reward, what eq. 1 matches, and whether learned moves approach targets.

All three are measured for situations that show a single target, against its distance; see `diagnosis_measures`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import pandas as pd

from teamsight.analysis.learning.diagnosis_measures import (
    BINS,
    DISTANCES,
    action_effect,
    approach,
    matched_share,
    rewarded_share,
    shown_share,
)
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.learners import Objective, learn
from teamsight.analysis.learning.registry import LEARNERS, REWARDS
from teamsight.analysis.runs.checkpoint import Checkpoint, code_digest
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.stats.paired import cell_means
from teamsight.core.component import Allowed, Component, Count, Index, Probability
from teamsight.policies.eager import TooManyStatesError
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.lazy_q import LazyQ
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import rewards_of

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds

#: Numbers of transitions: the paper's, and up to 64 times as many.
SAMPLES = (600, 2400, 9600, 38400)
# Columns of a point, which is a mean over explorations.
_POINT = ("quantity", "learner", "inputs", "transitions", "distance")
# Cost of a job for the runner, which puts each into a chunk of its own.
_COST = 250_000.0


@dataclass(frozen=True)
class Diagnosis(Component):
    """Settings of a diagnosis.

    Parameters
    ----------
    learners : tuple of str
        Names of learners; not "sheppard", whose moves are partly random.
    samples : tuple of int
        Numbers of transitions to learn from.
    memories : int
        Number of explorations, each with a seed of its own and otherwise the paper's: 5 robots, 10 targets, 120 steps.
        Each 600 transitions come from a world of their own.
    reward : str
        "own", "team", "alone" or "keep".
    discount : float
        Discount factor γ, in [0, 1].
    k : int, optional
        Number of transitions that match a situation; by default that of each learner.
    seed : int
        Seed of the first exploration; the others follow.

    Raises
    ------
    TypeError, ValueError
        If a name is unknown or a number too small.
    """

    learners: Annotated[tuple[Annotated[str, Allowed(choices=LEARNERS)], ...], Allowed()] = ("lazy", "regression")
    samples: Annotated[tuple[Count, ...], Allowed()] = SAMPLES
    memories: Count = 24
    reward: Annotated[str, Allowed(choices=REWARDS)] = "own"
    discount: Probability = 0.7
    k: Count | None = None
    seed: Index = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if "sheppard" in self.learners:
            raise ValueError("learner=sheppard: moves at random now and then, and learns meanwhile; leave it out")
        if min(self.samples) < self.matches:
            raise ValueError(
                f"samples={min(self.samples)}: fewer than the {self.matches} transitions that eq. 1 matches; give "
                "larger samples, or a smaller k"
            )

    @property
    def objective(self) -> Objective:
        """What is to be learnt."""
        return Objective(REWARDS[self.reward], self.k, self.discount)

    @property
    def matches(self) -> int:
        """Number of transitions that are matched with a situation: k, or that of `LazyQ`."""
        return LazyQ.k if self.k is None else self.k

    def memory(self, number: int, transitions: int) -> LazyMemory:
        """Return the first transitions of an exploration; where they end within a world, a sample of all."""
        runs = -(-transitions // Exploration().transitions)
        memory = explore(Exploration(runs=runs, seed=self.seed + number))
        return memory if len(memory) == transitions else memory.sample(transitions, seed=self.seed + number)

    def conditions(self) -> dict[str, Any]:
        """Return all settings as JSON values."""
        return as_json(self)

    def in_words(self, memory: LazyMemory | None = None) -> str:
        """Return the settings in a line; with `memory`, those of its diagnosis."""
        if memory is None:
            number = f"{self.memories} exploration" + ("s" if self.memories != 1 else "")
            source = f"mean and 95 % interval over {number}" if self.memories > 1 else f"{number}, no interval"
        else:
            source = f"samples of {len(memory)} transitions, digest {memory.digest}, no interval"
        k = "" if self.k is None else f", k = {self.k}"
        return f"{source}; reward {self.reward}, γ = {self.discount:g}{k}, seed {self.seed}"


@dataclass(frozen=True)
class _ExplorationJob:
    """The diagnosis of one exploration; see `Job`."""

    diagnosis: Diagnosis
    number: int

    @property
    def key(self) -> tuple[str, ...]:
        return ("diagnosis", str(self.diagnosis.conditions()), str(self.number), code_digest(__name__))

    @property
    def cost(self) -> float:
        return _COST

    def describe(self) -> str:
        return f"the diagnosis of exploration {self.number}"

    def make(self, worlds: ReusedWorlds) -> list[dict[str, Any]]:
        found = _rows(self.diagnosis, lambda transitions: self.diagnosis.memory(self.number, transitions))
        return [row | {"memory": self.number} for row in found]


def diagnosis_jobs(diagnosis: Diagnosis) -> list[_ExplorationJob]:
    """Return the jobs of a diagnosis, one for each exploration."""
    return [_ExplorationJob(diagnosis, number) for number in range(diagnosis.memories)]


def diagnose_explorations(
    diagnosis: Diagnosis,
    pool: WorkerPool | None = None,
    *,
    checkpoint: Checkpoint | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Explore, learn and measure.

    Parameters
    ----------
    diagnosis : Diagnosis
        The settings.
    pool : WorkerPool, optional
        Processes that do the work; by default this process. The table does not depend on it.
    checkpoint : Checkpoint, optional
        File of the rows of finished explorations.
    progress : callable
        Called with the work done and the work in all, in arbitrary units.

    Returns
    -------
    DataFrame
        One row a measurement: quantity, learner, inputs, transitions, distance (the middle of an interval) [sensing
        ranges], memory, value. The quantities are "toward", "away" and "effect", see `action_effect`, and "rewarded by
        chance", the share of all transitions with a reward above 0, from the most transitions; "matches", see
        `matched_share`; "matches by chance", see `shown_share`; "approach", see `approach`; and for the learner "lazy"
        "rewarded", see `rewarded_share`.
    """
    rows = run_all(diagnosis_jobs(diagnosis), pool, progress=progress, checkpoint=checkpoint)
    return pd.concat([pd.DataFrame(part) for part in rows], ignore_index=True)


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
