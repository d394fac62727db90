"""``teamsight reproduce``: the figures of the paper and the ledger of its claims."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from teamsight.agents.settings import PRESETS
from teamsight.analysis.runs.limits import Steps
from teamsight.cli.options import CellRuns, Folder, Format, Works, Writes
from teamsight.core.component import Allowed, Flag, Seed

if TYPE_CHECKING:
    from teamsight.analysis.paper.reproduce import Plan

_LEDGER = "ledger"
#: The task whose figures have the numbers of the paper.
_PAPER = "cmommt"
# Options that only the paper's reproduction has.
_OF_PAPER = ("figures", "preset")


def _tasks() -> Iterable[str]:
    from teamsight.analysis.reproductions import REPRODUCTIONS

    return (_PAPER, *REPRODUCTIONS)


def _figures() -> Iterable[str]:
    from teamsight.analysis.paper.figures import FIGURES

    return (*FIGURES, _LEDGER)


_Figure = Annotated[str, Allowed(choices=_figures)]


@dataclass(frozen=True, kw_only=True)
class ReproduceSettings(Works, Writes):
    """Options of ``teamsight reproduce``.

    Parameters
    ----------
    figures : sequence of str
        Which figures.
    task : str
        The task whose source is reproduced.
    out : Path
        Folder for the results.
    runs : int
        Number of runs of each cell.
    steps : int
        Number of steps of each run.
    seed : int
        Seed of all runs.
    preset : str
        Settings with which figures are drawn, or 'defaults' for the default of every parameter.
    format : sequence of str
        Formats of the pictures, with commas between them.
    quick : bool
        Use a coarse grid of scenarios.
    """

    figures: Annotated[tuple[_Figure, ...], Allowed(metavar="[FIGURE]...", is_argument=True, is_repeated=True)] = ()
    task: Annotated[str, Allowed(choices=_tasks)] = _PAPER
    out: Folder = Path("results")
    runs: Annotated[CellRuns, Allowed(shown="5, or that of the task")] = 5
    steps: Annotated[Steps, Allowed(shown="600, or that of the task")] = 600
    seed: Annotated[Seed, Allowed(shown="2000, or that of the task")] = 2000
    preset: Annotated[str, Allowed(choices=(*PRESETS, "defaults"))] = "touzet2000"
    format: Annotated[tuple[Format, ...], Allowed()] = ("png",)
    quick: Flag = False

    def check(self) -> None:
        """Refuse what only the paper's reproduction has with another task."""
        if self.task != _PAPER:
            self.refuse(_OF_PAPER, f"is for the task {_PAPER}")


def reproduce(settings: ReproduceSettings) -> None:
    """Draw the paper's figures and check its claims.

    FIGURE is the number of a figure of the paper, 'delta' (observed targets against δ) or 'ledger' (the claims alone);
    by default all are made. Each figure is written as a picture and a Parquet table with the seed of every run. The
    ledger lists which of the paper's claims hold, and by which rule, for the preset and for the default settings. After
    an interruption the same command continues from there. With --task, the figures and the ledger of another task.

    \b
    Examples:
      teamsight reproduce                         everything, to results/
      teamsight reproduce 4 5 --out neighbours    the two figures on neighbours
      teamsight reproduce 11                      what lazy learning gains
      teamsight reproduce --quick --workers 1     coarse and fast
      teamsight reproduce ledger --seed 7         the claims with other noise
    """
    from teamsight.analysis.paper.reproduce import check_results
    from teamsight.analysis.paper.reproduce import reproduce as make
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import say, show_ledger, working

    folder = prepare_folder(settings.out)
    if settings.task != _PAPER:
        _reproduce_task(settings, folder)
        return
    plan = plan_of(settings)
    check_results(plan, folder, force=settings.force)
    began = time.perf_counter()
    with working(settings.workers, lambda: _kept(folder)) as (watch, pool):
        ledger = make(plan, folder, pool, watch, force=settings.force)
    if ledger is not None:
        show_ledger(ledger)
    for line in _summaries(plan, folder):
        say(line)
    made = [f"figure {name}" for name in plan.figures] + (["ledger"] if ledger else [])
    say(f"{', '.join(made)} in {folder} after {time.perf_counter() - began:.0f} s")


def _reproduce_task(settings: ReproduceSettings, folder: Path) -> None:
    """Draw the figures and judge the claims of another task."""
    from teamsight.analysis.reproduction import Request
    from teamsight.analysis.reproductions import REPRODUCTIONS
    from teamsight.cli.show import say, working

    given = {name: getattr(settings, name) for name in ("seed", "runs", "steps") if name in settings.given}
    request = Request(folder, quick=settings.quick, formats=settings.format, force=settings.force, **given)
    began = time.perf_counter()
    with working(settings.workers, lambda: _kept_of_task(folder)) as (watch, pool):
        lines = REPRODUCTIONS[settings.task](request, pool, watch)
    for line in lines:
        say(line)
    say(f"{settings.task} in {folder} after {time.perf_counter() - began:.0f} s")


def plan_of(settings: ReproduceSettings) -> Plan:
    """Return the plan that the settings describe."""
    from teamsight.analysis.paper.figures import FIGURES
    from teamsight.analysis.paper.reproduce import DEFAULTS, Plan
    from teamsight.analysis.runs.experiment import PAPER, QUICK

    everything = not settings.figures
    return Plan(
        settings={settings.preset: PRESETS.get(settings.preset, {}), DEFAULTS: {}},
        figures=tuple(name for name in FIGURES if everything or name in settings.figures),
        ledger=everything or _LEDGER in settings.figures,
        grid=QUICK if settings.quick else PAPER,
        runs=settings.runs,
        steps=settings.steps,
        root=settings.seed,
        formats=settings.format,
    )


def _summaries(plan: Plan, folder: Path) -> Iterator[str]:
    import pandas as pd

    from teamsight.analysis.paper.figures import FIGURES

    for name in plan.figures:
        if summarise := FIGURES[name].summarise:
            found = folder.glob(f"figure-{name}-*.parquet")
            tables = {file.stem.removeprefix(f"figure-{name}-"): pd.read_parquet(file) for file in found}
            yield f"figure {name}: {summarise(tables)}"


def _kept_of_task(folder: Path) -> str:
    if any(folder.glob("*.checkpoint")):
        return f"finished runs are kept in {folder}; the same command continues from there"
    return "nothing was kept"


def _kept(folder: Path) -> str:
    from teamsight.analysis.paper.reproduce import checkpoint_in
    from teamsight.cli.show import kept_in

    return kept_in(folder, checkpoint_in(folder).count())
