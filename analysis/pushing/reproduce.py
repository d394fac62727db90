"""``teamsight reproduce --task push``: from runs to a table, a picture and a page."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight.analysis.pushing.figure import draw
from teamsight.analysis.pushing.page import page, summary
from teamsight.analysis.pushing.plan import Plan
from teamsight.analysis.reproductions import Request
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.planned_runs import run_rows
from teamsight.analysis.runs.results import check_results, write_results
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool

RUNS, PAGE, PICTURE = "pushing.parquet", "pushing.md", "pushing"

_QUICK_RUNS = 10


def plan_of(request: Request) -> Plan:
    """Return the plan that a request asks for."""
    default = Plan()
    return Plan(
        runs=request.runs or (_QUICK_RUNS if request.quick else default.runs),
        steps=request.steps or default.steps,
        seed=default.seed if request.seed is None else request.seed,
        robots=(1, 2, 5, 10, 20) if request.quick else default.robots,
    )


def reproduce(request: Request, pool: WorkerPool, watch: Watch) -> Sequence[str]:
    """Simulate all teams, write table, picture and page, and return the result in sentences.

    After an interruption, the same call resumes.

    Raises
    ------
    ValueError
        If a file must not be replaced.
    """
    plan, folder = plan_of(request), request.folder
    about = {"pushing": plan.conditions()}
    pictures = {f"{PICTURE}.{kind}": kind for kind in request.formats}
    checkpoint = Checkpoint(folder / "pushing.checkpoint")
    check_results(folder, (RUNS, PAGE, *pictures), about, checkpoint=checkpoint, force=request.force)
    table = run_rows(
        plan.planned(), pool, progress=lambda done, total: watch("simulating", done, total), checkpoint=checkpoint
    )
    drawn = {name: draw(table, plan, kind) for name, kind in pictures.items()}
    write_results(folder, {RUNS: table, **drawn, PAGE: page(table, plan)}, about, force=request.force)
    checkpoint.forget()
    return summary(table, plan)
