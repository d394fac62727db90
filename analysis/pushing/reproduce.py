"""``teamsight reproduce --task push``: from runs to a table, a picture and a page."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight.analysis.pushing.figure import draw
from teamsight.analysis.pushing.page import page, summary
from teamsight.analysis.pushing.plan import Plan
from teamsight.analysis.reproduction import Reproduction, Request
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Watch

_REPRODUCTION = Reproduction("pushing", draw, page, summary, {})

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
    return _REPRODUCTION.make(plan_of(request), request, pool, watch)
