"""The claims on box pushing as signs and order, with intervals, and how sure we are of each.

Notes
-----
Only what was read can hold or fail. What is recalled, and not verified, agrees or differs; none has a number.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.analysis.stats.exceedance import bounds
from teamsight.analysis.stats.paired import Interval, half_width, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above, interval_text, percent_text

Floats = npt.NDArray[np.float64]

#: How sure the source of a claim is: read, recalled, none.
READ, RECALLED, OURS = "video 199 of the Handbook of Robotics", "recalled, not verified", "ours"
#: Team sizes at which times are compared: few robots, the number in between, many.
FEW, SOME, MANY = 2, 10, 20
#: The difference of times that counts as none, as a share.
MARGIN = 0.1

_UNKNOWN = Interval(math.nan, -math.inf, math.inf)


def runs_of(table: pd.DataFrame, team: str, robots: int | None = None) -> pd.DataFrame:
    """Return the runs of a team, of one size or of all from two robots on, in the order of sizes and replicates."""
    is_size = table["robots"] >= FEW if robots is None else table["robots"] == robots
    return table[(table["team"] == team) & is_size].sort_values(["robots", "replicate"])


def slower(table: pd.DataFrame, team: str, robots: int, than: int) -> Interval:
    """Return by how many steps a team needs longer with one number of robots than with another.

    The variances may differ; without two runs of both, or one that is not censored, nothing is known.
    """
    runs = [runs_of(table, team, size) for size in (robots, than)]
    one, other = (np.asarray(part["time"], float) for part in runs)
    if min(len(one), len(other)) < 2 or _are_censored(runs):
        return _UNKNOWN
    variance = one.var(ddof=1) / len(one) + other.var(ddof=1) / len(other)
    return _around(float(one.mean() - other.mean()), float(variance), min(len(one), len(other)))


def saved(table: pd.DataFrame, team: str, over: str) -> Interval:
    """Return by which share the mean time of a team is shorter than that of another, over all sizes.

    The interval is Student's, of the paired differences to first order in the ratio of the means. If all runs are
    censored, nothing is known.
    """
    runs = [runs_of(table, name) for name in (team, over)]
    if _are_censored(runs):
        return _UNKNOWN
    with_, without = (np.asarray(part["time"], float) for part in runs)
    ratio = with_.mean() / without.mean()
    return interval_of(1.0 - ratio + (ratio * without - with_) / without.mean())


def _are_censored(runs: list[pd.DataFrame]) -> bool:
    """Return whether all runs are censored: their times are the same, which shows nothing."""
    return all(bool(part["censored"].all()) for part in runs)


def stagnation(runs: pd.DataFrame) -> Floats:
    """Return for each run the share of the steps with at least two robots that push in which the box does not move.

    Runs without such steps are left out.
    """
    tried = runs[runs["together"] > 0]
    return np.asarray(tried["stagnating"] / tried["together"], float)


def stagnation_slope(table: pd.DataFrame, team: str) -> Interval:
    """Return by how much stagnation grows with each further robot: the slope of the line through the means of sizes.

    The variance of each mean is that of its runs, so that sizes may differ in it.
    """
    runs = runs_of(table, team)
    shares = {size: stagnation(part) for size, part in runs.groupby("robots")}
    shares = {size: share for size, share in shares.items() if len(share) > 1}
    if len(shares) < 2:
        return _UNKNOWN
    sizes = np.array(list(shares), float)
    weight = (sizes - sizes.mean()) / ((sizes - sizes.mean()) ** 2).sum()
    means = np.array([share.mean() for share in shares.values()])
    variances = np.array([share.var(ddof=1) / len(share) for share in shares.values()])
    return _around(float(weight @ means), float(weight**2 @ variances), min(len(share) for share in shares.values()))


def _around(mean: float, variance: float, fewest: int) -> Interval:
    """Return Student's interval, with the degrees of freedom of the smallest sample, so that it is not too short."""
    wide = float(half_width(np.array(math.sqrt(variance)), np.array(fewest)))
    return Interval(mean, mean - wide, mean + wide)


def verdicts(table: pd.DataFrame) -> list[Verdict]:
    """Return the verdicts on all claims; `table` is that of the runs of `plan.Plan`."""
    less, more = slower(table, "fixed priority", FEW, SOME), slower(table, "fixed priority", MANY, SOME)
    grows = stagnation_slope(table, "no recovery")
    grown = f"{percent_text(grows)} for each robot"
    return [
        _one_never(table), _two_do(table),
        _recalled(f"K2 {SOME} robots are faster than {FEW}", above(less), interval_text(less, "steps")),
        _recalled(f"K2 {MANY} robots are slower than {SOME}", above(more), interval_text(more, "steps")),
        _recalled("K3 Without recovery, stagnation grows with N", above(grows), grown),
        _network(table), _awareness(table),
    ]  # fmt: skip


def _recalled(claim: str, verdict: str, measured: str) -> Verdict:
    return Verdict(claim, RECALLED, measured, {HOLDS: "agrees", FAILS: "differs"}.get(verdict, verdict))


def _one_never(table: pd.DataFrame) -> Verdict:
    """One robot never moves the box, in no step of any run."""
    alone = table[table["robots"] == 1]
    moved = int((alone["box_moved"] > 0).sum())
    verdict = UNDECIDED if alone.empty else HOLDS if moved == 0 else FAILS
    return Verdict("K1 One robot never moves the box (by construction)", READ, f"{moved} of {len(alone)} runs", verdict)


def _two_do(table: pd.DataFrame) -> Verdict:
    """Two robots move it by the distance in more than half of the runs, by the interval of Clopper and Pearson."""
    pair = runs_of(table, "fixed priority", FEW)
    done = int((~pair["censored"]).sum())
    low, high = (float(one) for one in bounds(done, max(len(pair), 1), 0.975))
    verdict = HOLDS if low > 0.5 else FAILS if high <= 0.5 else UNDECIDED
    measured = f"{done} of {len(pair)} runs ({100 * low:.0f} to {100 * high:.0f} %)"
    return Verdict(f"K1 {FEW} robots move it the whole way in most runs", READ, measured, verdict)


def _network(table: pd.DataFrame) -> Verdict:
    found = saved(table, "network", "fixed priority")
    inside = found.low >= -MARGIN and found.high <= MARGIN
    outside = found.high < -MARGIN or found.low > MARGIN
    claim = f"K4 Network and fixed priority take the same time (up to {100 * MARGIN:g} %)"
    return _recalled(claim, HOLDS if inside else FAILS if outside else UNDECIDED, percent_text(found))


def _awareness(table: pd.DataFrame) -> Verdict:
    found = saved(table, "fixed priority", "no awareness")
    return Verdict("Perceiving the nearest teammate saves time", OURS, percent_text(found), above(found))


def same_runs(table: pd.DataFrame, team: str, other: str) -> tuple[int, int]:
    """Return in how many runs two teams did the same in all that is measured, and the number of runs."""
    measured = ["time", "box_moved", "together", "stagnating", "max_neighbours"]
    one, two = (runs_of(table, name)[measured].to_numpy() for name in (team, other))
    return int((one == two).all(axis=1).sum()), len(one)
