"""A cell of the answer: a task and a team size, δ of both teams, their ratio, and where the objective saturates."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.gathering.plan import Plan
from teamsight.analysis.gathering.simulate import OWN
from teamsight.analysis.stats import exceedance
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.tasks.task import Task

#: The confidence with which the bounds of a cell hold together.
CONFIDENCE = 0.95
# Bounds of two values of δ: each may fail with a quarter of the remaining probability.
_BOUND = 1 - (1 - CONFIDENCE) / 4

Answer = Literal["yes", "no", "undecided"]


class DeltaInterval(NamedTuple):
    """δ for the risk, and its bounds.

    Attributes
    ----------
    delta : int
        The smallest δ that at most the share `risk` of the runs exceeded.
    low, high : int
        The smallest δ that the runs do not refute, and the smallest that they support.
    """

    delta: int
    low: int
    high: int


class Cell(NamedTuple):
    """A task and a team size.

    Attributes
    ----------
    task : str
        The name of the task.
    gathers : bool or None
        Whether success brings its team together.
    size : int
        N.
    explore, skilled : DeltaInterval
        δ of both teams.
    ratio : Interval
        The gathering index δ(skilled) / δ(explore) with its bounds; ``mean`` is the ratio of the point estimates.
    saturation : DeltaInterval
        The smallest δ from which on the objective is within the tolerance of that with all N − 1 teammates.
    shortfall : dict of int to Interval
        For each δ, by how much the objective falls short of that with N − 1; paired, positive is worse. The intervals
        hold together; they are infinite if all runs with N − 1 are censored.
    objective : float
        The mean of the objective with N − 1.
    tolerance : float
        The shortfall that is accepted, in the unit of the objective.
    gain : Interval
        The gain of awareness: the objective with N − 1 over that with 0; paired, positive is better.
    censored : float
        The share of runs of the team with skill in which what was to happen did not happen.
    explored : Interval, optional
        The shortfall at δ(explore), with bounds that hold together for all cells of the plan.
    too_few, too_many : float
        The shares of seeds under which the exploration shows a smaller, and a larger, largest number of neighbours than
        the team with skill has; without a difference between the teams both are alike.
    skill : Interval, optional
        The objective of the team with skill over that of the exploration, each with its own degree; paired, positive is
        better.
    crowded : float
        The share of the robot-steps of the team with skill in which a robot has more than δ(explore) neighbours.
    """

    task: str
    gathers: bool | None
    size: int
    explore: DeltaInterval
    skilled: DeltaInterval
    ratio: Interval
    saturation: DeltaInterval
    shortfall: dict[int, Interval]
    objective: float
    tolerance: float
    gain: Interval
    censored: float
    explored: Interval | None = None
    too_few: float = 0.0
    too_many: float = 0.0
    skill: Interval = Interval(math.inf, math.inf, math.inf)
    crowded: float = 0.0

    @property
    def has_skill(self) -> Answer:
        """Whether the team with skill is better than the one that explores, by the bounds of the difference."""
        if self.skill.low > 0:
            return "yes"
        return "no" if self.skill.high <= 0 else "undecided"

    def is_enough(self, delta: int) -> Answer:
        """Return whether the objective with δ is within the tolerance of that with all N − 1 teammates."""
        return is_enough(self.shortfall[delta], self.tolerance)

    @property
    def is_shown_short(self) -> bool:
        """Whether δ(explore) is shown not to be enough, by bounds that hold together for all cells of the plan."""
        bounds = self.shortfall[self.explore.delta] if self.explored is None else self.explored
        return is_enough(bounds, self.tolerance) == "no"


def delta_interval(maxima: NDArray[np.int64], size: int, risk: float) -> DeltaInterval:
    """Return δ for a risk from the largest number of neighbours in each run, shape (runs,)."""
    curve = exceedance.curve(maxima, size, confidence=_BOUND)
    point, low, high = (exceedance.smallest_delta(curve, name, risk) for name in ("probability", "low", "high"))
    return DeltaInterval(point, low, high)


def delta_of(plan: Plan, table: pd.DataFrame, task: Task, size: int, treatment: str) -> DeltaInterval:
    """Return δ of one of the two teams, from the rows of `simulate`."""
    rows = _rows(table, task, size, treatment, OWN)
    return delta_interval(rows["max_neighbours"].to_numpy(), size, plan.risk)


def ratio(skilled: DeltaInterval, explore: DeltaInterval) -> Interval:
    """Return δ(skilled) / δ(explore) with bounds that hold together; 0 / 0 is 1."""
    return Interval(
        _quotient(skilled.delta, explore.delta),
        _quotient(skilled.low, explore.high),
        _quotient(skilled.high, explore.low),
    )


def cell(plan: Plan, table: pd.DataFrame, task: Task, size: int) -> Cell:
    """Return a cell from the rows of `simulate`: those of both teams, and of the team with skill under each δ.

    Parameters
    ----------
    plan : Plan
        What was simulated.
    table : DataFrame
        The rows.
    task : Task
        The task.
    size : int
        N.
    """
    explore, skilled = (delta_of(plan, table, task, size, treatment) for treatment in ("explore", "skilled"))
    curve = _rows(table, task, size, "skilled").query(f"delta != {OWN}")
    full = _at(curve, size - 1)
    objective = float(full.mean())
    tolerance = plan.tolerance * abs(objective)
    shortfall, explored = _shortfalls(plan, task, size, curve, explore.delta)
    own = _rows(table, task, size, "skilled", OWN)
    both = _rows(table, task, size, "explore").merge(own, on="replicate", validate="1:1", suffixes=("_explore", ""))
    fewer = both["max_neighbours"] - both["max_neighbours_explore"]
    better = task.objective.sign * (both["counted"] - both["counted_explore"])
    return Cell(
        task=task.name,
        gathers=task.gathers,
        size=size,
        explore=explore,
        skilled=skilled,
        ratio=ratio(skilled, explore),
        saturation=saturation(shortfall, tolerance),
        shortfall=shortfall,
        objective=objective,
        tolerance=tolerance,
        gain=interval_of(task.objective.sign * (full - _at(curve, 0))),
        censored=float(np.isinf(own["value"].to_numpy()).mean()),
        explored=explored,
        too_few=float((fewer > 0).mean()),
        too_many=float((fewer < 0).mean()),
        skill=interval_of(values_of(both.assign(counted=better))),
        crowded=_share_above(own["robot_steps"], explore.delta),
    )


def _share_above(robot_steps: pd.Series[Any], delta: int) -> float:
    """Return the share of robot-steps, in all runs together, with more than δ neighbours."""
    above = sum(sum(counts[delta + 1 :]) for counts in robot_steps)
    return float(above / max(sum(map(sum, robot_steps)), 1))


def _shortfalls(
    plan: Plan, task: Task, size: int, curve: pd.DataFrame, at: int
) -> tuple[dict[int, Interval], Interval]:
    """Return the shortfall of each δ, and that at one δ with bounds that hold together for all cells of the plan."""
    none = Interval(0.0, 0.0, 0.0)
    full = _at(curve, size - 1)
    worse = {
        delta: task.objective.sign * (full - _at(curve, delta)) for delta in sorted(set(curve["delta"]) - {size - 1})
    }
    if np.isinf(curve.loc[curve["delta"] == size - 1, "value"]).all():
        # All runs are censored: nothing is known of how much worse or better others are.
        unknown = {delta: Interval(float(one.mean()), -math.inf, math.inf) for delta, one in worse.items()}
        return {**unknown, size - 1: none}, unknown.get(at, none)
    level = 1 - (1 - CONFIDENCE) / max(len(worse), 1)
    together = 1 - (1 - level) / (len(plan.all_tasks) * len(plan.sizes))
    found = {delta: interval_of(one, level) for delta, one in worse.items()}
    return {**found, size - 1: none}, interval_of(worse[at], together) if at in worse else none


def saturation(shortfall: dict[int, Interval], tolerance: float) -> DeltaInterval:
    """Return the smallest δ from which on no shortfall exceeds the tolerance, by means and by bounds.

    Parameters
    ----------
    shortfall : dict of int to Interval
        For each δ that was measured; its intervals hold together, so those of the result do, too.
    tolerance : float
        What is accepted.
    """
    found = sorted(shortfall)

    def first(wrong: list[int]) -> int:
        return next(delta for delta in found if not wrong or delta > wrong[-1])

    return DeltaInterval(
        first([delta for delta in found if shortfall[delta].mean > tolerance]),
        first([delta for delta in found if shortfall[delta].low > tolerance]),
        first([delta for delta in found if shortfall[delta].high > tolerance]),
    )


def frame(cells: list[Cell]) -> pd.DataFrame:
    """Return cells as a table, one row each."""
    return pd.DataFrame([_flat(one) for one in cells])


def _flat(one: Cell) -> dict[str, Any]:
    row: dict[str, Any] = {"task": one.task, "gathers": one.gathers, "size": one.size}
    for name in ("explore", "skilled", "saturation"):
        found = getattr(one, name)
        row |= {f"{name}_delta": found.delta, f"{name}_low": found.low, f"{name}_high": found.high}
    for name, interval in (("ratio", one.ratio), ("gain", one.gain), ("skill", one.skill)):
        row |= {name: interval.mean, f"{name}_low": interval.low, f"{name}_high": interval.high}
    enough = {f"enough_at_{team}": one.is_enough(getattr(one, team).delta) for team in ("explore", "skilled")}
    names = ("objective", "tolerance", "censored", "too_few", "too_many", "crowded", "has_skill")
    return row | {name: getattr(one, name) for name in names} | enough


def is_enough(shortfall: Interval, tolerance: float) -> Answer:
    """Return whether a shortfall is within the tolerance by its bounds."""
    if shortfall.high <= tolerance:
        return "yes"
    return "no" if shortfall.low > tolerance else "undecided"


def _quotient(one: int, other: int) -> float:
    if other:
        return one / other
    return math.inf if one else 1.0


def _rows(table: pd.DataFrame, task: Task, size: int, treatment: str, delta: int | None = None) -> pd.DataFrame:
    chosen = (table["task"] == task.name) & (table["size"] == size) & (table["treatment"] == treatment)
    return table[chosen if delta is None else chosen & (table["delta"] == delta)]


def _at(curve: pd.DataFrame, delta: int) -> NDArray[np.float64]:
    return values_of(curve[curve["delta"] == delta])


def values_of(rows: pd.DataFrame) -> NDArray[np.float64]:
    """Return the objective of a team, one value for each replicate, or for each training if there are several."""
    rows = rows.sort_values(["training", "replicate"])
    if rows["training"].nunique() > 1:
        return rows.groupby("training")["counted"].mean().to_numpy(np.float64)
    return rows["counted"].to_numpy(np.float64)
