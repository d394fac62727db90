"""Reproduce the paper: simulate the experiments, draw the figures and judge the claims."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import pandas as pd

from teamsight import __version__
from teamsight.analysis.papers.touzet2000.claims import CLAIMS, needed
from teamsight.analysis.papers.touzet2000.experiments import make_chosen
from teamsight.analysis.papers.touzet2000.figures import FIGURES, Conditions, Job, make
from teamsight.analysis.papers.touzet2000.ledger import SEEDS, Ledger, options, scenario
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.experiment import PAPER, Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import OUTCOMES
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.runs.simulate import Watch

# The tables of experiments, by name of the setting.
_Made = Mapping[str, Mapping[str, pd.DataFrame]]


@dataclass(frozen=True)
class Plan:
    """What to reproduce.

    Parameters
    ----------
    settings : mapping of str to mapping
        Keyword parameters of CMOMMT by name of the setting. Figures are drawn for the first setting, claims are judged
        for all.
    figures : tuple of str
        Names of figures.
    ledger : bool
        Whether to judge the claims.
    grid : Grid
        Team sizes and radii of the surfaces.
    runs, steps : int
        Replicates of each cell, and steps of each run.
    root : int
        Root seed.
    formats : tuple of str
        Formats of the pictures: names in `teamsight.analysis.plot.style.FORMATS`.
    """

    settings: Mapping[str, Mapping[str, Any]]
    figures: tuple[str, ...] = tuple(FIGURES)
    ledger: bool = True
    grid: Grid = PAPER
    runs: int = 5
    steps: int = 600
    root: int = root("reproduce")
    formats: tuple[str, ...] = ("png",)

    def conditions(self) -> dict[str, Any]:
        """Return the conditions that all results have in common, fit for JSON."""
        robots, radius = self.grid
        return {
            "seed": self.root,
            "runs": self.runs,
            "steps": self.steps,
            "robots": f"{len(robots)} team sizes, {min(robots)} to {max(robots)}",
            "radius": f"{len(radius)} radii, {min(radius):g} to {max(radius):g}",
            "settings": {name: dict(setting) for name, setting in self.settings.items()},
            "version": __version__,
        }


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder of results."""
    return Checkpoint(folder / ".checkpoint", OUTCOMES)


def check_results(plan: Plan, folder: Path, *, force: bool = False) -> None:
    """Raise an error if a file in the folder must not be replaced by a result or by the checkpoint.

    Results that teamsight wrote may be replaced, whatever their settings.

    Parameters
    ----------
    plan : Plan
        What to reproduce.
    folder : Path
        Where to write.
    force : bool
        Replace any regular file by a result.

    Raises
    ------
    ValueError
        If there is such a file.
    """
    outputs = [f"figure-{name}.{kind}" for name in plan.figures for kind in ("parquet", *plan.formats)]
    outputs += [file.name for name in plan.figures for file in sorted(folder.glob(f"figure-{name}-*.parquet"))]
    if plan.ledger:
        outputs += [f"ledger.{kind}" for kind in ("parquet", "md", "json")]
    files.check_results(folder, outputs, checkpoint=checkpoint_in(folder), force=force)


def reproduce(
    plan: Plan,
    folder: Path,
    pool: WorkerPool,
    watch: Watch = lambda phase, done, total: None,
    *,
    force: bool = False,
) -> Ledger | None:
    """Simulate, draw, judge, and write all results to a folder. After an interruption, the same call resumes.

    Parameters
    ----------
    plan : Plan
        What to reproduce.
    folder : Path
        An existing folder; it receives ``figure-<name>.parquet`` and pictures, ``ledger.md``, ``ledger.json`` and
        ``ledger.parquet``.
    pool : WorkerPool
        Processes that do the work. Results do not depend on it.
    watch : callable
        Called with the phase, the work done in it and its work in all.
    force : bool
        Replace any regular file by a result.

    Returns
    -------
    Ledger or None
        None if the plan asks for no ledger.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check_results`.
    """
    check_results(plan, folder, force=force)
    checkpoint = checkpoint_in(folder)
    claimed = needed() if plan.ledger else set[str]()
    drawn = {name for figure in plan.figures for name in FIGURES[figure].needs}
    first, *others = plan.settings.values()
    made = make_chosen(
        [(first, claimed | drawn), *((setting, claimed) for setting in others)], plan.grid, pool,
        root=plan.root, runs=plan.runs, steps=plan.steps, checkpoint=checkpoint,
        progress=partial(watch, "simulating"), later=partial(watch, "measuring"),
    )  # fmt: skip
    tables = dict(zip(plan.settings, made, strict=True))
    _draw(plan, folder, pool, tables, watch, force)
    ledger = None
    if plan.ledger:
        ledger = _judged(plan, tables, _repeated(plan, pool, tables, watch, checkpoint))
        runs = [
            found.assign(setting=setting, experiment=name)
            for setting, by_name in tables.items()
            for name, found in by_name.items()
            if name in claimed
        ]
        contents: dict[str, files.Content] = {
            "ledger.parquet": pd.concat(runs, ignore_index=True),
            "ledger.md": ledger.to_markdown(),
            "ledger.json": ledger.to_json(),
        }
        files.write_results(folder, contents, ledger.conditions, force=force)
    checkpoint.forget()
    return ledger


def _draw(plan: Plan, folder: Path, pool: WorkerPool, tables: _Made, watch: Watch, force: bool) -> None:
    name, setting = next(iter(plan.settings.items()))
    conditions = Conditions(name, setting, plan.root, plan.runs, plan.steps)
    jobs = [
        Job(figure, {need: tables[name][need] for need in FIGURES[figure].needs}, conditions, plan.formats)
        for figure in plan.figures
    ]
    number = count(1)
    progress = lambda _: watch("drawing", next(number), len(jobs))  # noqa: E731
    drawn = pool.map(make, jobs, progress, lambda job: f"figure {job.name}")
    for job, (made, pictures) in zip(jobs, drawn, strict=True):
        stem = f"figure-{job.name}"
        contents: dict[str, files.Content] = {
            stem + (f"-{suffix}" if suffix else "") + ".parquet": table for suffix, table in made.items()
        }
        contents |= {f"{stem}.{kind}": picture for kind, picture in pictures.items()}
        about = plan.conditions() | {"figure": job.name, "title": FIGURES[job.name].title, "setting": name}
        files.write_results(folder, contents, about, force=force)


def _repeated(
    plan: Plan, pool: WorkerPool, tables: _Made, watch: Watch, checkpoint: Checkpoint
) -> dict[tuple[str, str], float]:
    """Return, by setting and claim, the share of further root seeds under which those near their limit hold."""
    held = {
        (setting, name): 0
        for setting, made in tables.items()
        for name, claim in CLAIMS.items()
        if claim.is_near(made, plan.runs)
    }
    names = needed((CLAIMS[name] for _, name in held), beside=False)
    for number in range(1, SEEDS + 1) if held else ():
        made = make_chosen(
            [(setting, names) for setting in plan.settings.values()], plan.grid, pool,
            root=plan.root + number, runs=plan.runs, steps=plan.steps, checkpoint=checkpoint,
        )  # fmt: skip
        found = dict(zip(plan.settings, made, strict=True))
        for setting, name in held:
            held[setting, name] += bool(CLAIMS[name].judge(found[setting]).holds)
        watch("repeating", number, SEEDS)
    return {one: count / SEEDS for one, count in held.items()}


def _judged(plan: Plan, tables: _Made, shares: Mapping[tuple[str, str], float]) -> Ledger:
    verdicts = {
        setting: {
            name: claim.judge(made, beside=True)._replace(share=shares.get((setting, name)))
            for name, claim in CLAIMS.items()
        }
        for setting, made in tables.items()
    }
    scenarios = {name: scenario(claim, tables, plan.steps) for name, claim in CLAIMS.items()}
    in_force = {
        setting: {name: options(claim, given) for name, claim in CLAIMS.items()}
        for setting, given in plan.settings.items()
    }
    return Ledger(verdicts, plan.conditions(), scenarios, in_force)
