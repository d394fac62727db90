"""A better procedure where success gathers: explore, learn or switch to the team with skill, measure again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from teamsight.analysis.gathering.cells import delta_interval
from teamsight.analysis.gathering.plan import Plan
from teamsight.analysis.gathering.simulate import Team, cost_of, simulate
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task


@dataclass(frozen=True)
class Iteration:
    """The rounds of `iterate_delta`.

    Attributes
    ----------
    delta : int
        The δ that the team which has it does not exceed, for the risk.
    rounds : DataFrame
        One row for each round: treatment, used (the δ that the team has; −1 while it explores), delta, low, high (δ
        that it needs, with bounds), objective (its mean), robot_steps, trainings.
    """

    delta: int
    rounds: pd.DataFrame

    @property
    def cost(self) -> float:
        """All steps of robots, over those of the exploration alone; steps of learning are not in it."""
        return float(self.rounds["robot_steps"].sum() / self.rounds["robot_steps"].iloc[0])

    @property
    def trainings(self) -> int:
        """How often the team learned."""
        return int(self.rounds["trainings"].sum())


def iterate_delta(
    task: Task | str,
    *,
    scenario: Mapping[str, Any] | None = None,
    runs: int = 200,
    steps: int | None = None,
    risk: float = 0.05,
    degree: str = "nearest",
    rng: int = 0,
    pool: WorkerPool | None = None,
) -> Iteration:
    """Choose δ by exploration, let the team with skill act with it, and measure again until it is large enough.

    Parameters
    ----------
    task : Task or str
        The task.
    scenario : mapping, optional
        Values of its scenario, N among them.
    runs, steps
        Runs of each round, and steps of each run; by default those of the task.
    risk : float
        Accepted probability that any robot has more than δ neighbours during a run.
    degree : "nearest" or "ring"
        The degree of awareness with δ.
    rng : int
        Root seed.
    pool : WorkerPool, optional
        Processes that do the work. The result does not depend on it.

    Returns
    -------
    Iteration

    Raises
    ------
    TypeError, ValueError
        As for `Plan`.

    Notes
    -----
    δ of a round is the smallest that its runs support. The next round has the larger of this and the last δ, so there
    are at most N rounds. The result is a δ that suffices for the team that *has* it: a team whose skill needs more
    neighbours than it perceives may fail to gather, and then shows few. Compare the objective of the rounds, and that
    with N − 1; see `Cell.is_enough`.
    """
    found = task_of(task)
    given = dict(scenario or {})
    size = int(given.pop(found.size, found.scenario[found.size]))
    plan = Plan((found,), (size,), runs, steps, risk, degree=degree, scenario=given, seed=rng)
    rows = [_round(plan, Team(found, size, "explore"), pool)]
    delta = rows[0]["high"]
    while True:
        rows.append(_round(plan, Team(found, size, "skilled", delta), pool))
        needed = rows[-1]["high"]
        if needed <= delta:
            return Iteration(delta, pd.DataFrame(rows))
        delta = needed


def _round(plan: Plan, team: Team, pool: WorkerPool | None) -> dict[str, Any]:
    table = simulate(plan, [team], pool)
    interval = delta_interval(table["max_neighbours"].to_numpy(), team.size, plan.risk)
    return {
        "treatment": team.treatment,
        "used": team.delta,
        **interval._asdict(),
        "objective": float(table["counted"].mean()),
        "robot_steps": cost_of(plan, [team]),
        "trainings": int(callable(team.task.teams[team.treatment])),
    }
