"""Claims about the gain from awareness of designed teams (sections 6, 7, Figs. 8, 10)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from teamsight.analysis.paper.claims.interface import (
    CHANCE,
    PREFERRED,
    Finding,
    Peak,
    Remark,
    above,
    at_least,
    at_most,
    average,
    claim,
    part,
    peak,
    pooled,
    within,
)
from teamsight.analysis.stats.paired import cell_means, gain, grid_of, maxima, paired


@claim(
    where="§6, Fig. 8",
    statement="A-CMOMMT minus centroid: the largest gain",
    figure="60 pp",
    rule="60 ± 10 pp in the cell with the largest gain, measured again on eight times as many fresh runs",
    needs=("a-cmommt-largest-gain", "centroid-largest-gain"),
    remark=Remark(("a-cmommt", "centroid"), lambda acmommt, centroid: _chosen_as(peak(gain(acmommt, centroid)))),
)
def awareness_gain(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    cells = cell_means(paired(acmommt, centroid), "difference")
    most, width = peak(grid_of(cells) * 100), 100 * float((cells["high"] - cells["mean"]).iloc[0])
    return f"{most.value:.1f} ± {width:.1f} pp at {most.cell}", within(most.value, 60, 10)


@claim(
    where="§6, Fig. 8",
    statement="the gain is largest for R = 2..6 and null for R = 8..9",
    figure="null at 8–9",
    rule="largest gain in R = 2..6, and mean over N within ±5 pp at R = 8 and at R = 9",
    needs=("a-cmommt", "centroid"),
    trivial=("random-walk", "centroid"),
    tuned=("gain",),
)
def awareness_where(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    return where(gain(acmommt, centroid))


def where(grid: pd.DataFrame) -> Finding:
    """Return where a gain [pp] peaks, and its values in very large arenas."""
    most = peak(grid)
    large = part(grid, radius=(8, 9)).mean()
    measured = ", ".join(f"{value:+.1f} pp at R = {radius:g}" for radius, value in large.items())
    inside = PREFERRED[0] <= most.radius <= PREFERRED[1]
    return (
        f"peak at R = {most.radius:g}; {measured}",
        at_least(float(inside), 1),
        within(float(large.abs().max()), 0, 5),
    )


@claim(
    where="§6, Fig. 8",
    statement="for R = 2..6 the gain grows with N; with more robots it extends to larger R",
    figure="grows",
    rule="mean over N = 20..30 above that over N = 2..6 for R = 2..6, and falls below 10 pp at a larger R",
    needs=("a-cmommt", "centroid"),
    trivial=("random-walk", "centroid"),
)
def awareness_robots(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    return growth(gain(acmommt, centroid), faded=10.0)


def growth(grid: pd.DataFrame, faded: float) -> Finding:
    """Return whether a gain [pp] grows with the team, and whether it falls below `faded` [pp] at a larger radius."""
    profiles = [part(grid, robots).mean() for robots in ((2, 6), (20, 30))]
    few, many = (float(profile.loc[PREFERRED[0] : PREFERRED[1]].mean()) for profile in profiles)
    first, last = (_fades(profile, faded) for profile in profiles)
    radii = ["beyond 9" if end == np.inf else f"{end:g}" for end in (last, first)]
    # As many digits as the gains beside it.
    level = f"{round(faded, 1):g}"
    return (
        f"{many:.1f} against {few:.1f} pp; under {level} pp from R = {' against '.join(radii)}",
        above(many, few),
        at_least(float(last > first), 1),
    )


@claim(
    where="§7, Fig. 10",
    statement="awareness range 1 instead of 0.5 never observes less",
    figure="≥ 0 everywhere",
    rule="no cell more than 4.5 pooled standard errors below 0; mean > 0",
    needs=("a-cmommt", "half-range"),
    trivial=("random-walk", "random-walk-half-range"),
)
def range_gain(whole: pd.DataFrame, half: pd.DataFrame) -> Finding:
    cells = cell_means(paired(whole, half), "difference")
    overall, worst = average(grid_of(cells)) * 100, _worst(cells)
    return f"{overall:+.2f} pp on average; {_worst_in_words(worst)}", at_most(worst.value, CHANCE), above(overall, 0)


@claim(
    where="§7",
    statement="a larger awareness range means more neighbours",
    figure="more",
    rule=(
        "maximum of a run at range 1 minus that at 0.5: no cell more than 4.5 pooled standard errors below 0; mean > 0"
    ),
    needs=("a-cmommt", "half-range"),
    trivial=("random-walk", "random-walk-half-range"),
)
def range_neighbours(whole: pd.DataFrame, half: pd.DataFrame) -> Finding:
    cells = cell_means(paired(whole, half, "max_neighbours"), "difference")
    overall, worst = average(grid_of(cells)), _worst(cells)
    fewer = maxima(whole) < maxima(half)
    return (
        f"{overall:+.1f} on average; {_worst_in_words(worst)}; maxima of all runs lower in "
        f"{int(fewer.to_numpy().sum())} of {fewer.size} cells",
        at_most(worst.value, CHANCE),
        above(overall, 0),
    )


def smallest_delta(ring: pd.DataFrame, pairwise: pd.DataFrame) -> str:
    """Return the smallest δ from which on the ring is as good as pairwise awareness, in words."""
    means = {
        int(str(delta)): 100 * float(paired(part_of, pairwise)["difference"].mean())
        for delta, part_of in ring.groupby("delta")
    }
    worse = [delta for delta, difference in means.items() if abs(difference) > 1]
    enough = min((delta for delta in means if delta > max(worse, default=0)), default=None)
    cells = len(pairwise.groupby(["robots", "radius"]))
    found = "no δ" if enough is None else f"every δ ≥ {enough} ({means[enough]:+.2f} pp at {enough})"
    return f"as good in {cells} crowded to empty cells: {found} of those tried, {', '.join(map(str, means))}"


@claim(
    where="§3.4, §8",
    statement="with δ = 16 awareness is as good as with Θ(N)",
    figure="no difference",
    rule="A-CMOMMT under ring, δ = 16, minus pairwise: mean over the grid within ±1 pp",
    needs=("ring-16", "a-cmommt"),
    trivial=("random-walk", "random-walk"),
    remark=Remark(("delta-ring", "delta-pairwise"), smallest_delta),
)
def delta_sufficient(ring: pd.DataFrame, pairwise: pd.DataFrame) -> Finding:
    difference = average(gain(ring, pairwise))
    return f"{difference:+.2f} pp", within(difference, 0, 1)


def _chosen_as(most: Peak) -> str:
    return f"{most.value:.1f} pp in the runs that chose the cell"


def _worst(cells: pd.DataFrame) -> Peak:
    """Return how far the worst cell lies below 0 [pooled standard errors], and which it is; 0 if none does."""
    mean, se = grid_of(cells), pooled(grid_of(cells, "se"))
    return peak((-mean / se).where(mean < 0, 0.0))


def _worst_in_words(worst: Peak) -> str:
    if not worst.value:
        return "no cell below 0"
    return f"at worst {worst.value:.1f} se below 0, at {worst.cell}"


def _fades(profile: pd.Series[float], faded: float) -> float:
    """Return the first radius beyond the peak at which the gain is below `faded` [pp]."""
    after = profile.loc[profile.idxmax() :]
    return float(min(after.index[after < faded], default=np.inf))
