"""Ono and Fukumoto's part of ``teamsight reproduce --task pursuit``: a table, a picture and a page."""

from __future__ import annotations

from teamsight.analysis.pursuit.ono.figure import draw
from teamsight.analysis.pursuit.ono.page import page, summary
from teamsight.analysis.pursuit.ono.plan import Plan
from teamsight.analysis.reproduction import Reproduction, Request

#: From the runs to a table, a picture and a page.
REPRODUCTION = Reproduction(
    "pursuit-modules", draw, page, lambda table, plan: summary(table), {}, "simulating modules"
)  # fmt: skip
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
