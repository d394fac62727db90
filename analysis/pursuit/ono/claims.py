"""The claims on modular learners that can fail: O1 to O4, Whitehead's small case, and δ by distance."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from teamsight.analysis.pursuit.ono.conditions import SIDE, SMALL
from teamsight.analysis.pursuit.ono.rates import early_rates, late_rates, late_steps, random_steps
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above

#: At least by this factor learners must be faster.
FACTOR = 10.0
#: Each interval of two that are compared has this level, so that both hold with 95 %.
_BOTH = 0.975

Decide = Callable[[pd.DataFrame], Verdict]


def verdicts(table: pd.DataFrame) -> list[Verdict]:
    """Return the verdicts on all claims whose conditions are in the table."""
    have = set(table["condition"])
    return [decide(table) for needs, decide in CLAIMS if have.issuperset(needs)]


def shown(interval: Interval) -> str:
    """Return a number of steps and its interval; of one that is infinite only the bound is known."""
    mean, low, high = interval
    if not math.isfinite(mean):
        return f"more than {low:,.0f}"
    return f"{mean:,.0f} ({low:,.0f} to {'∞' if not math.isfinite(high) else f'{high:,.0f}'})"


def _times(factors: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Interval:
    """Return the geometric mean of some factors, given as log10, with its interval."""
    return Interval(*(float(10.0 ** min(one, 300.0)) for one in interval_of(factors)))


def _factor(interval: Interval) -> str:
    mean, low, high = (f"{one:,.0f}" if one >= 100 else f"{one:.3g}" for one in interval)
    return f"{mean} times ({low} to {high})"


def _learns(condition: str) -> tuple[Sequence[str], Decide]:
    random = f"random, side {SIDE}"

    def decide(table: pd.DataFrame) -> Verdict:
        ours, chance = late_steps(table, condition, _BOTH), random_steps(table, random, _BOTH)
        verdict = UNDECIDED
        if chance.low >= FACTOR * ours.high:
            verdict = HOLDS
        elif chance.high < FACTOR * ours.low:
            verdict = FAILS
        measured = f"random {shown(chance)} steps; at the end of learning {shown(ours)}"
        claim = f"O1, {condition}: modular learners need at most a tenth of the steps of random hunters"
        return Verdict(claim, "Ono and Fukumoto", measured, verdict)

    return (random, condition), decide


def _faster(better: str, worse: str, claim: str, source: str, least: float = 1.0) -> tuple[Sequence[str], Decide]:
    """A claim that one condition captures more often at the end of learning, by a factor; runs are paired."""

    def decide(table: pd.DataFrame) -> Verdict:
        found = _times(late_rates(table, better) - late_rates(table, worse))
        measured = f"{better} / {worse}: {_factor(found)} as many captures at the end"
        return Verdict(claim, source, measured, above(found, least))

    return (better, worse), decide


def _earlier(table: pd.DataFrame) -> Verdict:
    modular, whole = _SMALL
    found = _times(early_rates(table, modular) - early_rates(table, whole))
    measured = f"{_factor(found)} as many captures in the first tenth of the steps"
    return Verdict(
        f"On a torus of side {SMALL} modules learn faster than one table over all", "Whitehead et al.", measured,
        above(found, 1.0),
    )  # fmt: skip


def _specialise(condition: str) -> tuple[Sequence[str], Decide]:
    def decide(table: pd.DataFrame) -> Verdict:
        runs = table[(table["condition"] == condition) & (table["watched"] > 0)]
        excess = (runs["information"] - runs["chance"]).to_numpy(float)
        claim = f"O3, {condition}: hunters specialise, each in some sides of the prey"
        if not len(excess):
            return Verdict(claim, "Ono and Fukumoto", "no captures at the end", UNDECIDED)
        found = interval_of(excess)
        measured = (
            f"mutual information {runs['information'].mean():.2f} bit, by chance {runs['chance'].mean():.3f}: "
            f"{found.mean:+.2f} ({found.low:+.2f} to {found.high:+.2f}), of 2".replace("-", "−")
        )
        return Verdict(claim, "Ono and Fukumoto", measured, above(found))

    return (condition,), decide


_SMALL = (f"modular, side {SMALL}", f"monolithic, side {SMALL}")

#: The claims: the conditions that each reads, and the function that decides it.
CLAIMS: tuple[tuple[Sequence[str], Decide], ...] = (
    _learns("modular, depth 2"),
    _learns("modular, depth 3"),
    _faster(
        "modular, depth 2", "monolithic, depth 2",
        "O2: one table over all captures less than a tenth as often, after the same steps", "Ono and Fukumoto", FACTOR,
    ),
    _specialise("modular, depth 2"),
    _specialise("modular, depth 3"),
    (_SMALL, _earlier),
    _faster(
        _SMALL[1], _SMALL[0], f"On a torus of side {SMALL} modules end below one table over all", "Whitehead et al."
    ),
    _faster("nearest 3, depth 2", "nearest 2, depth 2", "With the δ nearest, δ = 2 is below δ = N − 1 = 3", "ours"),
    _faster("nearest 2, depth 2", "nearest 1, depth 2", "So is δ = 1 below δ = 2", "ours"),
)  # fmt: skip
