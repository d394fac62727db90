"""Tan's part of ``teamsight reproduce --task pursuit``: two tables, a picture and a page."""

from __future__ import annotations

from teamsight.analysis.pursuit.figure import draw
from teamsight.analysis.pursuit.ledger import frame, rows
from teamsight.analysis.pursuit.page import page, summary
from teamsight.analysis.pursuit.plan import Plan
from teamsight.analysis.reproduction import Reproduction, Request

#: From the runs to two tables, a picture and a page.
REPRODUCTION = Reproduction(
    "pursuit", draw, page, lambda table, plan: summary(table),
    {"pursuit-ledger.parquet": lambda table: frame(rows(table))},
)  # fmt: skip
# Of a coarse reproduction: the runs of each condition, and the share of its trials.
_QUICK_RUNS, _QUICK_SHARE = 3, 0.05


def plan_of(request: Request) -> Plan:
    """Return the plan that a request asks for."""
    default = Plan()
    return Plan(
        request.runs or (_QUICK_RUNS if request.quick else default.runs),
        _QUICK_SHARE if request.quick else default.share,
        seed=default.seed if request.seed is None else request.seed,
    )
