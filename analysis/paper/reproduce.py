"""Reproduce the paper: simulate the experiments, draw the figures and judge the claims."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import pandas as pd

from teamsight import __version__
from teamsight.analysis.paper.claims import CLAIMS, Ledger, judge, needed
from teamsight.analysis.paper.claims.conditions import options, scenario
from teamsight.analysis.paper.claims.ledger import SEEDS
from teamsight.analysis.paper.experiments import chosen, make_chosen
from teamsight.analysis.paper.figures import FIGURES, Conditions, Job, make
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.experiment import PAPER, Grid, Request
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import OUTCOMES
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.runs.simulate import Watch

#: Name of the setting that leaves every parameter of CMOMMT at its default.
DEFAULTS = "defaults"


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
        robots, radius = self.grid.robots, self.grid.radius
        return {
            "seed": self.root,
            "runs": self.runs,
            "steps": self.steps,
            "robots": f"{len(robots)} team sizes, {min(robots)} to {max(robots)}",
            "radius": f"{len(radius)} radii, {min(radius):g} to {max(radius):g}",
            "settings": {name: dict(setting) for name, setting in self.settings.items()},
            "version": __version__,
        }


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
    names = [f"{stem}.{kind}" for stem in plan.figures for kind in ("parquet", *plan.formats)]
    outputs = [f"figure-{name}" for name in names]
    outputs += [file.name for name in plan.figures for file in sorted(folder.glob(f"figure-{name}-*.parquet"))]
    if plan.ledger:
        outputs += [f"ledger.{kind}" for kind in ("parquet", "md", "html", "json")]
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
        An existing folder; it receives ``figure-<name>.parquet`` and pictures, ``ledger.md``, ``ledger.html``,
        ``ledger.json`` and ``ledger.parquet``.
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
    tables = _simulate(plan, pool, watch, checkpoint)
    _draw(plan, folder, pool, tables, watch, force)
    ledger = None
    if plan.ledger:
        ledger = _judged(plan, tables, _repeated(plan, pool, tables, watch, checkpoint))
        _write_ledger(ledger, folder, tables, force)
    checkpoint.forget()
    return ledger


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder of results."""
    return Checkpoint(folder / ".checkpoint", OUTCOMES)


def _simulate(plan: Plan, pool: WorkerPool, watch: Watch, checkpoint: Checkpoint) -> dict[str, dict[str, pd.DataFrame]]:
    claimed = needed() if plan.ledger else set[str]()
    drawn = {name for figure in plan.figures for name in FIGURES[figure].needs}
    requests = [
        Request(setting, chosen(claimed if number else claimed | drawn, plan.grid, setting))
        for number, setting in enumerate(plan.settings.values())
    ]
    made = make_chosen(
        requests,
        claimed,
        pool,
        root=plan.root,
        runs=plan.runs,
        steps=plan.steps,
        progress=lambda done, total: watch("simulating", done, total),
        later=lambda done, total: watch("measuring", done, total),
        checkpoint=checkpoint,
    )
    return dict(zip(plan.settings, made, strict=True))


def _draw(
    plan: Plan,
    folder: Path,
    pool: WorkerPool,
    tables: Mapping[str, Mapping[str, pd.DataFrame]],
    watch: Watch,
    force: bool,
) -> None:
    name, setting = next(iter(plan.settings.items()))
    conditions = Conditions(name, setting, plan.root, plan.runs, plan.steps)
    jobs = [
        Job(figure, {need: tables[name][need] for need in FIGURES[figure].needs}, conditions, plan.formats)
        for figure in plan.figures
    ]
    drawn = count(1)
    for found in pool.map(
        make, jobs, lambda index: watch("drawing", next(drawn), len(jobs)), lambda job: f"figure {job.name}"
    ):
        about = plan.conditions() | {"figure": found.name, "title": FIGURES[found.name].title, "setting": name}
        stem = f"figure-{found.name}"
        contents: dict[str, files.Content] = {
            stem + (f"-{suffix}" if suffix else "") + ".parquet": table for suffix, table in found.tables.items()
        }
        contents |= {f"{stem}.{kind}": picture for kind, picture in found.pictures.items()}
        files.write_results(folder, contents, about, force=force)


def _repeated(
    plan: Plan, pool: WorkerPool, tables: Mapping[str, Mapping[str, pd.DataFrame]], watch: Watch, checkpoint: Checkpoint
) -> dict[str, dict[str, float]]:
    """Return for each setting the share of further root seeds under which the claims near their limit hold."""
    near = {
        setting: {name: claim for name, claim in CLAIMS.items() if claim.is_near(made, plan.runs)}
        for setting, made in tables.items()
    }
    names = needed({name: claim for claims in near.values() for name, claim in claims.items()}, beside=False)
    requests = [Request(setting, chosen(names, plan.grid, setting)) for setting in plan.settings.values()]
    held = {setting: dict.fromkeys(claims, 0) for setting, claims in near.items()}
    further = range(plan.root + 1, plan.root + 1 + SEEDS) if names else ()
    for number, seed in enumerate(further, 1):
        made = make_chosen(
            requests, names, pool, root=seed, runs=plan.runs, steps=plan.steps, checkpoint=checkpoint
        )
        for (setting, claims), found in zip(near.items(), made, strict=True):
            for name, verdict in judge(found, claims).items():
                held[setting][name] += bool(verdict.holds)
        watch("repeating", number, SEEDS)
    return {setting: {name: count / SEEDS for name, count in counts.items()} for setting, counts in held.items()}


def _judged(
    plan: Plan, tables: Mapping[str, Mapping[str, pd.DataFrame]], shares: Mapping[str, Mapping[str, float]]
) -> Ledger:
    return Ledger(
        {
            setting: {
                name: verdict._replace(share=shares[setting].get(name))
                for name, verdict in judge(made, beside=True).items()
            }
            for setting, made in tables.items()
        },
        plan.conditions(),
        {name: scenario(claim, tables, plan.steps) for name, claim in CLAIMS.items()},
        {
            setting: {name: options(claim, plan.settings[setting]) for name, claim in CLAIMS.items()}
            for setting in tables
        },
    )


def _write_ledger(
    ledger: Ledger, folder: Path, tables: Mapping[str, Mapping[str, pd.DataFrame]], force: bool
) -> None:
    claimed = needed()
    runs = [
        found.assign(setting=setting, experiment=name)
        for setting, made in tables.items()
        for name, found in made.items()
        if name in claimed
    ]
    contents: dict[str, files.Content] = {
        "ledger.parquet": pd.concat(runs, ignore_index=True),
        "ledger.md": ledger.to_markdown(),
        "ledger.html": ledger.to_html(),
        "ledger.json": ledger.to_json(),
    }
    files.write_results(folder, contents, ledger.conditions, force=force)
