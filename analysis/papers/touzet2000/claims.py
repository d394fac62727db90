"""The paper's claims: statements that simulation can check, each by a rule, and the statistics that the rules share.

Claims on learned teams (section 8, Fig. 11) are judged on many explorations. The paper's learner decides, as it is
printed. What another learner gives under the same rule stands beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from teamsight.analysis.papers.touzet2000.experiments import LITERAL, SLOPES, Gains, Reading, gains_of
from teamsight.analysis.runs.experiment import Tables
from teamsight.analysis.stats.exceedance import bounds
from teamsight.analysis.stats.paired import (
    Interval,
    cell_means,
    clustered,
    gain,
    grid_of,
    interval_of,
    maxima,
    paired,
    percent,
)


class Part(float):
    """The distance of a measurement from one part of a rule, in tolerances, and by what the part fails, in words."""

    fails_by: str

    def __new__(cls, distance: float, fails_by: str) -> Part:
        found = super().__new__(cls, distance)
        found.fails_by = fails_by
        return found


#: What was measured, in words, and its distance from each part of a rule.
Finding: TypeAlias = tuple[str, *tuple[Part, ...]]
#: Takes gains and returns what it finds there.
Rule: TypeAlias = Callable[[Gains], Finding]

# The arena radii between which the paper finds that awareness matters.
_PREFERRED = (2.0, 6.0)
# Largest violation [standard errors] allowed in the worst cell, or pair of neighbouring cells, of a surface. With 3,
# noise alone would usually violate one of the 500 pairs of a flat surface; see docs/claims.md.
_CHANCE = 4.5
# Distances are finite, and those of claims that differ are above 1.
_LARGE, _LEAST = 1e9, 1e-6
# A ring whose mean is at most this far below that of Θ(N) is as good [share of the targets].
_EQUAL = 0.01
# What "null" means where the gain of A-CMOMMT is at most 60 pp, as a share of the largest gain.
_FADED = 1 / 6
# Rotations and distances of an exploration are not random if a p-value is below this, over the number of tests.
_UNLIKELY = 0.01
# How often the null is drawn, and from which seed.
_DRAWS, _SEED = 1_000, 11


class Judgement(NamedTuple):
    """The result of applying a claim's rule.

    Attributes
    ----------
    holds : bool or None
        Whether the claim holds; None if it is not decidable.
    measured : str
        What was measured, in words: the key number, and what belongs to it after a semicolon.
    distance : float
        Distance of the measurement from the paper's figure, in tolerances of the rule; up to 1 the claim holds.
    beside : tuple of str
        What is reported beside it and decides nothing.
    is_trivial : bool
        Whether a random walk holds under the same rule.
    share : float or None
        Share of further root seeds under which the claim holds, if it is near its limit.
    parts : tuple of (str, bool)
        Of each part of the rule by what it could fail, and whether it holds.
    """

    holds: bool | None
    measured: str
    distance: float
    beside: tuple[str, ...] = ()
    is_trivial: bool = False
    share: float | None = None
    parts: tuple[tuple[str, bool], ...] = ()


@dataclass(frozen=True)
class Claim:
    """A statement of the paper that simulation can check.

    Parameters
    ----------
    where : str
        Section and figure of the paper.
    statement : str
        The claim in words.
    figure : str
        The number that the paper gives, or its word where it gives none.
    rule : str
        The statistic and the tolerance by which `decide` decides. Empty if nothing that is measured could contradict
        the claim: it is not decidable.
    needs : tuple of str
        Names of the experiments that `decide` reads.
    decide : callable
        Takes the tables of these experiments in this order. Returns what was measured, in words, and for each part of
        the rule the distance in tolerances; up to 1 the part holds. Without a rule there is no distance.
    trivial : tuple of str
        Names of experiments to which the rule is applied as well, in the order of `needs`, with a random walk in the
        place of the policy. A rule that holds there says little. Empty where a random walk is not comparable.
    remark : (tuple of str, callable), optional
        What is measured beside and decides nothing: names of the experiments that it reads, and a function that takes
        their tables in this order and returns what was measured, in words.
    by_construction : bool
        Whether it holds because the code does what the claim says, whatever is simulated.
    tuned : tuple of str
        Options of policies whose values the preset has because the claim holds with them.
    """

    where: str
    statement: str
    figure: str
    rule: str
    needs: tuple[str, ...] = ()
    trivial: tuple[str, ...] = ()
    remark: tuple[tuple[str, ...], Callable[..., str]] | None = None
    by_construction: bool = False
    tuned: tuple[str, ...] = ()
    decide: Callable[..., Finding] = lambda: ("",)

    def __call__(self, decide: Callable[..., Finding]) -> Claim:
        """Return the claim with the function that decides on it, and register it under the function's name."""
        found = CLAIMS[decide.__name__.replace("_", "-")] = replace(self, decide=decide)
        return found

    def judge(self, tables: Tables, *, beside: bool = False) -> Judgement:
        """Return the verdict on tables by name of the experiment. All parts of the rule must hold.

        Parameters
        ----------
        tables : mapping of str to DataFrame
            One row a run.
        beside : bool
            Also report what a random walk gives under the same rule, and the remark.
        """
        judgement, found = self._apply(tables, self.needs), []
        if beside and self.remark:
            names, say = self.remark
            found.append(say(*(tables[name] for name in names)))
        is_trivial = False
        if beside and self.trivial:
            walk = self._apply(tables, self.trivial)
            is_trivial = bool(walk.holds)
            found.append(f"a random walk {'holds' if is_trivial else 'differs'}: {walk.measured}")
        return judgement._replace(beside=tuple(found), is_trivial=is_trivial)

    def is_near(self, tables: Tables, runs: int) -> bool:
        """Return whether the claim is near its limit: the verdict is another if one run of each cell is left out.

        Parameters
        ----------
        tables : mapping of str to DataFrame
            One row a run.
        runs : int
            Runs of each cell. Of an experiment with more of them, the same share is left out. Of fewer than three, one
            is too large a part: no claim is near its limit then.
        """
        if runs < 3 or not (self.rule and self.needs):
            return False
        fewer = (
            {name: tables[name][tables[name]["replicate"] % runs != left_out] for name in self.needs}
            for left_out in range(runs)
        )
        holds = self._apply(tables, self.needs).holds
        return any(self._apply(one, self.needs).holds != holds for one in fewer)

    def _apply(self, tables: Tables, names: tuple[str, ...]) -> Judgement:
        measured, *distances = self.decide(*(tables[name] for name in names))
        worst = float(max(distances, default=0.0))
        parts = tuple((one.fails_by, one <= 1.0) for one in distances)
        return Judgement(worst <= 1.0 if self.rule else None, measured, min(worst, _LARGE), parts=parts)


#: Every claim by name, in the order of the paper.
CLAIMS: dict[str, Claim] = {}


def needed(claims: Iterable[Claim] | None = None, *, beside: bool = True) -> set[str]:
    """Return the names of the experiments that claims read.

    Parameters
    ----------
    claims : iterable of Claim, optional
        Which claims; by default all.
    beside : bool
        Include the experiments that decide nothing and are reported beside.
    """
    found: set[str] = set()
    for claim in CLAIMS.values() if claims is None else claims:
        found.update(claim.needs)
        if beside:
            found.update(claim.trivial, claim.remark[0] if claim.remark else ())
    return found


def deviation(value: float, target: float, tolerance: float) -> Part:
    """Return the distance of `value` from `target`, in tolerances."""
    return Part(abs(value - target) / tolerance, f"outside {target - tolerance:g}..{target + tolerance:g}")


def at_most(value: float, limit: float) -> Part:
    """Return value / limit, at least 0, when `value` is at most `limit`, else 1 plus the relative excess."""
    distance = max(0.0, value / limit) if value <= limit else 1.0 + max(_LEAST, (value - limit) / limit)
    return Part(distance, f"above {limit:.3g}")


def at_least(value: float, limit: float) -> Part:
    """Return 0 when `value` is at least `limit`, else 1 plus the relative shortfall."""
    return Part(0.0 if value >= limit else excess(value, limit), f"below {limit:.3g}")


def excess(value: float, limit: float) -> Part:
    """Return 0 when `value` is above `limit`, else 1 plus the relative shortfall."""
    distance = 0.0 if value > limit else 1.0 + max(_LEAST, (limit - value) / max(abs(limit), 1.0))
    return Part(distance, f"not above {limit:.3g}")


def below(value: float, limit: float) -> Part:
    """Return 0 when `value` is below `limit`, else 1 plus the relative excess."""
    return Part(excess(limit, value), f"not below {limit:.3g}")


def is_so(statement: Any, otherwise: str) -> Part:
    """Return 0 when a statement is true, else 2; `otherwise` says in words what is so if it is not."""
    return Part(0.0 if statement else 2.0, otherwise)


def _part(grid: pd.DataFrame, robots: tuple[int, int] = (1, 30), radius: tuple[float, float] = (1, 9)) -> pd.DataFrame:
    """Return the cells within the limits, by default those of the paper's grid, both ends included."""
    found = grid.loc[slice(*robots), slice(*radius)]
    if found.empty:
        raise ValueError(f"no cell with {robots[0]}..{robots[1]} robots and radius {radius[0]:g}..{radius[1]:g}")
    return found


def _mean(grid: pd.DataFrame) -> float:
    return float(grid.to_numpy(dtype=float).mean())


def _peak(grid: pd.DataFrame) -> tuple[float, float, str]:
    """Return the largest value of a grid, its radius, and its cell in words; of equals the first by team size."""
    cells = grid.T.unstack()
    robots, radius = cells.index[int(cells.to_numpy(dtype=float).argmax())]
    return float(cells.to_numpy().max()), float(radius), f"N = {robots}, R = {radius:g}"


def pooled(se: pd.DataFrame) -> pd.DataFrame:
    """Return the standard error of each cell, pooled with those of the cells around it.

    The standard error of five runs is uncertain: in some of 270 cells it is far too small. Pooled over 3 × 3 cells it
    has 36 degrees of freedom. With a single run the spread is unknown, and the standard error infinite.
    """
    padded = np.pad(se.to_numpy() ** 2, 1, constant_values=np.nan)
    near = np.lib.stride_tricks.sliding_window_view(padded, (3, 3)).reshape(*se.shape, 9)
    known = np.isfinite(near)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known.any(axis=-1), np.where(known, near, 0.0).sum(axis=-1) / known.sum(axis=-1), np.inf)
    return pd.DataFrame(np.sqrt(mean), index=se.index, columns=se.columns)


def _fades(profile: Any, radius: Any, faded: float) -> float:
    """Return the first radius beyond the peak at which a gain is below `faded` [pp]."""
    top = int(np.argmax(profile))
    return min((at for at, value in zip(radius[top:], profile[top:], strict=True) if value < faded), default=math.inf)


def _preferred(top: float) -> Part:
    low, high = _PREFERRED
    return is_so(low <= top <= high, f"a peak outside R = {low:g}..{high:g}")


def _later(last: float, first: float) -> Part:
    return is_so(last > first, "an end at no larger R")


def _against(last: float, first: float) -> str:
    return " against ".join("beyond 9" if end == math.inf else f"{end:g}" for end in (last, first))


def span(values: Sequence[float]) -> str:
    """Return ascending values in words, whole numbers without gaps as a range."""
    if len(values) > 2 and all(later - value == 1 for value, later in pairwise(values)):
        return f"{values[0]:g}..{values[-1]:g}"
    return ", ".join(f"{value:g}" for value in values)


@Claim(
    "§3, Figs. 1, 2",
    "inputs d against N for Θ(0), Θ(1), Θ(N), o(N); search space p^d",
    "n = 16, δ = 16, σ = 2, N = 1..30",
    "exact",
    by_construction=True,
)
def degrees() -> Finding:
    from teamsight.analysis.search_space import inputs, log10_size

    paper = {"none": (16, 0), "ring": (32, 0), "pairwise": (16, 2), "shared": (16, 16)}
    wrong = [
        f"wrong for {degree} at N = {team}"
        for degree, (fixed, per_robot) in paper.items()
        for team in range(1, 31)
        if inputs(degree, team) != fixed + per_robot * team
        or not np.isclose(log10_size(inputs(degree, team), 10), fixed + per_robot * team)
    ]
    largest = ", ".join(str(inputs(degree, 30)) for degree in paper)
    return wrong[0] if wrong else f"{largest} inputs; at N = 30", is_so(not wrong, "another number of inputs")


def _exceeded(walk: pd.DataFrame) -> str:
    """Return the probability that a run has more than 16 neighbours, in words."""
    more = int((walk["max_neighbours"] > 16).sum())
    low, high = bounds(more, len(walk), confidence=0.975)
    return f"P(more than 16 in a run at N = 30, R = 2) = {more / len(walk):.1%} ({low:.1%} to {high:.1%})"


@Claim(
    "§4, Fig. 4",
    "random walk: δ = 16 seems appropriate",
    "16",
    "maximum over all N ≤ 30, R ≥ 2 is 16 ± 2",
    ("random-walk",),
    remark=(("random-walk-crowded",), _exceeded),
)
def neighbours_random(walk: pd.DataFrame) -> Finding:
    largest = int(_part(maxima(walk), radius=(2, 9)).to_numpy().max())
    return f"{largest}", deviation(largest, 16, 2)


@Claim(
    "Fig. 4",
    "at R = 1 the maximum is not always N − 1: a robot at the border senses past the wall",
    "< N − 1 for some N",
    "at R = 1 the maximum is below N − 1 for some N",
    ("random-walk",),
)
def neighbours_small_arena(walk: pd.DataFrame) -> Finding:
    at_one = _part(maxima(walk), (2, 30), (1, 1)).iloc[:, 0]
    short = at_one[at_one < at_one.index - 1]
    found = ", ".join(f"{most} at N = {robots}" for robots, most in short.items())
    measured = f"below N − 1 for {len(short)} of {len(at_one)} N; {found}" if found else "N − 1 for every N"
    return measured, at_least(len(short), 1)


@Claim(
    "§5, Fig. 5",
    "A-CMOMMT with 5–30 robots, unless the arena is ridiculously small: the maximum varies little",
    "around 7",
    "median over the cells N = 5..30, R = 3..9 of the maximum in 5..9; at N = 30, R = 3 in 6..8",
    ("a-cmommt",),
    ("random-walk",),
)
def neighbours_acmommt(acmommt: pd.DataFrame) -> Finding:
    grid = _part(maxima(acmommt), (5, 30), (3, 9))
    cells, crowded = grid.to_numpy(), _part(grid, (30, 30), (3, 3)).to_numpy().item()
    middle = float(np.median(cells))
    measured = f"median {middle:g}, range {cells.min():.0f}..{cells.max():.0f}; {crowded:g} at N = 30, R = 3"
    return measured, deviation(middle, 7, 2), deviation(crowded, 7, 1)


@Claim(
    "Fig. 5",
    "the highest values of Figs. 4 and 5 are almost identical",
    "equal",
    "the two highest values differ by ≤ 2",
    ("random-walk", "a-cmommt"),
    ("random-walk", "random-walk"),
)
def neighbours_same_peak(*tables: pd.DataFrame) -> Finding:
    one, other = (int(table["max_neighbours"].max()) for table in tables)
    return f"{one} and {other}", deviation(one, other, 2)


@Claim(
    "§5",
    "the number of targets has little effect on the maximum",
    "little",
    "maxima with 5, 15 and 30 targets differ by ≤ 2, at N = 30 and R = 3, 5",
    ("targets-5", "targets-15", "targets-30"),
    ("random-walk-targets-5", "random-walk-targets-15", "random-walk-targets-30"),
)
def neighbours_targets(*by_targets: pd.DataFrame) -> Finding:
    grids = [maxima(table) for table in by_targets]
    found = {radius: [int(grid[radius].iloc[0]) for grid in grids] for radius in grids[0].columns}
    measured = "; ".join(f"{', '.join(map(str, values))} at R = {radius:g}" for radius, values in found.items())
    return measured, at_most(max(map(np.ptp, found.values())), 2)


@Claim(
    "§5",
    "targets that avoid robots may have a huge impact on the maximum",
    "may",
    # Whatever is measured, it may be so elsewhere.
    "",
    ("a-cmommt", "evasive"),
)
def neighbours_evasive(random: pd.DataFrame, evasive: pd.DataFrame) -> Finding:
    change = grid_of(cell_means(paired(evasive, random[random["radius"] >= 2], "max_neighbours"), "difference"))
    largest, _, cell = _peak(change.abs())
    sign = 1 if change.to_numpy().max() == largest else -1
    return (f"{sign * largest:+.1f} at {cell}; largest change of the mean of the runs' maxima, R ≥ 2",)


@Claim(
    "§6, Fig. 6",
    "centroid policy: a huge drop from R = 1 to R = 2",
    "huge",
    "mean over N ≥ 5 falls by ≥ 20 pp from R = 1 to R = 2",
    ("centroid",),
    ("random-walk",),
)
def collective_drop(centroid: pd.DataFrame) -> Finding:
    one, two = _part(percent(centroid), (5, 30), (1, 2)).mean()
    return f"{one - two:.1f} pp ({one:.0f} → {two:.0f} %)", at_least(float(one - two), 20)


@Claim(
    "§6, Fig. 6",
    "very large arenas do better than small ones",
    "larger is better",
    "mean over N ≥ 10, R = 8, 9 is more than 2 standard errors above that over N ≥ 10, R = 2, 3",
    ("centroid",),
    ("random-walk",),
)
def collective_large(centroid: pd.DataFrame) -> Finding:
    cells = cell_means(centroid, "observed_fraction")
    mean, se = (grid_of(cells, column) * 100 for column in ("mean", "se"))
    large, small = (_mean(_part(mean, (10, 30), radii)) for radii in ((8, 9), (2, 3)))
    errors = (_part(se, (10, 30), radii).to_numpy() for radii in ((8, 9), (2, 3)))
    spread = math.hypot(*(math.sqrt((one**2).sum()) / one.size for one in errors))
    return f"{large - small:+.1f} pp, se {spread:.1f}", excess(large - small, 2 * spread)


@Claim(
    "§6, Fig. 6",
    "the variation is small on average; the effect of N is only slightly perceptible",
    "small",
    "maximum minus minimum over N = 10..30, averaged over R = 3..9, ≤ 15 pp, with eight times the runs",
    ("centroid-larger-teams",),
    ("random-walk-larger-teams",),
    tuned=("idle",),
)
def collective_flat(centroid: pd.DataFrame) -> Finding:
    cells = _part(percent(centroid), (10, 30), (3, 9))
    spread = float(np.ptp(cells.to_numpy(dtype=float), axis=0).mean())
    return f"{spread:.1f} pp", at_most(spread, 15)


@Claim(
    "§6",
    "at R = 1 the policy has only a very small influence",
    "very small",
    "A-CMOMMT and centroid differ by ≤ 10 pp at R = 1 for every N ≥ 5",
    ("a-cmommt", "centroid"),
    ("random-walk", "centroid"),
)
def small_arena_policy(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    difference = _part(percent(acmommt) - percent(centroid), (5, 30), (1, 1)).iloc[:, 0].abs()
    most = float(difference.max())
    return f"up to {most:.1f} pp; {difference.mean():.1f} pp on average", at_most(most, 10)


@Claim(
    "§6, Fig. 7",
    "monotonic: falls with R, rises with N",
    "monotonic",
    "no pair of adjacent cells differs in the wrong direction by more than 4.5 pooled standard errors",
    ("a-cmommt",),
    ("random-walk",),
)
def acmommt_monotonic(acmommt: pd.DataFrame) -> Finding:
    cells = cell_means(acmommt, "observed_fraction")
    mean, se = grid_of(cells), pooled(grid_of(cells, "se"))
    worst = 0.0
    for rising, variance in ((mean, se**2), (-mean.T, se.T**2)):
        fall = -rising.diff()
        errors = fall.div(np.sqrt(variance + variance.shift())).where(fall > 0, 0.0)
        worst = max(worst, float(errors.to_numpy().max()))
    return f"worst pair {worst:.1f} se against it" if worst > 0 else "no pair against it", at_most(worst, _CHANCE)


@Claim(
    "§6, Fig. 7",
    "100 % is easily reached in small arenas",
    "100 %",
    "≥ 99 % at R ≤ 2 for N ≥ 10",
    ("a-cmommt-small-arenas",),
    ("random-walk-small-arenas",),
)
def acmommt_full(acmommt: pd.DataFrame) -> Finding:
    least = float(_part(percent(acmommt), (10, 30), (1, 2)).to_numpy().min())
    return f"≥ {least:.2f} %", at_least(least, 99)


@Claim(
    "§6, Fig. 7",
    "with 15 targets, more than 8–10 robots add little",
    "8–10",
    "increase from N = 10 to 30 below half of that from N = 1 to 10, averaged over R",
    ("a-cmommt",),
    ("random-walk",),
)
def acmommt_saturates(acmommt: pd.DataFrame) -> Finding:
    few, ten, many = (_mean(_part(percent(acmommt), (robots, robots))) for robots in (1, 10, 30))
    first, later = ten - few, many - ten
    return f"{first:+.0f} pp to N = 10, {later:+.0f} pp to 30", below(later, first / 2)


@Claim(
    "§6",
    "N = 30, R = 10 (beyond the figure's grid): targets observed",
    "7.5 of 15",
    "50 ± 8 %, with ten times the runs",
    ("a-cmommt-r10",),
    ("random-walk-r10",),
    tuned=("gain",),
)
def acmommt_r10(acmommt: pd.DataFrame) -> Finding:
    share = float(acmommt["observed_fraction"].mean() * 100)
    return f"{share:.1f} %, {0.15 * share:.1f} of 15", deviation(share, 50, 8)


@Claim(
    "§6",
    "as many still, well-placed, non-overlapping robots observe fewer than the mobile ones",
    "30 %, 4.5 of 15",
    "30 ± 3 %, and mobile robots above it, with ten times the runs",
    ("stationary-r10", "a-cmommt-r10"),
    ("stationary-r10", "random-walk-r10"),
)
def stationary_r10(*tables: pd.DataFrame) -> Finding:
    still, mobile = (float(table["observed_fraction"].mean() * 100) for table in tables)
    return f"{still:.1f} %, mobile {mobile:.1f} %", deviation(still, 30, 3), excess(mobile, still)


@Claim(
    "§6, Fig. 8",
    "A-CMOMMT minus centroid: the largest gain",
    "60 pp",
    "60 ± 10 pp in the cell with the largest gain, measured again on eight times as many fresh runs",
    ("a-cmommt-largest-gain", "centroid-largest-gain"),
    remark=(
        ("a-cmommt", "centroid"),
        lambda acmommt, centroid: f"{_peak(gain(acmommt, centroid))[0]:.1f} pp in the runs that chose the cell",
    ),
)
def awareness_gain(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    cells = cell_means(paired(acmommt, centroid), "difference")
    most, _, cell = _peak(grid_of(cells) * 100)
    width = 100 * float((cells["high"] - cells["mean"]).iloc[0])
    return f"{most:.1f} ± {width:.1f} pp at {cell}", deviation(most, 60, 10)


@Claim(
    "§6, Fig. 8",
    "the gain is largest for R = 2..6 and null for R = 8..9",
    "null at 8–9",
    "largest gain in R = 2..6, and mean over N within ±5 pp at R = 8 and at R = 9",
    ("a-cmommt", "centroid"),
    ("random-walk", "centroid"),
    tuned=("gain",),
)
def awareness_where(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    grid = gain(acmommt, centroid)
    _, top, _ = _peak(grid)
    large = _part(grid, radius=(8, 9)).mean()
    measured = ", ".join(f"{value:+.1f} pp at R = {radius:g}" for radius, value in large.items())
    return f"peak at R = {top:g}; {measured}", _preferred(top), deviation(float(large.abs().max()), 0, 5)


@Claim(
    "§6, Fig. 8",
    "for R = 2..6 the gain grows with N; with more robots it extends to larger R",
    "grows",
    "mean over N = 20..30 above that over N = 2..6 for R = 2..6, and falls below 10 pp at a larger R",
    ("a-cmommt", "centroid"),
    ("random-walk", "centroid"),
)
def awareness_robots(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Finding:
    profiles = [_part(gain(acmommt, centroid), robots).mean() for robots in ((2, 6), (20, 30))]
    few, many = (float(profile.loc[_PREFERRED[0] : _PREFERRED[1]].mean()) for profile in profiles)
    first, last = (_fades(profile.to_numpy(), profile.index, 10.0) for profile in profiles)
    measured = f"{many:.1f} against {few:.1f} pp; under 10 pp from R = {_against(last, first)}"
    return measured, excess(many, few), _later(last, first)


@Claim(
    "§7, Fig. 9",
    "the repulsive force: −1 below d1, linear to 0 at d2, 0 beyond",
    "shape",
    "exact",
    by_construction=True,
)
def repulsion() -> Finding:
    from teamsight.policies.handmade import forces

    distance, d1, d2 = np.linspace(0.0, 1.5, 3001), 0.481, 0.769
    worst = float(np.abs(forces.repulsion(distance, d1, d2) - np.interp(distance, [d1, d2], [-1.0, 0.0])).max())
    return f"largest deviation {worst:.1g}", at_most(worst, 1e-12)


def _never_less(cells: pd.DataFrame) -> tuple[str, Part]:
    """Return how far the worst cell lies below 0, in words, and its distance from the limit."""
    mean, se = grid_of(cells), pooled(grid_of(cells, "se"))
    worst, _, cell = _peak((-mean / se).where(mean < 0, 0.0))
    return f"at worst {worst:.1f} se below 0, at {cell}" if worst else "no cell below 0", at_most(worst, _CHANCE)


@Claim(
    "§7, Fig. 10",
    "awareness range 1 instead of 0.5 never observes less",
    "≥ 0 everywhere",
    "no cell more than 4.5 pooled standard errors below 0; mean > 0",
    ("a-cmommt", "half-range"),
    ("random-walk", "random-walk-half-range"),
)
def range_gain(whole: pd.DataFrame, half: pd.DataFrame) -> Finding:
    cells = cell_means(paired(whole, half), "difference")
    overall, (words, worst) = _mean(grid_of(cells)) * 100, _never_less(cells)
    return f"{overall:+.2f} pp on average; {words}", worst, excess(overall, 0)


@Claim(
    "§7",
    "a larger awareness range means more neighbours",
    "more",
    "maximum of a run at range 1 minus that at 0.5: no cell more than 4.5 pooled standard errors below 0; mean > 0",
    ("a-cmommt", "half-range"),
    ("random-walk", "random-walk-half-range"),
)
def range_neighbours(whole: pd.DataFrame, half: pd.DataFrame) -> Finding:
    cells = cell_means(paired(whole, half, "max_neighbours"), "difference")
    overall, (words, worst) = _mean(grid_of(cells)), _never_less(cells)
    fewer = (maxima(whole) < maxima(half)).to_numpy()
    return (
        f"{overall:+.1f} on average; {words}; maxima of all runs lower in {fewer.sum()} of {fewer.size} cells",
        worst,
        excess(overall, 0),
    )


def shortfall(ring: pd.DataFrame, pairwise: pd.DataFrame) -> tuple[pd.Series[float], int | None]:
    """Return by δ how much less the ring observes than Θ(N), and the smallest δ from which on it is as good, if any."""
    by_delta = {int(delta): ring[ring["delta"] == delta] for delta in np.unique(ring["delta"])}
    short = pd.Series({delta: -paired(runs, pairwise)["difference"].mean() for delta, runs in by_delta.items()})
    enough = short.index[::-1][(short[::-1] <= _EQUAL).cummin()]
    return short, None if enough.empty else int(enough[-1])


def _smallest_delta(ring: pd.DataFrame, pairwise: pd.DataFrame) -> str:
    short, enough = shortfall(ring, pairwise)
    cells = len(pairwise.groupby(["robots", "radius"]))
    found = "no δ" if enough is None else f"every δ ≥ {enough} ({-100 * short[enough]:+.2f} pp at {enough})"
    return f"as good in {cells} crowded to empty cells: {found} of those tried, {', '.join(map(str, short.index))}"


@Claim(
    "§3.4, §8",
    "with δ = 16 awareness is as good as with Θ(N)",
    "no difference",
    "A-CMOMMT under ring, δ = 16, minus pairwise: mean over the grid within ±1 pp",
    ("ring-16", "a-cmommt"),
    ("random-walk", "random-walk"),
    (("delta-ring", "delta-pairwise"), _smallest_delta),
)
def delta_sufficient(ring: pd.DataFrame, pairwise: pd.DataFrame) -> Finding:
    difference = _mean(gain(ring, pairwise))
    return f"{difference:+.2f} pp", deviation(difference, 0, 1)


def _explored(table: pd.DataFrame) -> str:
    """Return number and size of the explorations of a table, in words."""
    first = table.iloc[0]
    return (
        f"{table['exploration'].nunique()} explorations of {first['transitions']:g} transitions in an arena of R = "
        f"{first['explored_radius']:g}"
    )


@Claim(
    "§8.2",
    "the lazy memory: 120 steps × 5 robots among 10 targets, random rotation and distance",
    "600 transitions",
    "exact in every exploration of the setting; rotations and distances uniform: no p-value (Kolmogorov–Smirnov) below "
    "1 % over the number of tests",
    ("literal-cooperative",),
    by_construction=True,
)
def memory_size(cooperative: pd.DataFrame) -> Finding:
    found = cooperative.drop_duplicates("exploration")
    sizes = found[["transitions", "explorers", "explored_steps", "explored_targets"]].drop_duplicates().to_numpy()
    likelihoods = found[["rotation_p", "distance_p"]].to_numpy()
    measured = "; ".join(
        f"{transitions:g} transitions; {steps:g} steps × {robots:g} robots among {targets:g} targets"
        for transitions, robots, steps, targets in sizes
    )
    return (
        f"{measured}, in {_explored(cooperative)}; rotations and distances: smallest of {likelihoods.size} p-values "
        f"{likelihoods.min():.2g}",
        is_so(sizes.tolist() == [[600, 5, 120, 10]], "another size"),
        at_least(float(likelihoods.min()), _UNLIKELY / likelihoods.size),
    )


def null_rate(rule: Rule, gains: Gains) -> float:
    """Return how often a rule holds if awareness makes no difference.

    Under this null, cooperative and collective are exchangeable: the sign of the gain of each exploration is drawn at
    random, all its cells together.
    """
    signs = np.random.default_rng(_SEED).choice([-1.0, 1.0], size=(_DRAWS, len(gains.values)))
    holds = [max(rule(gains._replace(values=gains.values * one[:, None, None]))[1:]) <= 1 for one in signs]
    return float(np.mean(holds))


def _named(reading: Reading, table: pd.DataFrame) -> str:
    return f"{reading.title} (reward {reading.reward}, {_explored(table)})"


def _other(table: pd.DataFrame, finding: Finding) -> str:
    """Return what the other learner gives under a rule, in words."""
    measured, *distances = finding
    verdict = "holds" if max(distances) <= 1 else "differs"
    return f"not the paper's learner, {_named(SLOPES, table)}: {verdict}, {measured}"


def _beside(rule: Rule, *tables: pd.DataFrame) -> str:
    """Return what the other learner gives under a rule, and how often each holds by chance, in words."""
    own, other = gains_of(*tables[:2]), gains_of(*tables[2:])
    return (
        f"{_named(LITERAL, tables[0])}: if the sign of each exploration's gain is random, the rule holds in "
        f"{null_rate(rule, own):.1%} of {_DRAWS} draws; {_other(tables[2], rule(other))} (random signs: "
        f"{null_rate(rule, other):.1%})"
    )


def _learned(statement: str, figure: str, rule: str) -> Callable[[Rule], Rule]:
    """Return a decorator that registers a rule on the gain of learned teams, and returns it."""
    needs = ("literal-cooperative", "literal-collective")

    def register(decide: Rule) -> Rule:
        remark = ((*needs, "slopes-cooperative", "slopes-collective"), partial(_beside, decide))
        name = decide.__name__.replace("_", "-")
        CLAIMS[name] = Claim(
            "§8.2, Fig. 11", statement, figure, rule, needs, remark=remark,
            decide=lambda cooperative, collective: decide(gains_of(cooperative, collective)),
        )  # fmt: skip
        return decide

    return register


def _ends(interval: Interval, digits: int = 1) -> str:
    """Return the ends of an interval in words."""
    return f"({interval.low:+.{digits}f} to {interval.high:+.{digits}f})"


@_learned(
    "lazy learning: cooperative (32 inputs) minus collective (16)",
    "up to 25 pp",
    "largest cell of the mean surface over the explorations 25 ± 8 pp",
)
def learned_gain(gains: Gains) -> Finding:
    row, column = np.unravel_index(gains.mean().argmax(), gains.values.shape[1:])
    values = gains.values[:, row, column]
    most = interval_of(values[np.isfinite(values)])
    cell = f"N = {gains.robots[row]}, R = {gains.radius[column]:g}"
    return f"{most.mean:.1f} pp {_ends(most)}; at {cell}", deviation(most.mean, 25, 8)


@_learned(
    "the gain is largest for R = 2..6 and grows with N",
    "shape",
    "of the mean surface over the explorations: peak in R = 2..6; mean over N within ±5 pp at R = 8 and at R = 9; "
    "for R = 2..6 mean over N = 20..30 above that over N = 2..6 (interval above 0), and falls below a sixth of the "
    "largest gain at a larger R",
)
def learned_shape(gains: Gains) -> Finding:
    mean, radius = gains.mean(), gains.radius
    top, by_radius, faded = radius[mean.max(axis=0).argmax()], mean.mean(axis=0), _FADED * float(mean.max())
    few, many = ((gains.robots >= least) & (gains.robots <= most) for least, most in ((2, 6), (20, 30)))
    preferred = (radius >= _PREFERRED[0]) & (radius <= _PREFERRED[1])
    growth = clustered(gains.values, gains.weights(many, preferred) - gains.weights(few, preferred))
    first, last = (_fades(mean[team].mean(axis=0), radius, faded) for team in (few, many))
    places = f"at R = {span(radius.tolist())}: {', '.join(f'{value:+.1f}' for value in by_radius)} pp"
    return (
        f"peak at R = {top:g}; mean over N {places}; many less few robots {growth.mean:+.1f} pp {_ends(growth)}; under "
        f"{faded:.2g} pp from R = {_against(last, first)}",
        _preferred(top),
        deviation(np.abs(by_radius[np.isin(radius, (8, 9))]).max(initial=0.0), 0, 5),
        excess(growth.low, 0),
        _later(last, first),
    )


@_learned(
    "in very large arenas with few robots awareness slightly hurts",
    "slightly negative",
    "mean over N ≤ 8, R ≥ 7 and the explorations below 0 (interval below 0)",
)
def learned_hurts(gains: Gains) -> Finding:
    loss = gains.average(gains.robots <= 8, gains.radius >= 7)
    return f"{loss.mean:+.2f} pp {_ends(loss, 2)}", below(loss.high, 0)


@Claim(
    "§8.2; §10 says “compared well”",
    "learning does not reach A-CMOMMT",
    "below",
    "means over the grid and the explorations: cooperative minus a random walk above 0 (interval above 0), minus "
    "A-CMOMMT below 0 (interval below 0)",
    ("literal-cooperative", "random-walk-more", "a-cmommt-more"),
    remark=(
        ("slopes-cooperative", "random-walk-more", "a-cmommt-more"),
        lambda *tables: _other(tables[0], CLAIMS["learned-below-designed"].decide(*tables)),
    ),
)
def learned_below_designed(cooperative: pd.DataFrame, walk: pd.DataFrame, acmommt: pd.DataFrame) -> Finding:
    more, less = (gains_of(cooperative, base).average() for base in (walk, acmommt))
    walked, designed = (_mean(percent(table)) for table in (walk, acmommt))
    return (
        f"{more.mean:+.1f} pp over a random walk; {_ends(more)}; {less.mean:+.1f} pp over A-CMOMMT {_ends(less)}; "
        f"random walk {walked:.1f} %, A-CMOMMT {designed:.1f} %",
        excess(more.low, 0),
        below(less.high, 0),
    )
