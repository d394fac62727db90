"""``teamsight reproduce --task forage``: from runs to a table, a picture and a page."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight.analysis.foraging.figure import draw
from teamsight.analysis.foraging.page import page, summary
from teamsight.analysis.foraging.plan import Plan
from teamsight.analysis.reproduction import Reproduction, Request
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Watch

_REPRODUCTION = Reproduction("foraging", draw, page, lambda table, plan: summary(table), {})

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
    return _REPRODUCTION.make(plan_of(request), request, pool, watch)
