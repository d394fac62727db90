"""Claims on the share of targets that a team observes, policy by policy (section 6, Figs. 6 and 7)."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from teamsight.analysis.paper.claims.interface import (
    CHANCE,
    Claim,
    Tables,
    Verdict,
    above,
    at_least,
    at_most,
    average,
    part,
    percent,
    verdict,
    within,
)
from teamsight.analysis.stats.paired import cell_means, grid_of

_ALL_RADII = (1, 9)


def judge_drop(tables: Tables) -> Verdict:
    """The centroid policy loses much from R = 1 to R = 2."""
    grid = part(percent(tables["centroid"]), (5, 30), (1, 2)).mean()
    drop = float(grid[1.0] - grid[2.0])
    return verdict(f"{drop:.1f} pp ({grid[1.0]:.0f} → {grid[2.0]:.0f} %)", at_least(drop, 20))


def judge_large(tables: Tables) -> Verdict:
    """The centroid policy does better in very large arenas than in small ones."""
    cells = cell_means(tables["centroid"], "observed_fraction")
    mean, se = grid_of(cells) * 100, grid_of(cells, "se") * 100
    large, small = (average(part(mean, (10, 30), radii)) for radii in ((8, 9), (2, 3)))
    spread = math.hypot(*(_se_of_mean(part(se, (10, 30), radii)) for radii in ((8, 9), (2, 3))))
    return verdict(f"{large - small:+.1f} pp, se {spread:.1f}", above(large - small, 2 * spread))


def judge_flat(tables: Tables) -> Verdict:
    """Under the centroid policy the number of robots is only slightly perceptible."""
    cells = part(percent(tables["centroid"]), (10, 30), (3, 9))
    spread = float(np.ptp(cells.to_numpy(dtype=float), axis=0).mean())
    return verdict(f"{spread:.1f} pp", at_most(spread, 15))


def judge_small_arena(tables: Tables) -> Verdict:
    """At R = 1 it hardly matters which policy the robots have."""
    cooperative, collective = (part(percent(tables[name]), (5, 30), (1, 1)) for name in ("a-cmommt", "centroid"))
    difference = (cooperative - collective).iloc[:, 0].abs()
    return verdict(
        f"up to {difference.max():.1f} pp, {difference.mean():.1f} pp on average", at_most(float(difference.max()), 10)
    )


def judge_monotonic(tables: Tables) -> Verdict:
    """Under A-CMOMMT more robots observe more, and a larger arena leaves less observed."""
    cells = cell_means(tables["a-cmommt"], "observed_fraction")
    mean, se = grid_of(cells), pooled(grid_of(cells, "se"))
    worst = max(_against(mean, se, axis=0, sign=1.0), _against(mean, se, axis=1, sign=-1.0))
    return verdict(
        f"worst pair {worst:.1f} se against it" if worst > 0 else "no pair against it", at_most(worst, CHANCE)
    )


def judge_full(tables: Tables) -> Verdict:
    """A-CMOMMT easily observes everything in small arenas."""
    least = float(part(percent(tables["a-cmommt"]), (10, 30), (1, 2)).to_numpy().min())
    return verdict(f"≥ {least:.1f} %", at_least(least, 99))


def judge_saturates(tables: Tables) -> Verdict:
    """After 8 to 10 robots for 15 targets, more robots add little."""
    grid = part(percent(tables["a-cmommt"]), (1, 30), _ALL_RADII)
    few, ten, many = (average(part(grid, (robots, robots), _ALL_RADII)) for robots in (1, 10, 30))
    first, later = ten - few, many - ten
    return verdict(f"+{first:.0f} pp to N = 10, then {later:+.0f} pp to 30", above(first / 2, later))


def judge_r10(tables: Tables) -> Verdict:
    """Thirty robots observe half of the targets at R = 10."""
    share = _share(tables["a-cmommt-r10"])
    return verdict(f"{share:.1f} %, {0.15 * share:.1f} of 15", within(share, 50, 8))


def judge_stationary(tables: Tables) -> Verdict:
    """As many still robots, well placed, observe 30 %, fewer than the mobile ones."""
    still, mobile = _share(tables["stationary-r10"]), _share(tables["a-cmommt-r10"])
    return verdict(f"{still:.1f} %, mobile {mobile:.1f} %", within(still, 30, 3), above(mobile, still))


def pooled(se: pd.DataFrame) -> pd.DataFrame:
    """Return each cell's se, pooled with that of the cells around it.

    The se of five runs is itself so uncertain that among 270 cells some come out far too small; over 3 × 3 cells it
    rests on 36 degrees of freedom. With a single run the spread is unknown, and every se infinite.
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
    """Return by how many se the worst neighbouring pair along `axis` moves against `sign`."""
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


CLAIMS = (
    Claim(
        "collective-drop",
        "§6, Fig. 6",
        "centroid policy: a huge drop from R = 1 to R = 2",
        "huge",
        "mean over N ≥ 5 falls ≥ 20 pp",
        judge_drop,
        ("centroid",),
    ),
    Claim(
        "collective-large",
        "§6, Fig. 6",
        "very large arenas do better than small ones",
        "larger is better",
        "mean over N ≥ 10: R = 8, 9 above R = 2, 3 by > 2 se",
        judge_large,
        ("centroid",),
    ),
    Claim(
        "collective-flat",
        "§6, Fig. 6",
        "the variation is small on average, N only slightly perceptible",
        "small",
        "at R = 3..9: mean range over N = 10..30 ≤ 15 pp",
        judge_flat,
        ("centroid",),
    ),
    Claim(
        "small-arena-policy",
        "§6",
        "at R = 1 the policy has only a very small influence",
        "very small",
        "at R = 1, every N ≥ 5: A-CMOMMT and centroid differ by ≤ 10 pp",
        judge_small_arena,
        ("a-cmommt", "centroid"),
    ),
    Claim(
        "acmommt-monotonic",
        "§6, Fig. 7",
        "monotonic: falls with R, rises with N",
        "monotonic",
        "no neighbouring pair of cells against it by > 4.5 se, pooled over 3 × 3 cells (3 would fail by chance)",
        judge_monotonic,
        ("a-cmommt",),
    ),
    Claim(
        "acmommt-full",
        "§6, Fig. 7",
        "100 % is easily reached in small arenas",
        "100 %",
        "≥ 99 % at R ≤ 2 for N ≥ 10",
        judge_full,
        ("a-cmommt",),
    ),
    Claim(
        "acmommt-saturates",
        "§6, Fig. 7",
        "with 15 targets, more than 8–10 robots add little",
        "8–10",
        "gain from N = 10 to 30 less than half of that from 1 to 10, mean over R",
        judge_saturates,
        ("a-cmommt",),
    ),
    Claim(
        "acmommt-r10",
        "§6",
        "N = 30, R = 10 (beyond the figure's grid): targets observed",
        "7.5 of 15",
        "50 ± 8 %, with ten times the runs",
        judge_r10,
        ("a-cmommt-r10",),
    ),
    Claim(
        "stationary-r10",
        "§6",
        "as many still, well-placed, non-overlapping robots observe fewer than the mobile ones",
        "30 %, 4.5 of 15",
        "simulated 30 ± 3 %, and mobile above it, with ten times the runs",
        judge_stationary,
        ("stationary-r10", "a-cmommt-r10"),
    ),
)
