"""``teamsight reproduce --task collect``: from learning runs to a table, a picture and a page."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight.analysis.collecting.figure import draw
from teamsight.analysis.collecting.page import page, summary
from teamsight.analysis.collecting.plan import Plan
from teamsight.analysis.reproduction import Reproduction, Request
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Watch

_REPRODUCTION = Reproduction("collecting", draw, page, summary, {}, "learning")

_QUICK = {"runs": 6, "times": (1250, 5000, 20_000), "tests": 4}


def plan_of(request: Request) -> Plan:
    """Return the plan that a request asks for; its steps are those of the test worlds."""
    given = {"runs": request.runs, "steps": request.steps, "seed": request.seed}
    return Plan(**{**(_QUICK if request.quick else {}), **{k: v for k, v in given.items() if v is not None}})  # type: ignore[arg-type]


def reproduce(request: Request, pool: WorkerPool, watch: Watch) -> Sequence[str]:
    """Let all teams learn, write table, picture and page, and return the result in sentences.

    After an interruption, the same call resumes.

    Raises
    ------
    ValueError
        If a file must not be replaced.
    """
    return _REPRODUCTION.make(plan_of(request), request, pool, watch)
