"""Ono and Fukumoto's part of ``teamsight reproduce --task pursuit``: a table, a picture and a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from teamsight.analysis.pursuit.ono.figure import draw
from teamsight.analysis.pursuit.ono.page import page, summary
from teamsight.analysis.pursuit.ono.plan import Plan
from teamsight.analysis.reproductions import Request
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.planned_runs import run_rows
from teamsight.analysis.runs.results import Content, check_results, write_results
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool

RUNS, PAGE, PICTURE = "pursuit-modules.parquet", "pursuit-modules.md", "pursuit-modules"
# Of a coarse reproduction: the runs of each condition, and the share of its steps.
_QUICK_RUNS, _QUICK_SHARE = 3, 0.05


def plan_of(request: Request) -> Plan:
    """Return the plan that a request asks for."""
    default = Plan()
    return Plan(
        request.runs or (_QUICK_RUNS if request.quick else default.runs),
        _QUICK_SHARE if request.quick else default.share,
        default.seed if request.seed is None else request.seed,
    )


def check(plan: Plan, request: Request) -> None:
    """Raise an error if a file must not be replaced.

    Raises
    ------
    ValueError
        If there is such a file.
    """
    names = (RUNS, PAGE, *(f"{PICTURE}.{kind}" for kind in request.formats))
    check_results(request.folder, names, _about(plan), checkpoint=_checkpoint(request), force=request.force)


def make_results(plan: Plan, request: Request, pool: WorkerPool | None, watch: Watch) -> Sequence[str]:
    """Simulate all conditions, write table, picture and page, and return the result in sentences.

    After an interruption, the same call resumes.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check`.
    """
    check(plan, request)
    checkpoint = _checkpoint(request)
    table = run_rows(
        plan.planned(), pool, progress=lambda done, total: watch("simulating modules", done, total),
        checkpoint=checkpoint,
    )  # fmt: skip
    pictures = {f"{PICTURE}.{kind}": draw(table, plan, kind) for kind in request.formats}
    contents: dict[str, Content] = {RUNS: table, **pictures, PAGE: page(table, plan)}
    write_results(request.folder, contents, _about(plan), force=request.force)
    checkpoint.forget()
    return summary(table)


def _about(plan: Plan) -> dict[str, Any]:
    return {"pursuit modules": plan.conditions()}


def _checkpoint(request: Request) -> Checkpoint:
    return Checkpoint(request.folder / "pursuit-modules.checkpoint")
