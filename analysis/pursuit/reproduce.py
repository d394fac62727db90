"""``teamsight reproduce --task pursuit``."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight.analysis.pursuit.page import summary
from teamsight.analysis.pursuit.plan import Plan
from teamsight.analysis.pursuit.results import make_results
from teamsight.analysis.reproductions import Request
from teamsight.analysis.runs.simulate import Watch
from teamsight.analysis.runs.workers import WorkerPool

# Of a coarse reproduction: the runs of each condition, and the share of its trials.
_QUICK_RUNS, _QUICK_SHARE = 3, 0.05


def reproduce(request: Request, pool: WorkerPool, watch: Watch) -> Sequence[str]:
    """Simulate Tan's conditions, write tables, figure and page, and return the result in sentences.

    Raises
    ------
    ValueError
        If `steps` is given, since trials have no fixed length, or a file must not be replaced.
    """
    if request.steps is not None:
        raise ValueError(f"steps={request.steps}: trials end with a capture; give the number of runs instead")
    plan = Plan()
    runs = request.runs or (_QUICK_RUNS if request.quick else plan.runs)
    share = _QUICK_SHARE if request.quick else plan.share
    plan = Plan(runs, share, seed=plan.seed if request.seed is None else request.seed)
    return summary(make_results(plan, request.folder, pool, watch, force=request.force))
