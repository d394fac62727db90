"""Learning curves: what learners observe under each degree of awareness, from equal numbers of samples."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from teamsight.agents.awareness import AWARENESS, Awareness, NoAwareness, PairwiseAwareness
from teamsight.analysis.learning.evaluation import DESIGNED, RANDOM, Stage
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.learners import LEARNERS, REWARDS, Lesson, awareness_for, learn
from teamsight.analysis.runs import files
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.runs.workers import JobError, WorkerPool
from teamsight.analysis.search_space import log10_size
from teamsight.core import checks
from teamsight.policies.eager.state_grid import TooManyStatesError
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.random_walk import RandomWalk

#: From a quarter of the paper's memory to 64 of them.
SAMPLES = (150, 300, 600, 1200, 2400, 4800, 9600, 19200, 38400)


@dataclass(frozen=True)
class Curves:
    """What is learned, from how much, and where it is put to the test.

    Parameters
    ----------
    degrees, learners : tuple of str
        Names of degrees of awareness and of learners.
    samples : tuple of int
        Numbers of pairs.
    memories : int
        How many explorations; each gives every learner its pairs.
    worlds : int
        On how many worlds each is put to the test.
    robots, targets, radius, steps
        Of these worlds. The explorations have as many robots, for Θ(N) and o(N) ask for it, and otherwise the paper's
        120 steps among 10 targets.
    seed : int
        Of everything.
    reward : str
        "own", "team" or "alone".
    discount : float
        Discount factor γ, in [0, 1].
    k : int, optional
        How many pairs match a situation; by default what each learner has.

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
        for pairs in self.samples:
            checks.count("samples", pairs)

    @property
    def lesson(self) -> Lesson:
        """What is to be learned."""
        return Lesson(REWARDS[self.reward], self.k, self.discount)

    @property
    def stage(self) -> Stage:
        """Where it is put to the test."""
        return Stage(self.robots, self.targets, self.radius, self.memories * self.worlds, self.steps, self.seed)

    def exploration(self, degree: str, memory: int) -> Exploration:
        """Return the exploration that gives a memory its pairs; memories share none."""
        steps = Exploration.steps
        runs = -(-max(self.samples) // (self.robots * steps))
        seed = self.seed + memory
        return Exploration(
            robots=self.robots, radius=self.radius, steps=steps, runs=runs, awareness=AWARENESS[degree](), seed=seed
        )

    def conditions(self) -> dict[str, Any]:
        """Return all settings, fit for JSON."""
        told = asdict(self)
        return {name: list(value) if isinstance(value, tuple) else value for name, value in told.items()}

    @cached_property
    def key(self) -> str:
        """What the names of its unfinished files begin with, and those of no other curves."""
        return files.key_of(self.conditions())


class Lecture(NamedTuple):
    """One memory under one degree: all learners, all numbers of samples; `degree` empty for those that do not learn."""

    curves: Curves
    degree: str
    memory: int
    folder: Path | None

    @property
    def file(self) -> Path | None:
        """Where its rows are kept."""
        name = f"{self.curves.key}-{self.degree or 'designed'}-{self.memory}.parquet"
        return self.folder / name if self.folder else None


def make_curves(
    curves: Curves,
    pool: WorkerPool,
    *,
    folder: Path | None = None,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> pd.DataFrame:
    """Explore, learn, and put to the test.

    Parameters
    ----------
    curves : Curves
        What.
    pool : WorkerPool
        Who does the work; the table does not depend on it.
    folder : Path, optional
        Where to keep what is done. What is found there of the same curves is not made again.
    progress : callable
        Called with the work done and the work in all, in arbitrary units.

    Returns
    -------
    DataFrame
        One row a learner, degree, number of pairs, memory and world: learner, degree, pairs, inputs, log10_size (of the
        search space p^d with p = 2), memory, replicate, seed, observed_fraction. Where a table would have too many
        states, the row has no observed fraction. The random walk and A-CMOMMT are there for comparison, with 0 pairs.

    Raises
    ------
    JobError
        If something fails; the message tells what.
    """
    if folder is not None:
        files.prepare_folder(folder, follow=False)
    lectures = _lectures(curves, folder)
    costs = [_cost(lecture) for lecture in lectures]
    done, total = 0.0, sum(costs)
    progress(done, total)

    def count(index: int) -> None:
        nonlocal done
        done += costs[index]
        progress(done, total)

    tables = pool.map(
        _give, lectures, count, lambda lecture: f"{lecture.degree or 'A-CMOMMT'}, memory {lecture.memory}"
    )
    return pd.concat(tables, ignore_index=True)


def kept_lectures(curves: Curves, folder: Path) -> tuple[int, int]:
    """Return how much of the work on learning curves is kept in a folder, and how much there is, in equal portions."""
    files = [lecture.file for lecture in _lectures(curves, folder)]
    return sum(file is not None and file.exists() for file in files), len(files)


def forget_lectures(curves: Curves, folder: Path) -> None:
    """Delete the unfinished work on learning curves from a folder, and the folder if nothing else is in it."""
    files.forget(folder, curves.key)


def _lectures(curves: Curves, folder: Path | None) -> list[Lecture]:
    degrees = ("", *curves.degrees)
    return [Lecture(curves, degree, memory, folder) for memory in range(curves.memories) for degree in degrees]


def _cost(lecture: Lecture) -> float:
    """Return about how much work a lecture is: a lazy learner looks through all inputs of its pairs."""
    if not lecture.degree:
        return 1.0
    inputs = sum(AWARENESS[lecture.degree]().width(lecture.curves.robots))
    return 10.0 + inputs * sum(lecture.curves.samples) / 20_000


def _give(lecture: Lecture) -> pd.DataFrame:
    """Return the rows of a lecture, from its file if they were made before."""
    told = lecture.curves.conditions()
    if lecture.file is not None and lecture.file.exists():
        # One that is damaged is made again.
        with contextlib.suppress(OSError, ValueError):
            found = pd.read_parquet(lecture.file)
            if found.attrs.get("curves") == told:
                return found
    try:
        rows = _learned(lecture) if lecture.degree else _designed(lecture)
    except Exception as error:
        raise JobError(f"{error} (in the learning curves, {lecture.degree}, memory {lecture.memory})") from error
    table = pd.DataFrame(rows)
    if lecture.file is not None:
        files.write_table(lecture.file, table, {"curves": told}, force=True)
    return table


def _learned(lecture: Lecture) -> list[dict[str, Any]]:
    curves, degree = lecture.curves, lecture.degree
    everything = explore(curves.exploration(degree, lecture.memory))
    rows = []
    for pairs in curves.samples:
        memory = everything if pairs == len(everything) else everything.sample(pairs, seed=lecture.memory)
        about = {
            "degree": degree, "pairs": pairs, "inputs": memory.inputs, "log10_size": log10_size(memory.inputs),
        }  # fmt: skip
        for name in curves.learners:
            try:
                policy = learn(name, memory, curves.lesson)
            except TooManyStatesError:
                policy = None
            rows += _tested(lecture, {"learner": name} | about, policy, awareness_for(memory))
    return rows


def _designed(lecture: Lecture) -> list[dict[str, Any]]:
    rows = []
    for name, policy, degree in (
        (RANDOM, RandomWalk(), NoAwareness()),
        (DESIGNED, ACmommt(idle="wander"), PairwiseAwareness()),
    ):
        inputs = sum(degree.width(lecture.curves.robots))
        about = {
            "learner": name, "degree": degree.name, "pairs": 0, "inputs": inputs, "log10_size": log10_size(inputs),
        }  # fmt: skip
        rows += _tested(lecture, about, policy, degree)
    return rows


def _tested(lecture: Lecture, about: dict[str, Any], policy: Any, degree: Awareness) -> list[dict[str, Any]]:
    """Return a row for each world on which a policy is put to the test; all policies of a memory meet the same."""
    curves, stage = lecture.curves, lecture.curves.stage
    place = {"robots": curves.robots, "targets": curves.targets, "radius": curves.radius}
    rows = []
    for replicate in range(lecture.memory * curves.worlds, (lecture.memory + 1) * curves.worlds):
        seed = stage.run_seed(replicate)
        observed = float("nan")
        if policy is not None:
            run = Run(place | {"policy": policy, "awareness": degree}, seed, curves.steps)
            observed = run_all([run])[0].observed_fraction
        rows.append(
            about | {"memory": lecture.memory, "replicate": replicate, "seed": seed, "observed_fraction": observed}
        )
    return rows
