"""A better procedure where success gathers: explore, learn or switch to the team with skill, measure again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from teamsight.analysis.gathering.cells import Answer, delta_interval, is_enough, values_of
from teamsight.analysis.gathering.plan import Plan
from teamsight.analysis.gathering.simulate import Team, cost_of, simulate
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.stats.paired import Interval, interval_of
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
        that it needs, with bounds), objective (its mean), runs, robot_steps, trainings. The last is that of the check
        with all N − 1 teammates, if δ is less.
    shortfall : Interval
        By how much the objective with δ falls short of that with N − 1, paired; 95 %.
    enough : "yes", "no" or "undecided"
        Whether that is within the tolerance. If not, the procedure has ended too early: see Notes of `iterate_delta`.
    """

    delta: int
    rounds: pd.DataFrame
    shortfall: Interval
    enough: Answer

    @property
    def used(self) -> list[int]:
        """The δ of the rounds after the exploration, without the check."""
        used = self.rounds.loc[self.rounds["treatment"] == "skilled", "used"].tolist()
        return used if used[-1] == self.delta else used[:-1]

    @property
    def runs(self) -> int:
        """The runs that the procedure needs beside those of the exploration."""
        return int(self.rounds["runs"].iloc[1:].sum())

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
    tolerance: float = 0.02,
    degree: str = "nearest",
    trainings: int = 1,
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
    tolerance : float
        By which share of the objective with N − 1 teammates δ may fall short and be enough.
    degree : "nearest" or "ring"
        The degree of awareness with δ.
    trainings : int
        How often a team that learns learns anew in each round.
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
    are at most N − 1 rounds after the exploration. The result is a δ that suffices for the team that *has* it: a team
    whose skill needs more neighbours than it perceives may fail to gather, and then shows few. So the last round
    compares the objective with that of a team with all N − 1 teammates. Neighbours alone cannot show this.
    """
    found = task_of(task)
    given = dict(scenario or {})
    size = int(given.pop(found.size, found.scenario[found.size]))
    plan = Plan((found,), (size,), runs, steps, risk, tolerance, degree, trainings, given, rng)
    return iterate(plan, found, size, lambda team: simulate(plan, [team], pool))


def iterate(plan: Plan, task: Task, size: int, runs_of: Callable[[Team], pd.DataFrame]) -> Iteration:
    """Return the rounds for a task and a team size, whose runs a function makes or has; see `iterate_delta`."""
    tables = [runs_of(Team(task, size, "explore"))]
    rows = [_row(plan, Team(task, size, "explore"), tables[0])]
    delta, needed = -1, int(rows[0]["high"])
    while needed > delta:
        delta = needed
        team = Team(task, size, "skilled", delta)
        tables.append(runs_of(team))
        rows.append(_row(plan, team, tables[-1]))
        needed = int(rows[-1]["high"])
    full = tables[-1]
    if delta < size - 1:
        team = Team(task, size, "skilled", size - 1)
        full = runs_of(team)
        rows.append(_row(plan, team, full))
    best = values_of(full)
    shortfall = interval_of(task.objective.sign * (best - values_of(tables[-1])))
    if delta == size - 1:
        shortfall = Interval(0.0, 0.0, 0.0)
    return Iteration(delta, pd.DataFrame(rows), shortfall, is_enough(shortfall, plan.tolerance * abs(best.mean())))


def _row(plan: Plan, team: Team, table: pd.DataFrame) -> dict[str, Any]:
    interval = delta_interval(table["max_neighbours"].to_numpy(), team.size, plan.risk)
    return {
        "treatment": team.treatment,
        "used": team.delta,
        **interval._asdict(),
        "objective": float(table["counted"].mean()),
        "runs": len(table),
        "robot_steps": cost_of(plan, team),
        "trainings": plan.trainings if team.learns else 0,
    }
