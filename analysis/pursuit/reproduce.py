"""``teamsight reproduce --task pursuit``: Tan's tables, then Ono and Fukumoto's modules."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight.analysis.pursuit import results as tan
from teamsight.analysis.pursuit.ono import results as ono
from teamsight.analysis.reproduction import Request
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Watch


def reproduce(request: Request, pool: WorkerPool, watch: Watch) -> Sequence[str]:
    """Simulate all conditions of both, write tables, pictures and pages, and return the result in sentences.

    Raises
    ------
    ValueError
        If `steps` is given, since trials have no fixed length, or a file must not be replaced.
    """
    if request.steps is not None:
        raise ValueError(f"steps={request.steps}: trials end with a capture; give the number of runs instead")
    plan, modules = tan.plan_of(request), ono.plan_of(request)
    # Before the first of both is simulated.
    tan.REPRODUCTION.check(plan, request)
    ono.REPRODUCTION.check(modules, request)
    return [
        *tan.REPRODUCTION.make(plan, request, pool, watch), *ono.REPRODUCTION.make(modules, request, pool, watch),
    ]  # fmt: skip
