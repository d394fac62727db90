"""Claims about the percentage of targets that a team observes under each policy (section 6, Figs. 6 and 7)."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from teamsight.analysis.paper.claims.interface import (
    CHANCE,
    Tables,
    Verdict,
    above,
    at_least,
    at_most,
    average,
    claim,
    part,
    percent,
    verdict,
    within,
)
from teamsight.analysis.stats.paired import cell_means, grid_of

_ALL_RADII = (1, 9)


@claim(
    where="§6, Fig. 6",
    statement="centroid policy: a huge drop from R = 1 to R = 2",
    figure="huge",
    rule="mean over N ≥ 5 falls by ≥ 20 pp from R = 1 to R = 2",
    needs=("centroid",),
)
def collective_drop(tables: Tables) -> Verdict:
    grid = part(percent(tables["centroid"]), (5, 30), (1, 2)).mean()
    drop = float(grid[1.0] - grid[2.0])
    return verdict(f"{drop:.1f} pp ({grid[1.0]:.0f} → {grid[2.0]:.0f} %)", at_least(drop, 20))


@claim(
    where="§6, Fig. 6",
    statement="very large arenas do better than small ones",
    figure="larger is better",
    rule="mean over N ≥ 10, R = 8, 9 is more than 2 standard errors above that over N ≥ 10, R = 2, 3",
    needs=("centroid",),
)
def collective_large(tables: Tables) -> Verdict:
    cells = cell_means(tables["centroid"], "observed_fraction")
    mean, se = grid_of(cells) * 100, grid_of(cells, "se") * 100
    large, small = (average(part(mean, (10, 30), radii)) for radii in ((8, 9), (2, 3)))
    spread = math.hypot(*(_se_of_mean(part(se, (10, 30), radii)) for radii in ((8, 9), (2, 3))))
    return verdict(f"{large - small:+.1f} pp, se {spread:.1f}", above(large - small, 2 * spread))


@claim(
    where="§6, Fig. 6",
    statement="the variation is small on average; the effect of N is only slightly perceptible",
    figure="small",
    rule="maximum minus minimum over N = 10..30, averaged over R = 3..9, ≤ 15 pp",
    needs=("centroid",),
)
def collective_flat(tables: Tables) -> Verdict:
    cells = part(percent(tables["centroid"]), (10, 30), (3, 9))
    spread = float(np.ptp(cells.to_numpy(dtype=float), axis=0).mean())
    return verdict(f"{spread:.1f} pp", at_most(spread, 15))


@claim(
    where="§6",
    statement="at R = 1 the policy has only a very small influence",
    figure="very small",
    rule="A-CMOMMT and centroid differ by ≤ 10 pp at R = 1 for every N ≥ 5",
    needs=("a-cmommt", "centroid"),
)
def small_arena_policy(tables: Tables) -> Verdict:
    cooperative, collective = (part(percent(tables[name]), (5, 30), (1, 1)) for name in ("a-cmommt", "centroid"))
    difference = (cooperative - collective).iloc[:, 0].abs()
    return verdict(
        f"up to {difference.max():.1f} pp, {difference.mean():.1f} pp on average", at_most(float(difference.max()), 10)
    )


@claim(
    where="§6, Fig. 7",
    statement="monotonic: falls with R, rises with N",
    figure="monotonic",
    rule="no pair of adjacent cells differs in the wrong direction by more than 4.5 pooled standard errors",
    needs=("a-cmommt",),
)
def acmommt_monotonic(tables: Tables) -> Verdict:
    cells = cell_means(tables["a-cmommt"], "observed_fraction")
    mean, se = grid_of(cells), pooled(grid_of(cells, "se"))
    worst = max(_against(mean, se, axis=0, sign=1.0), _against(mean, se, axis=1, sign=-1.0))
    return verdict(
        f"worst pair {worst:.1f} se against it" if worst > 0 else "no pair against it", at_most(worst, CHANCE)
    )


@claim(
    where="§6, Fig. 7",
    statement="100 % is easily reached in small arenas",
    figure="100 %",
    rule="≥ 99 % at R ≤ 2 for N ≥ 10",
    needs=("a-cmommt",),
)
def acmommt_full(tables: Tables) -> Verdict:
    least = float(part(percent(tables["a-cmommt"]), (10, 30), (1, 2)).to_numpy().min())
    return verdict(f"≥ {least:.1f} %", at_least(least, 99))


@claim(
    where="§6, Fig. 7",
    statement="with 15 targets, more than 8–10 robots add little",
    figure="8–10",
    rule="increase from N = 10 to 30 below half of that from N = 1 to 10, averaged over R",
    needs=("a-cmommt",),
)
def acmommt_saturates(tables: Tables) -> Verdict:
    grid = part(percent(tables["a-cmommt"]), (1, 30), _ALL_RADII)
    few, ten, many = (average(part(grid, (robots, robots), _ALL_RADII)) for robots in (1, 10, 30))
    first, later = ten - few, many - ten
    return verdict(f"+{first:.0f} pp to N = 10, then {later:+.0f} pp to 30", above(first / 2, later))


@claim(
    where="§6",
    statement="N = 30, R = 10 (beyond the figure's grid): targets observed",
    figure="7.5 of 15",
    rule="50 ± 8 %, with ten times the runs",
    needs=("a-cmommt-r10",),
)
def acmommt_r10(tables: Tables) -> Verdict:
    share = _share(tables["a-cmommt-r10"])
    return verdict(f"{share:.1f} %, {0.15 * share:.1f} of 15", within(share, 50, 8))


@claim(
    where="§6",
    statement="as many still, well-placed, non-overlapping robots observe fewer than the mobile ones",
    figure="30 %, 4.5 of 15",
    rule="30 ± 3 %, and mobile robots above it, with ten times the runs",
    needs=("stationary-r10", "a-cmommt-r10"),
)
def stationary_r10(tables: Tables) -> Verdict:
    still, mobile = _share(tables["stationary-r10"]), _share(tables["a-cmommt-r10"])
    return verdict(f"{still:.1f} %, mobile {mobile:.1f} %", within(still, 30, 3), above(mobile, still))


def pooled(se: pd.DataFrame) -> pd.DataFrame:
    """Return the standard error of each cell, pooled with those of the cells around it.

    The standard error of five runs is uncertain: in some of 270 cells it is far too small. Pooled over 3 × 3 cells it
    has 36 degrees of freedom. With a single run the spread is unknown, and the standard error infinite.
    """
    variance = se.to_numpy() ** 2
    padded = np.pad(variance, 1, constant_values=np.nan)
    rows, columns = variance.shape
    near = [padded[down : down + rows, right : right + columns] for down in range(3) for right in range(3)]
    known = np.isfinite(near)
    total = np.where(known, near, 0.0).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known.any(axis=0), total / known.sum(axis=0), np.inf)
    return pd.DataFrame(np.sqrt(mean), index=se.index, columns=se.columns)


def _against(mean: pd.DataFrame, se: pd.DataFrame, axis: int, sign: float) -> float:
    """Return how far the worst pair of neighbouring cells along `axis` moves against `sign` [standard errors]."""
    step = -sign * np.diff(mean.to_numpy(), axis=axis)
    variance = se.to_numpy() ** 2
    ahead, behind = (np.delete(variance, end, axis=axis) for end in (0, -1))
    spread = np.sqrt(ahead + behind)
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.where(step > 0, step / spread, 0.0)
    return float(steps.max())


def _se_of_mean(se: pd.DataFrame) -> float:
    return float(np.sqrt((se.to_numpy() ** 2).sum()) / se.size)


def _share(table: pd.DataFrame) -> float:
    return float(table["observed_fraction"].mean() * 100)
