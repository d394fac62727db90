"""The gathering index: does random exploration show how many neighbours a team with skill has? For any task.

`plan.py` says what is simulated, `simulate.py` makes the runs, `cells.py` turns them into one row for each task and
team size, `claims.py` judges G1 to G4, `iterate.py` has the procedure that measures again; `figure.py`, `page.py` and
`results.py` write.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.analysis.gathering.iterate import Iteration, iterate_delta
    from teamsight.analysis.gathering.plan import Plan
    from teamsight.analysis.gathering.results import Gathering, gather

_HOMES = {
    "Gathering": "teamsight.analysis.gathering.results",
    "Iteration": "teamsight.analysis.gathering.iterate",
    "Plan": "teamsight.analysis.gathering.plan",
    "gather": "teamsight.analysis.gathering.results",
    "iterate_delta": "teamsight.analysis.gathering.iterate",
}

__all__ = ["Gathering", "Iteration", "Plan", "gather", "iterate_delta"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
