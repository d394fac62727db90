"""``teamsight evolve train`` and ``test``: find the constants of the policy 'evolved', and compare them."""

from __future__ import annotations

from pathlib import Path

from teamsight.cli import limits, values
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Settings

# More candidates or generations than can be computed.
_MOST = 100_000


class TrainSettings(Settings):
    """Settings of ``teamsight evolve train``."""

    out: Path = values.folder(Path("evolution"), "Folder for the checkpoint and the constants.")
    generations: int = values.count(400, "Total number of generations.", most=_MOST)
    population: int = values.count(40, "Number of candidates in each generation.", least=2, most=_MOST)
    seed: int = values.seed(1, "Seed of the candidates.")
    start: Path | None = values.file(
        "Constants that 'evolve train' wrote, with which to begin.", shown="the forces of A-CMOMMT"
    )
    spread: float = values.number(0.07, "Standard deviation of the first generation.", least=1e-6, most=10.0)
    workers: int | None = values.workers()
    force: bool = values.force()


class TestSettings(Settings):
    """Settings of ``teamsight evolve test``."""

    out: Path = values.folder(Path("results"), "Folder for the page, its table and its figure.")
    constants: Path | None = values.file("Constants that 'evolve train' wrote.", shown="the constants that ship")
    training: Path | None = values.folder(None, "Folder that 'evolve train' wrote; its progress is added to the page.")
    further: Path | None = values.folder(None, "Folder of an evolution that began with these constants; as --training.")
    runs: int = values.count(30, "Number of runs of each cell.", most=limits.MOST_CELL_RUNS)
    workers: int | None = values.workers()
    force: bool = values.flag("Overwrite files in FOLDER that teamsight did not write.")


def train(settings: TrainSettings) -> None:
    """Evolve the constants of the policy 'evolved'.

    Runs CMA-ES, then validates the constants of every hundredth generation on other worlds. Writes constants.json,
    training.json and a checkpoint. The same command continues an interrupted evolution; with more --generations it
    extends a finished one. It needs the package cma: pip install 'teamsight[evolve]'.

    \b
    Examples:
      teamsight evolve train
      teamsight evolve train --generations 20 --population 10 --out small
      teamsight evolve train --start evolution/constants.json \\
          --spread 0.03 --out further
    """
    from teamsight.analysis.evolution import evolve
    from teamsight.analysis.evolution.cma import Evolution, check_installed
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import say, working
    from teamsight.policies.evolved import Evolved

    start = Evolved.load(settings.start).constants if settings.start else ()
    evolution = Evolution(settings.population, settings.spread, settings.seed, start)
    check_installed()
    folder = prepare_folder(settings.out)
    with (
        when_stopped(lambda: f"finished generations are kept in {folder}; the same command continues from there"),
        working(settings.workers) as (watch, pool),
    ):
        evolve.train(evolution, settings.generations, folder, pool, watch, force=settings.force)
    say(f"constants in {folder / evolve.CONSTANTS}")


def test(settings: TestSettings) -> None:
    """Compare the policy 'evolved' with the best A-CMOMMT.

    The worlds were used neither to train 'evolved' nor to choose the options of A-CMOMMT. Writes evolved.md,
    evolved.parquet and images/evolved.png.

    \b
    Examples:
      teamsight evolve test
      teamsight evolve test --constants evolution/constants.json \\
          --training evolution
    """
    from teamsight.analysis.evolution import evolve
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import say, working

    folder = prepare_folder(settings.out)
    with when_stopped(lambda: "nothing was kept"), working(settings.workers) as (watch, pool):
        evolve.evaluate(
            folder, pool, watch,
            constants=settings.constants, training=settings.training, further=settings.further,
            runs=settings.runs, force=settings.force,
        )  # fmt: skip
    say(f"page, table and figure in {folder}")
