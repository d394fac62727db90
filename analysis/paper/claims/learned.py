"""Claims about the gain from awareness of learned teams (section 8, Fig. 11), judged on many explorations.

The paper's learner decides, as it is printed. What another learner gives under the same rule stands beside it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.paper.claims.conditions import span
from teamsight.analysis.paper.claims.interface import PREFERRED, Finding, Remark, above, at_least, claim, within
from teamsight.analysis.paper.lazy_teams import LITERAL, SLOPES, Reading
from teamsight.analysis.paper.learned_gain import Gains, gains_of
from teamsight.analysis.stats.paired import Interval, interval_of

#: What "null" means where the gain of A-CMOMMT is at most 60 pp, as a share of the largest gain.
_FADED = 1 / 6
# Rotations and distances of an exploration are not random if a p-value is below this, over the number of tests.
_UNLIKELY = 0.01
# How often the null is drawn, and from which seed.
_DRAWS, _SEED = 1_000, 11

_NEEDS = (LITERAL.cooperative, LITERAL.collective)
_BOTH = (*_NEEDS, SLOPES.cooperative, SLOPES.collective)

#: Takes gains and returns what was measured, in words, and the distance from each part of a rule.
Rule = Callable[[Gains], Finding]


def _beside(
    rule: Rule,
    cooperative: pd.DataFrame,
    collective: pd.DataFrame,
    slopes_cooperative: pd.DataFrame,
    slopes_collective: pd.DataFrame,
) -> str:
    """Return what the other learner gives under a rule, and how often each holds by chance, in words."""
    own, other = gains_of(cooperative, collective), gains_of(slopes_cooperative, slopes_collective)
    measured, *distances = rule(other)
    return (
        f"{_named(LITERAL, cooperative)}: if the sign of each exploration's gain is random, the rule holds in "
        f"{null_rate(rule, own):.1%} of {_DRAWS} draws; not the paper's learner, {_named(SLOPES, slopes_cooperative)}: "
        f"{'holds' if max(distances) <= 1 else 'differs'}, {measured} (random signs: {null_rate(rule, other):.1%})"
    )


@claim(
    where="§8.2",
    statement="the lazy memory: 120 steps × 5 robots among 10 targets, random rotation and distance",
    figure="600 transitions",
    rule=(
        "exact in every exploration of the setting; rotations and distances uniform: no p-value (Kolmogorov–Smirnov) "
        "below 1 % over the number of tests"
    ),
    needs=(LITERAL.cooperative,),
    by_construction=True,
)
def memory_size(cooperative: pd.DataFrame) -> Finding:
    found = cooperative.drop_duplicates("exploration")
    sizes = found[["transitions", "explorers", "explored_steps", "explored_targets"]].drop_duplicates()
    exact = sizes.to_numpy().tolist() == [[600, 5, 120, 10]]
    likelihoods = found[["rotation_p", "distance_p"]].to_numpy()
    least, limit = float(likelihoods.min()), _UNLIKELY / likelihoods.size
    measured = "; ".join(
        f"{transitions} transitions; {steps} steps × {robots} robots among {targets} targets"
        for transitions, robots, steps, targets in sizes.itertuples(index=False)
    )
    return (
        f"{measured}, in {_explored(cooperative)}; rotations and distances: smallest of {likelihoods.size} p-values "
        f"{least:.2g}",
        0.0 if exact else 2.0,
        at_least(least / limit, 1.0),
    )


@claim(
    where="§8.2, Fig. 11",
    statement="lazy learning: cooperative (32 inputs) minus collective (16)",
    figure="up to 25 pp",
    rule="largest cell of the mean surface over the explorations 25 ± 8 pp",
    needs=_NEEDS,
    remark=Remark(_BOTH, lambda *tables: _beside(_largest, *tables)),
)
def learned_gain(cooperative: pd.DataFrame, collective: pd.DataFrame) -> Finding:
    return _largest(gains_of(cooperative, collective))


def _largest(gains: Gains) -> Finding:
    row, column = np.unravel_index(int(gains.mean.argmax()), gains.mean.shape)
    most = interval_of(gains.values[:, row, column])
    cell = f"N = {gains.robots[row]}, R = {gains.radius[column]:g}"
    return f"{most.mean:.1f} pp {_ends(most)}; at {cell}", within(most.mean, 25, 8)


@claim(
    where="§8.2, Fig. 11",
    statement="the gain is largest for R = 2..6 and grows with N",
    figure="shape",
    rule=(
        "of the mean surface over the explorations: peak in R = 2..6; mean over N within ±5 pp at R = 8 and at R = 9; "
        "for R = 2..6 mean over N = 20..30 above that over N = 2..6 (interval above 0), and falls below a sixth of the "
        "largest gain at a larger R"
    ),
    needs=_NEEDS,
    remark=Remark(_BOTH, lambda *tables: _beside(_shape, *tables)),
)
def learned_shape(cooperative: pd.DataFrame, collective: pd.DataFrame) -> Finding:
    return _shape(gains_of(cooperative, collective))


def _shape(gains: Gains) -> Finding:
    mean, radius = gains.mean, gains.radius
    top, by_radius = radius[int(mean.max(axis=0).argmax())], mean.mean(axis=0)
    large = {one: float(mean[:, radius == one].mean()) for one in (8.0, 9.0) if one in radius}
    few, many = (_among(gains, *limits) for limits in ((2, 6), (20, 30)))
    preferred = (radius >= PREFERRED[0]) & (radius <= PREFERRED[1])
    growth = interval_of((many - few)[:, preferred].mean(axis=1))
    faded = _FADED * float(mean.max())
    first, last = (_fades(profile.mean(axis=0), radius, faded) for profile in (few, many))
    ends = " against ".join("beyond 9" if end == np.inf else f"{end:g}" for end in (last, first))
    places = f"at R = {span([*map(float, radius)])}: {', '.join(f'{value:+.1f}' for value in by_radius)} pp"
    return (
        f"peak at R = {top:g}; mean over N {places}; many less few robots {growth.mean:+.1f} pp {_ends(growth)}; under "
        f"{faded:.2g} pp from R = {ends}",
        at_least(float(PREFERRED[0] <= top <= PREFERRED[1]), 1),
        within(max(map(abs, large.values()), default=0.0), 0, 5),
        above(growth.low, 0),
        at_least(float(last > first), 1),
    )


def _among(gains: Gains, least: int, most: int) -> NDArray[np.float64]:
    """Return the mean over team sizes within limits, shape (explorations, radii)."""
    chosen = (gains.robots >= least) & (gains.robots <= most)
    if not chosen.any():
        raise ValueError(f"no cell with {least}..{most} robots")
    return np.asarray(gains.values[:, chosen].mean(axis=1))


def _fades(profile: NDArray[np.float64], radius: NDArray[np.float64], faded: float) -> float:
    """Return the first radius beyond the peak at which the gain is below `faded` [pp]."""
    peak = int(profile.argmax())
    return float(min(radius[peak:][profile[peak:] < faded], default=np.inf))


@claim(
    where="§8.2, Fig. 11",
    statement="in very large arenas with few robots awareness slightly hurts",
    figure="slightly negative",
    rule="mean over N ≤ 8, R ≥ 7 and the explorations below 0 (interval below 0)",
    needs=_NEEDS,
    remark=Remark(_BOTH, lambda *tables: _beside(_hurt, *tables)),
)
def learned_hurts(cooperative: pd.DataFrame, collective: pd.DataFrame) -> Finding:
    return _hurt(gains_of(cooperative, collective))


def _hurt(gains: Gains) -> Finding:
    of_radius = gains.values[:, :, gains.radius >= 7]
    loss = interval_of(of_radius[:, gains.robots <= 8].mean(axis=(1, 2)))
    return f"{loss.mean:+.2f} pp {_ends(loss, 2)}", above(0, loss.high)


@claim(
    where="§8.2; §10 says “compared well”",
    statement="learning does not reach A-CMOMMT",
    figure="below",
    rule=(
        "means over the grid and the explorations: cooperative minus a random walk above 0 (interval above 0), minus "
        "A-CMOMMT below 0 (interval below 0)"
    ),
    needs=(LITERAL.cooperative, "random-walk-more", "a-cmommt-more"),
    remark=Remark((SLOPES.cooperative, "random-walk-more", "a-cmommt-more"), lambda *tables: _other_between(*tables)),
)
def learned_below_designed(cooperative: pd.DataFrame, walk: pd.DataFrame, acmommt: pd.DataFrame) -> Finding:
    more, less = (gains_of(cooperative, base).average() for base in (walk, acmommt))
    observed = 100 * walk["observed_fraction"].mean(), 100 * acmommt["observed_fraction"].mean()
    return (
        f"{more.mean:+.1f} pp over a random walk; {_ends(more)}; {less.mean:+.1f} pp over A-CMOMMT {_ends(less)}; "
        f"random walk {observed[0]:.1f} %, A-CMOMMT {observed[1]:.1f} %",
        above(more.low, 0),
        above(0, less.high),
    )


def _other_between(cooperative: pd.DataFrame, walk: pd.DataFrame, acmommt: pd.DataFrame) -> str:
    measured, *distances = learned_below_designed.decide(cooperative, walk, acmommt)
    verdict = "holds" if max(distances) <= 1 else "differs"
    return f"not the paper's learner, {_named(SLOPES, cooperative)}: {verdict}, {measured}"


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


def _explored(table: pd.DataFrame) -> str:
    """Return number and size of the explorations of a table, in words."""
    first = table.iloc[0]
    return (
        f"{table['exploration'].nunique()} explorations of {first['transitions']:g} transitions in an arena of R = "
        f"{first['explored_radius']:g}"
    )


def _ends(interval: Interval, digits: int = 1) -> str:
    """Return the ends of an interval in words."""
    return f"({interval.low:+.{digits}f} to {interval.high:+.{digits}f})"
