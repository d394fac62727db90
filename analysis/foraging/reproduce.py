"""``teamsight reproduce --task forage``: from runs to a table, a picture and a page."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight import __version__
from teamsight.analysis.foraging.figure import draw
from teamsight.analysis.foraging.page import page, summary
from teamsight.analysis.foraging.plan import Plan, simulate
from teamsight.analysis.reproductions import Request
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool

RUNS, PAGE, PICTURE = "foraging.parquet", "foraging.md", "foraging"

_QUICK_RUNS = 4


def plan_of(request: Request) -> Plan:
    """Return the plan that a request asks for."""
    default = Plan()
    return Plan(
        runs=request.runs or (_QUICK_RUNS if request.quick else default.runs),
        steps=request.steps or default.steps,
        seed=default.seed if request.seed is None else request.seed,
        robots=(1, 3, 5) if request.quick else default.robots,
        attractors=(1, 7) if request.quick else default.attractors,
    )


def reproduce(request: Request, pool: WorkerPool, watch: Watch) -> Sequence[str]:
    """Simulate all teams, write table, picture and page, and return the result in sentences.

    After an interruption, the same call resumes.

    Raises
    ------
    ValueError
        If a file must not be replaced.
    """
    plan, folder, force = plan_of(request), request.folder, request.force
    about = {"foraging": plan.conditions()}
    files.check_replaceable(folder / RUNS, about, force=force)
    pictures = [(kind, folder / f"{PICTURE}.{kind}") for kind in request.formats]
    for path in (folder / PAGE, *(path for _, path in pictures)):
        files.check_replaceable(path, force=force)
    checkpoint = Checkpoint(folder / "foraging.checkpoint")
    checkpoint.check()
    table = simulate(plan, pool, progress=lambda done, total: watch("simulating", done, total), checkpoint=checkpoint)
    files.write_table(folder / RUNS, table, {**about, "version": __version__}, force=force)
    for kind, path in pictures:
        files.write_bytes(path, draw(table, plan, kind), force=force)
    files.write_page(folder / PAGE, page(table, plan), force=force)
    checkpoint.forget()
    return summary(table)
