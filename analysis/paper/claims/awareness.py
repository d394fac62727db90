"""Claims about the gain from awareness of teammates (sections 6 to 8, Figs. 8 and 10)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from teamsight.analysis.paper.claims.interface import (
    CHANCE,
    PREFERRED,
    Peak,
    Tables,
    Verdict,
    above,
    at_least,
    at_most,
    average,
    claim,
    gain,
    maxima,
    part,
    peak,
    verdict,
    within,
)
from teamsight.analysis.paper.claims.performance import pooled
from teamsight.analysis.stats.paired import cell_means, grid_of, paired

_TEAM = (1, 30)
_FADED = 10.0


@claim(
    where="§6, Fig. 8",
    statement="A-CMOMMT minus centroid: the largest gain",
    figure="60 pp",
    rule="60 ± 10 pp",
    needs=("a-cmommt", "centroid"),
)
def awareness_gain(tables: Tables) -> Verdict:
    most = peak(gain(tables["a-cmommt"], tables["centroid"]))
    return verdict(f"{most.value:.1f} pp at N = {most.robots}, R = {most.radius:g}", within(most.value, 60, 10))


@claim(
    where="§6, Fig. 8",
    statement="the gain is largest for R = 2..6 and null for R = 8..9",
    figure="null at 8–9",
    rule="largest gain in R = 2..6, and mean over N within ±5 pp at R = 8 and at R = 9",
    needs=("a-cmommt", "centroid"),
)
def awareness_where(tables: Tables) -> Verdict:
    measured, *distances = where(gain(tables["a-cmommt"], tables["centroid"]))
    return verdict(measured, *distances)


def where(grid: pd.DataFrame) -> tuple[str, float, float]:
    """Return where a gain [pp] peaks, and its values in very large arenas, in words and as two distances."""
    most = peak(grid)
    large = part(grid, _TEAM, (8, 9)).mean()
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
)
def awareness_robots(tables: Tables) -> Verdict:
    measured, *distances = growth(gain(tables["a-cmommt"], tables["centroid"]), _FADED)
    return verdict(measured, *distances)


def growth(grid: pd.DataFrame, faded: float) -> tuple[str, float, float]:
    """Return whether a gain [pp] grows with the team and extends to larger radii, in words and as two distances."""
    few, many = (part(grid, robots, (1, 9)).mean() for robots in ((2, 6), (20, 30)))
    gains = [float(profile.loc[PREFERRED[0] : PREFERRED[1]].mean()) for profile in (few, many)]
    ends = [_fades(profile, faded) for profile in (few, many)]
    radii = ["beyond 9" if end == np.inf else f"{end:g}" for end in ends]
    # As many digits as the gains beside it.
    level = f"{round(faded, 1):g}"
    longer = ends[1] > ends[0]
    return (
        f"{gains[1]:.1f} against {gains[0]:.1f} pp; under {level} pp from R = {radii[1]} against {radii[0]}",
        above(gains[1], gains[0]),
        at_least(float(longer), 1),
    )


@claim(
    where="§7, Fig. 10",
    statement="awareness range 1 instead of 0.5 never observes less",
    figure="≥ 0 everywhere",
    rule="no cell more than 4.5 pooled standard errors below 0; mean > 0",
    needs=("a-cmommt", "half-range"),
)
def range_gain(tables: Tables) -> Verdict:
    cells = cell_means(paired(tables["a-cmommt"], tables["half-range"]), "difference")
    overall, worst = average(grid_of(cells)) * 100, _worst(cells)
    return verdict(
        f"{overall:+.2f} pp on average; {_worst_in_words(worst)}", at_most(worst.value, CHANCE), above(overall, 0)
    )


@claim(
    where="§7",
    statement="a larger awareness range means more neighbours",
    figure="more",
    rule=(
        "maximum of a run at range 1 minus that at 0.5: no cell more than 4.5 pooled standard errors below 0; mean > 0"
    ),
    needs=("a-cmommt", "half-range"),
)
def range_neighbours(tables: Tables) -> Verdict:
    cells = cell_means(paired(tables["a-cmommt"], tables["half-range"], "max_neighbours"), "difference")
    overall, worst = average(grid_of(cells)), _worst(cells)
    fewer = maxima(tables["a-cmommt"]) < maxima(tables["half-range"])
    return verdict(
        f"{overall:+.1f} on average; {_worst_in_words(worst)}; maxima of all runs lower in "
        f"{int(fewer.to_numpy().sum())} of {fewer.size} cells",
        at_most(worst.value, CHANCE),
        above(overall, 0),
    )


@claim(
    where="§3.4, §8",
    statement="with δ = 16 awareness is as good as with Θ(N)",
    figure="no difference",
    rule="A-CMOMMT under ring, δ = 16, minus pairwise: mean over the grid within ±1 pp",
    needs=("ring-16", "a-cmommt"),
)
def delta_sufficient(tables: Tables) -> Verdict:
    difference = average(gain(tables["ring-16"], tables["a-cmommt"]))
    return verdict(f"{difference:+.2f} pp", within(difference, 0, 1))


def _worst(cells: pd.DataFrame) -> Peak:
    """Return how far the worst cell lies below 0 [pooled standard errors], and which it is; 0 if none does."""
    mean, se = grid_of(cells), pooled(grid_of(cells, "se"))
    with np.errstate(divide="ignore", invalid="ignore"):
        return peak(pd.DataFrame(np.where(mean < 0, -mean / se, 0.0), index=mean.index, columns=mean.columns))


def _worst_in_words(worst: Peak) -> str:
    if not worst.value:
        return "no cell below 0"
    return f"at worst {worst.value:.1f} se below 0, at N = {worst.robots}, R = {worst.radius:g}"


def _fades(profile: pd.Series[float], faded: float) -> float:
    """Return the first radius beyond the peak at which the gain is below `faded` [pp]."""
    after = profile.loc[profile.idxmax() :]
    below = after[after < faded]
    return float(below.index[0]) if len(below) else float("inf")
