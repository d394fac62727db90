"""Claims about the number of teammates within a robot's awareness range (sections 3 to 5, Figs. 2, 4, 5)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from teamsight.analysis.paper.claims.interface import (
    Finding,
    Remark,
    at_least,
    at_most,
    claim,
    part,
    peak,
    within,
)
from teamsight.analysis.stats.exceedance import bounds
from teamsight.analysis.stats.paired import cell_means, grid_of, maxima, paired


def exceeded(walk: pd.DataFrame) -> str:
    """Return the probability that a run has more than 16 neighbours, in words."""
    more = int((walk["max_neighbours"] > 16).sum())
    low, high = bounds(more, len(walk), confidence=0.975)
    return f"P(more than 16 in a run at N = 30, R = 2) = {more / len(walk):.1%} ({low:.1%} to {high:.1%})"


@claim(
    where="§4, Fig. 4",
    statement="random walk: δ = 16 seems appropriate",
    figure="16",
    rule="maximum over all N ≤ 30, R ≥ 2 is 16 ± 2",
    needs=("random-walk",),
    remark=Remark(("random-walk-crowded",), exceeded),
)
def neighbours_random(walk: pd.DataFrame) -> Finding:
    largest = int(part(maxima(walk), radius=(2, 9)).to_numpy().max())
    return f"{largest}", within(largest, 16, 2)


@claim(
    where="Fig. 4",
    statement="at R = 1 the maximum is not always N − 1: a robot at the border senses past the wall",
    figure="< N − 1 for some N",
    rule="at R = 1 the maximum is below N − 1 for some N",
    needs=("random-walk",),
)
def neighbours_small_arena(walk: pd.DataFrame) -> Finding:
    at_one = part(maxima(walk), (2, 30), radius=(1, 1)).iloc[:, 0]
    short = at_one[at_one < at_one.index - 1]
    found = ", ".join(f"{most} at N = {robots}" for robots, most in short.items())
    measured = f"below N − 1 for {len(short)} of {len(at_one)} N; {found}" if found else "N − 1 for every N"
    return measured, at_least(len(short), 1)


@claim(
    where="§5, Fig. 5",
    statement="A-CMOMMT with 5–30 robots, unless the arena is ridiculously small: the maximum varies little",
    figure="around 7",
    rule="median over the cells N = 5..30, R = 3..9 of the maximum in 5..9",
    needs=("a-cmommt",),
    trivial=("random-walk",),
)
def neighbours_acmommt(acmommt: pd.DataFrame) -> Finding:
    cells = part(maxima(acmommt), (5, 30), (3, 9)).to_numpy()
    middle = float(np.median(cells))
    return f"median {middle:g}, range {cells.min():.0f}..{cells.max():.0f}", within(middle, 7, 2)


@claim(
    where="Fig. 5",
    statement="the highest values of Figs. 4 and 5 are almost identical",
    figure="equal",
    rule="the two highest values differ by ≤ 2",
    needs=("random-walk", "a-cmommt"),
    trivial=("random-walk", "random-walk"),
)
def neighbours_same_peak(walk: pd.DataFrame, acmommt: pd.DataFrame) -> Finding:
    one, other = (int(maxima(table).to_numpy().max()) for table in (walk, acmommt))
    return f"{one} and {other}", within(one, other, 2)


@claim(
    where="§5",
    statement="the number of targets has little effect on the maximum",
    figure="little",
    rule="maxima with 5, 15 and 30 targets differ by ≤ 2, at N = 30 and R = 3, 5",
    needs=("targets-5", "targets-15", "targets-30"),
    trivial=("random-walk-targets-5", "random-walk-targets-15", "random-walk-targets-30"),
)
def neighbours_targets(*by_targets: pd.DataFrame) -> Finding:
    grids = [maxima(table) for table in by_targets]
    found = {radius: [int(grid[radius].iloc[0]) for grid in grids] for radius in grids[0].columns}
    spread = max(max(values) - min(values) for values in found.values())
    measured = "; ".join(f"{', '.join(map(str, values))} at R = {radius:g}" for radius, values in found.items())
    return measured, at_most(spread, 2)


@claim(
    where="§5",
    statement="targets that avoid robots may have a huge impact on the maximum",
    figure="may",
    # Whatever is measured, it may be so elsewhere.
    rule="",
    needs=("a-cmommt", "evasive"),
)
def neighbours_evasive(random: pd.DataFrame, evasive: pd.DataFrame) -> Finding:
    change = grid_of(cell_means(paired(evasive, random[random["radius"] >= 2], "max_neighbours"), "difference"))
    up, down = peak(change), peak(-change)
    most, sign = (up, 1) if up.value >= down.value else (down, -1)
    return (f"{sign * most.value:+.1f} at {most.cell}; largest change of the mean of the runs' maxima, R ≥ 2",)
