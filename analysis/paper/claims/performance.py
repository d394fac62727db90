"""Claims about the percentage of targets that a team observes under each policy (section 6, Figs. 6 and 7)."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from teamsight.analysis.paper.claims.interface import (
    CHANCE,
    Finding,
    above,
    at_least,
    at_most,
    average,
    claim,
    part,
    pooled,
    within,
)
from teamsight.analysis.stats.paired import cell_means, grid_of, percent


@claim(
    where="§6, Fig. 6",
    statement="centroid policy: a huge drop from R = 1 to R = 2",
    figure="huge",
    rule="mean over N ≥ 5 falls by ≥ 20 pp from R = 1 to R = 2",
    needs=("centroid",),
    trivial=("random-walk",),
)
def collective_drop(centroid: pd.DataFrame) -> Finding:
    grid = part(percent(centroid), (5, 30), (1, 2)).mean()
    drop = float(grid[1.0] - grid[2.0])
    return f"{drop:.1f} pp ({grid[1.0]:.0f} → {grid[2.0]:.0f} %)", at_least(drop, 20)


@claim(
    where="§6, Fig. 6",
    statement="very large arenas do better than small ones",
    figure="larger is better",
    rule="mean over N ≥ 10, R = 8, 9 is more than 2 standard errors above that over N ≥ 10, R = 2, 3",
    needs=("centroid",),
    trivial=("random-walk",),
)
def collective_large(centroid: pd.DataFrame) -> Finding:
    cells = cell_means(centroid, "observed_fraction")
    mean, se = grid_of(cells) * 100, grid_of(cells, "se") * 100
    large, small = (average(part(mean, (10, 30), radii)) for radii in ((8, 9), (2, 3)))
    spread = math.hypot(*(_se_of_mean(part(se, (10, 30), radii)) for radii in ((8, 9), (2, 3))))
    return f"{large - small:+.1f} pp, se {spread:.1f}", above(large - small, 2 * spread)


@claim(
    where="§6, Fig. 6",
    statement="the variation is small on average; the effect of N is only slightly perceptible",
    figure="small",
    rule="maximum minus minimum over N = 10..30, averaged over R = 3..9, ≤ 15 pp, with eight times the runs",
    needs=("centroid-larger-teams",),
    trivial=("random-walk-larger-teams",),
    tuned=("idle",),
)
def collective_flat(centroid: pd.DataFrame) -> Finding:
    cells = part(percent(centroid), (10, 30), (3, 9))
    spread = float(np.ptp(cells.to_numpy(dtype=float), axis=0).mean())
    return f"{spread:.1f} pp", at_most(spread, 15)


@claim(
    where="§6",
    statement="at R = 1 the policy has only a very small influence",
    figure="very small",
    rule="A-CMOMMT and centroid differ by ≤ 10 pp at R = 1 for every N ≥ 5",
    needs=("a-cmommt", "centroid"),
    trivial=("random-walk", "centroid"),
)
def small_arena_policy(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    difference = part(percent(acmommt) - percent(centroid), (5, 30), (1, 1)).iloc[:, 0].abs()
    most = float(difference.max())
    return f"up to {most:.1f} pp; {difference.mean():.1f} pp on average", at_most(most, 10)


@claim(
    where="§6, Fig. 7",
    statement="monotonic: falls with R, rises with N",
    figure="monotonic",
    rule="no pair of adjacent cells differs in the wrong direction by more than 4.5 pooled standard errors",
    needs=("a-cmommt",),
    trivial=("random-walk",),
)
def acmommt_monotonic(acmommt: pd.DataFrame) -> Finding:
    cells = cell_means(acmommt, "observed_fraction")
    mean, se = grid_of(cells), pooled(grid_of(cells, "se"))
    worst = max(_largest_fall(mean, se), _largest_fall(-mean.T, se.T))
    return f"worst pair {worst:.1f} se against it" if worst > 0 else "no pair against it", at_most(worst, CHANCE)


@claim(
    where="§6, Fig. 7",
    statement="100 % is easily reached in small arenas",
    figure="100 %",
    rule="≥ 99 % at R ≤ 2 for N ≥ 10",
    needs=("a-cmommt-small-arenas",),
    trivial=("random-walk-small-arenas",),
)
def acmommt_full(acmommt: pd.DataFrame) -> Finding:
    least = float(part(percent(acmommt), (10, 30), (1, 2)).to_numpy().min())
    return f"≥ {least:.2f} %", at_least(least, 99)


@claim(
    where="§6, Fig. 7",
    statement="with 15 targets, more than 8–10 robots add little",
    figure="8–10",
    rule="increase from N = 10 to 30 below half of that from N = 1 to 10, averaged over R",
    needs=("a-cmommt",),
    trivial=("random-walk",),
)
def acmommt_saturates(acmommt: pd.DataFrame) -> Finding:
    few, ten, many = (average(part(percent(acmommt), (robots, robots))) for robots in (1, 10, 30))
    first, later = ten - few, many - ten
    return f"{first:+.0f} pp to N = 10, {later:+.0f} pp to 30", above(first / 2, later)


@claim(
    where="§6",
    statement="N = 30, R = 10 (beyond the figure's grid): targets observed",
    figure="7.5 of 15",
    rule="50 ± 8 %, with ten times the runs",
    needs=("a-cmommt-r10",),
    trivial=("random-walk-r10",),
    tuned=("gain",),
)
def acmommt_r10(acmommt: pd.DataFrame) -> Finding:
    share = _share(acmommt)
    return f"{share:.1f} %, {0.15 * share:.1f} of 15", within(share, 50, 8)


@claim(
    where="§6",
    statement="as many still, well-placed, non-overlapping robots observe fewer than the mobile ones",
    figure="30 %, 4.5 of 15",
    rule="30 ± 3 %, and mobile robots above it, with ten times the runs",
    needs=("stationary-r10", "a-cmommt-r10"),
    trivial=("stationary-r10", "random-walk-r10"),
)
def stationary_r10(stationary: pd.DataFrame, acmommt: pd.DataFrame) -> Finding:
    still, mobile = _share(stationary), _share(acmommt)
    return f"{still:.1f} %, mobile {mobile:.1f} %", within(still, 30, 3), above(mobile, still)


def _largest_fall(mean: pd.DataFrame, se: pd.DataFrame) -> float:
    """Return the largest fall from a row to the next [standard errors], 0 if there is none."""
    fall, variance = -mean.diff(), se**2
    spread = np.sqrt(variance + variance.shift())
    return float(fall.div(spread).where(fall > 0, 0.0).to_numpy().max())


def _se_of_mean(se: pd.DataFrame) -> float:
    return float(np.sqrt((se.to_numpy() ** 2).sum()) / se.size)


def _share(table: pd.DataFrame) -> float:
    return float(table["observed_fraction"].mean() * 100)
