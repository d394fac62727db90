"""Evolution: shape the learned rule by CMA-ES on whole worlds, with a log from which it goes on.

The log holds what every candidate was worth, generation by generation. Candidates are not stored: asked again with
the same seed, the strategy proposes the same ones; so an interrupted evolution is played back and goes on as if it had
not been, to the last bit.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.analysis.runs.experiment import Grid
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.policies.evolved.layout import beginning, spreads

Floats = npt.NDArray[np.float64]

#: The worlds in which the learned rule is to be better.
GRID = Grid((5, 10, 15, 20, 25, 30), tuple(float(radius) for radius in range(2, 10)))
#: Root seeds below 0, which no command accepts: what is shaped on one is never judged on it.
TRAIN, VALIDATE, SCREEN, TEST = (root(f"evolution: {part}") for part in ("train", "validate", "screen", "test"))
TARGETS, STEPS, DELTA = 15, 600, 16
# In a more crowded arena nearly everything is observed whatever the robots do: nothing is to be learned there.
_CROWDED = 2.0
LOG = "evolution.jsonl"


class LogError(ValueError):
    """Raised when a log belongs to another evolution, or cannot be read."""


@dataclass(frozen=True)
class Evolution:
    """What decides an evolution.

    Parameters
    ----------
    population : int
        Candidates of a generation.
    spread : float
        Standard deviation of the first generation; twice as much in the hidden neurons, whose weights are larger.
    seed : int
        Of the candidates and of the hidden neurons at the beginning.
    """

    population: int = 40
    spread: float = 0.07
    seed: int = 1


class Job(NamedTuple):
    """A candidate to be tried, and the generation, which decides the worlds."""

    constants: Floats
    generation: int


class Generation(NamedTuple):
    """What stands after a generation."""

    number: int
    #: The mean worth of its candidates.
    worth: float
    #: The mean of the search distribution: the rule found so far.
    mean: Floats


def cells() -> list[tuple[int, float]]:
    """Return the worlds (robots, radius) of every trial."""
    return [(robots, radius) for robots, radius in GRID.cells if robots <= _CROWDED * radius**2]


def steps_a_trial() -> int:
    """Return how many robot-steps a trial takes: its cost in samples."""
    return STEPS * sum(robots for robots, _ in cells())


def worth(job: Job) -> float:
    """Return the share of targets observed, averaged over the worlds; all candidates of a generation meet the same."""
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.policies.evolved import Evolved

    policy = Evolved(tuple(job.constants))
    total = 0.0
    for robots, radius in cells():
        seed = model_seed(TRAIN, job.generation, robots, TARGETS, radius)
        model = CMOMMT(robots, TARGETS, radius, policy, "ring", DELTA, rng=seed)
        model.run(STEPS)
        total += model.observed_fraction
        model.close()
    return total / len(cells())


def evolve(evolution: Evolution, generations: int, folder: Path, pool: WorkerPool) -> Iterator[Generation]:
    """Yield every generation, those of the log in `folder` first.

    Parameters
    ----------
    evolution : Evolution
        What decides it.
    generations : int
        How many in all.
    folder : Path
        Where its log is kept.
    pool : WorkerPool
        Who tries the candidates.

    Raises
    ------
    LogError
        If the log in `folder` is that of another evolution.
    """
    strategy = _strategy(evolution)
    path = folder / LOG
    for worths in _played(path, evolution)[:generations]:
        strategy.tell(strategy.ask(), [-value for value in worths])
        yield Generation(strategy.countiter, float(np.mean(worths)), np.array(strategy.mean, float))
    with path.open("a", encoding="utf-8") as log:
        while strategy.countiter < generations:
            candidates = strategy.ask()
            jobs = [Job(np.asarray(one), strategy.countiter) for one in candidates]
            worths = pool.map(worth, jobs, describe=lambda job: f"a candidate of generation {job.generation}")
            strategy.tell(candidates, [-value for value in worths])
            log.write(json.dumps(worths) + "\n")
            log.flush()
            yield Generation(strategy.countiter, float(np.mean(worths)), np.array(strategy.mean, float))


def _cma() -> Any:
    try:
        import cma
    except ModuleNotFoundError:
        raise ModuleNotFoundError("evolution needs the package cma: pip install 'teamsight[evolve]'") from None
    return cma


def _strategy(evolution: Evolution) -> Any:
    rng = np.random.default_rng(evolution.seed)
    options = {
        "popsize": evolution.population,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,
        "verbose": -9,
        "CMA_stds": spreads(),
        # Noise would be taken for convergence.
        "tolfun": 0, "tolfunhist": 0, "tolflatfitness": np.inf, "tolstagnation": np.inf, "tolx": 0,
    }  # fmt: skip
    return _cma().CMAEvolutionStrategy(beginning(evolution.seed), evolution.spread, options)


def _played(path: Path, evolution: Evolution) -> list[list[float]]:
    """Return the generations of a log, which is begun where there is none."""
    head = json.dumps({"cma": _cma().__version__, **asdict(evolution)})
    if not path.exists():
        path.write_text(head + "\n", encoding="utf-8")
        return []
    text = path.read_text(encoding="utf-8")
    whole, _, rest = text.rpartition("\n")
    if rest:
        # Cut off while it was written.
        path.write_text(whole + "\n" if whole else head + "\n", encoding="utf-8")
    lines = whole.split("\n")
    if whole and lines[0] != head:
        raise LogError(f"{path}: was begun with {lines[0]}, not {head}; give another folder")
    return [json.loads(line) for line in lines[1:]]
