"""``teamsight reproduce``: the figures of the paper and the ledger of its claims."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from teamsight.cli.errors import when_stopped
from teamsight.cli.settings import LEDGER, ReproduceSettings
from teamsight.cli.show import say, show_ledger, watching

if TYPE_CHECKING:
    from pathlib import Path

    from teamsight.analysis.paper.reproduce import Plan


def execute(**given: Any) -> None:
    """Make what was asked for and print the ledger."""
    settings = ReproduceSettings(**given)
    from teamsight.analysis.paper.reproduce import check_results, reproduce
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.analysis.runs.simulate import IMPORTS
    from teamsight.analysis.runs.workers import WorkerPool, cores

    folder = prepare_folder(settings.out)
    plan = plan_of(settings)
    check_results(plan, folder, force=settings.force)
    began = time.perf_counter()
    with (
        when_stopped(lambda: _kept(folder)),
        watching() as watch,
        WorkerPool(settings.workers or cores(), IMPORTS, watch.tell) as pool,
    ):
        ledger = reproduce(plan, folder, pool, watch, force=settings.force)
    if ledger is not None:
        show_ledger(ledger)
    for line in lines_of(plan, folder):
        say(line)
    made = [f"figure {name}" for name in plan.figures] + (["ledger"] if ledger else [])
    say(f"{', '.join(made)} in {folder} after {time.perf_counter() - began:.0f} s")


def lines_of(plan: Plan, folder: Path) -> list[str]:
    """Return a line for each of the figures made that does not speak for itself."""
    import pandas as pd

    from teamsight.analysis.paper.figures import FIGURES

    found = []
    for name in plan.figures:
        tell = FIGURES[name].tell
        if tell is not None:
            found.append(f"figure {name}: {tell(pd.read_parquet(folder / f'figure-{name}-cells.parquet'))}")
    return found


def _kept(folder: Path) -> str:
    """Tell what is left behind."""
    from teamsight.analysis.paper.reproduce import checkpoint_in

    kept = checkpoint_in(folder).count()
    return f"{kept} runs are kept in {folder}; the same command goes on from there" if kept else "nothing was kept"


def plan_of(settings: ReproduceSettings) -> Plan:
    """Return the plan that the settings ask for."""
    from teamsight.agents.presets import PRESETS
    from teamsight.analysis.paper.figures import FIGURES
    from teamsight.analysis.paper.reproduce import DEFAULTS, Plan
    from teamsight.analysis.runs.experiment import PAPER, QUICK

    named = {settings.preset: PRESETS.get(settings.preset, {}), DEFAULTS: {}}
    everything = not settings.figures
    return Plan(
        settings=named,
        figures=tuple(name for name in FIGURES if everything or name in settings.figures),
        ledger=everything or LEDGER in settings.figures,
        grid=QUICK if settings.quick else PAPER,
        runs=settings.runs,
        steps=settings.steps,
        root=settings.seed,
    )
