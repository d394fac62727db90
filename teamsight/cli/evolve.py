"""``teamsight evolve train`` and ``test``: find the constants of a policy, and compare them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from teamsight.analysis.papers.training import MOST, Evolution
from teamsight.analysis.runs.limits import CellRuns
from teamsight.cli.options import File, Folder, Works, Writes
from teamsight.core.component import Allowed


@dataclass(frozen=True, kw_only=True)
class TrainSettings(Evolution, Works, Writes):
    """Options of ``teamsight evolve train``.

    Parameters
    ----------
    out : Path
        Folder for the checkpoint and the constants.
    generations : int
        Total number of generations.
    start : Path, optional
        Constants of this policy that 'evolve train' wrote, with which to begin.
    """

    out: Folder = Path("evolution")
    generations: Annotated[int, Allowed(least=1, most=MOST)] = 400
    start: Annotated[File | None, Allowed(shown="what the policy declares")] = None  # type: ignore[assignment]


@dataclass(frozen=True, kw_only=True)
class TestSettings(Works, Writes):
    """Options of ``teamsight evolve test``.

    Parameters
    ----------
    out : Path
        Folder for the page, its table and its figure.
    constants : Path, optional
        Constants that 'evolve train' wrote.
    training : Path, optional
        Folder that 'evolve train' wrote; its progress is added to the page.
    further : Path, optional
        Folder of an evolution that began with these constants; as --training.
    runs : int
        Number of runs of each cell.
    """

    out: Folder = Path("results")
    constants: Annotated[File | None, Allowed(shown="the constants that ship")] = None
    training: Folder | None = None
    further: Folder | None = None
    runs: CellRuns = 30


def train(settings: TrainSettings) -> None:
    """Evolve the constants of a policy.

    Runs CMA-ES, then validates the constants of every hundredth generation on other worlds. Writes constants.json,
    training.json and a checkpoint. The same command continues an interrupted evolution; with more --generations it
    extends a finished one. It needs the package cma: pip install 'teamsight[evolve]'.

    \b
    Examples:
      teamsight evolve train
      teamsight evolve train --generations 20 --population 10 --out small
      teamsight evolve train --start evolution/constants.json \\
          --spread 0.03 --out further
      teamsight evolve train --policy adaptive-forces --spread 0.6
    """
    from teamsight.analysis.papers import evolution
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import kept_in, say, working
    from teamsight.core.extras import extra

    start = evolution.kind_of(settings).load(settings.start).constants if settings.start else ()
    plan = Evolution(settings.population, settings.spread, settings.seed, start, settings.policy)
    extra("cma", "evolution", "evolve")
    folder = prepare_folder(settings.out)
    with working(settings, lambda: kept_in(folder, "finished", "generations")) as (watch, pool):
        evolution.train(plan, settings.generations, folder, pool, watch, force=settings.force)
    say(f"constants in {folder / evolution.CONSTANTS}")


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
    from teamsight.analysis.papers import evolution
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import say, working

    folder = prepare_folder(settings.out)
    plan = evolution.Comparison(**settings.values(("constants", "training", "further", "runs")))
    with working(settings) as (watch, pool):
        evolution.COMPARISON.reproduce(plan, folder, pool, watch, force=settings.force)
    say(f"page, table and figure in {folder}")
