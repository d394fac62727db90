"""Evolve the constants of the evolved policy by CMA-ES, with a checkpoint from which an interrupted evolution resumes.

The checkpoint holds the fitness of every candidate, generation by generation. Candidates are not stored, because with
the same seed the strategy proposes the same ones: an interrupted evolution is replayed and then continues with the same
bits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.analysis.runs.checkpoint import Checkpoint, Key, code_digest
from teamsight.analysis.runs.experiment import Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import run_all
from teamsight.core.extras import extra
from teamsight.policies.evolved import beginning, spreads

Floats = npt.NDArray[np.float64]

#: The worlds on which the evolved policy is compared.
GRID = Grid((5, 10, 15, 20, 25, 30), tuple(float(radius) for radius in range(2, 10)))
#: Root seeds. Each purpose has its own, so that no result is reported on worlds that shaped it.
TRAIN, TRAIN_FURTHER, VALIDATE, SCREEN, TEST, GENERALISE = (
    root(f"evolution: {part}") for part in ("train", "train further", "validate", "screen", "test", "generalise")
)
TARGETS, STEPS, DELTA = 15, 600, 16
# Largest team in training, in units of R². Larger teams observe nearly all targets whatever they do.
_CROWDED = 2.0


@dataclass(frozen=True)
class Evolution:
    """Parameters of an evolution.

    Parameters
    ----------
    population : int
        Candidates of a generation.
    spread : float
        Standard deviation of the first generation; twice as much for the weights of hidden neurons, which are larger.
    seed : int
        Seed of the candidates and of the initial hidden neurons.
    start : tuple of float
        Constants of an earlier evolution, with which this one begins; by default those of `beginning`.
    """

    population: int = 40
    spread: float = 0.07
    seed: int = 1
    start: tuple[float, ...] = ()

    @property
    def root(self) -> int:
        """Root seed of the worlds: an evolution that begins with the result of another has other worlds."""
        return TRAIN_FURTHER if self.start else TRAIN

    def begin(self) -> Floats:
        """Return the initial mean of the search distribution."""
        return np.array(self.start) if self.start else beginning(self.seed)


class Generation(NamedTuple):
    """The state after a generation.

    Attributes
    ----------
    number : int
        Number of generations so far.
    fitness : float
        Mean fitness of the candidates.
    mean : ndarray of float64
        Mean of the search distribution: the constants found so far.
    """

    number: int
    fitness: float
    mean: Floats


def cells() -> list[tuple[int, float]]:
    """Return the worlds (robots, radius) in which every candidate is tried."""
    return [(robots, radius) for robots, radius in GRID.cells if robots <= _CROWDED * radius**2]


def robot_steps() -> int:
    """Return the robot-steps of one candidate's trial, its cost in samples."""
    return STEPS * sum(robots for robots, _ in cells())


def fitness(
    candidates: Sequence[Floats], generation: int, pool: WorkerPool | None = None, *, root: int = TRAIN
) -> list[float]:
    """Return the observed fraction of each candidate, averaged over the worlds of a generation.

    Parameters
    ----------
    candidates : sequence of ndarray
        Constants of the policy.
    generation : int
        Number of the generation, which determines the worlds. All its candidates get the same worlds.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    root : int
        Root seed of the worlds.
    """
    from teamsight.policies.evolved import Evolved

    worlds = cells()
    runs = [
        Run(
            {"robots": robots, "targets": TARGETS, "radius": radius, "policy": policy, "awareness": "ring"}
            | {"delta": DELTA},
            model_seed(root, generation, robots, TARGETS, radius),
            STEPS,
        )
        for policy in (Evolved(tuple(constants)) for constants in candidates)
        for robots, radius in worlds
    ]
    observed = [outcome.observed_fraction for outcome in run_all(runs, pool)]
    count = len(worlds)
    return [sum(observed[first : first + count]) / count for first in range(0, len(observed), count)]


def evolve(
    evolution: Evolution, generations: int, checkpoint: Checkpoint, pool: WorkerPool | None = None
) -> Iterator[Generation]:
    """Yield every generation; those in the checkpoint are not tried again.

    Parameters
    ----------
    evolution : Evolution
        Its parameters.
    generations : int
        Number of generations in all.
    checkpoint : Checkpoint
        File of the fitness of all candidates; see `checkpoint_in`.
    pool : WorkerPool, optional
        Processes that try the candidates; by default this process.

    Raises
    ------
    ModuleNotFoundError
        If the package cma is not installed.
    """
    strategy = _strategy(evolution)
    keys = [_key(evolution, number) for number in range(generations)]
    finished = checkpoint.results(keys)
    for key in keys:
        candidates = strategy.ask()
        found = finished.get(key)
        if found is None:
            found = fitness([np.asarray(one) for one in candidates], strategy.countiter, pool, root=evolution.root)
            checkpoint.add({key: found})
        strategy.tell(candidates, [-value for value in found])
        yield Generation(strategy.countiter, float(np.mean(found)), np.array(strategy.mean, float))


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the generations that an evolution has left in a folder."""
    return Checkpoint(folder / "evolution.checkpoint")


def check_installed() -> Any:
    """Return the package cma.

    Raises
    ------
    ModuleNotFoundError
        If it is not installed.
    """
    return extra("cma", "evolution", "evolve")


def _strategy(evolution: Evolution) -> Any:
    rng = np.random.default_rng(evolution.seed)
    options = {
        "popsize": evolution.population,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,
        "verbose": -9,
        "CMA_stds": spreads(),
        # Do not stop: with noise, equal fitness does not mean convergence.
        "tolfun": 0, "tolfunhist": 0, "tolflatfitness": np.inf, "tolstagnation": np.inf, "tolx": 0,
    }  # fmt: skip
    return check_installed().CMAEvolutionStrategy(evolution.begin(), evolution.spread, options)


def _key(evolution: Evolution, generation: int) -> Key:
    """Return the texts that identify a generation: all earlier ones follow from the same settings."""
    worlds = f"cells={cells()}, targets={TARGETS}, steps={STEPS}, delta={DELTA}"
    library = f"cma={check_installed().__version__}"
    return "evolution", library, str(evolution), worlds, f"generation={generation}", code_digest(__name__)
