"""Simulate the coverage of the 95 % interval that is left when a study stops adding replicates.

python benchmarks/adaptive_coverage.py

Each row is a distribution of a measure; each column, the replicates that a study of fixed size would need for the
wanted interval. "naive" stops at the first of 10, 11, 12, … replicates whose interval is narrow enough; "studies" is
the rule of `teamsight.analysis.studies.standing`; "flag" is that rule for True and False. The last rows are the rule
of Figure 11 of Touzet (2000), with its first look, its limit and its width, for gains of some standard deviations.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from teamsight.analysis.papers.touzet2000 import Touzet
from teamsight.analysis.papers.touzet2000.experiments import EXPLORATIONS, FIRST_EXPLORATIONS
from teamsight.analysis.studies.definition.model import Until
from teamsight.analysis.studies.standing import FIRST_LOOK, Present, all_needed

SETTINGS = 10_000
# Settings that are drawn at a time.
BLOCK = 2_000
NEEDED = (12, 20, 28, 36, 50, 80)

Values = NDArray[np.float64]
Draw = Callable[[np.random.Generator, tuple[int, int]], Values]
Rule = Callable[[Values, float], NDArray[np.int64]]


def happens(probability: float) -> tuple[Draw, float, float]:
    """Return a measure that is 1 with a probability, and otherwise 0."""
    spread = math.sqrt(probability * (1 - probability))
    return (lambda rng, shape: (rng.random(shape) < probability).astype(float)), probability, spread


#: A measure by name: how it is drawn, its mean and its standard deviation.
NUMBERS: dict[str, tuple[Draw, float, float]] = {
    "normal": (lambda rng, shape: rng.normal(0, 1, shape), 0.0, 1.0),
    "uniform": (lambda rng, shape: rng.uniform(0, 1, shape), 0.5, math.sqrt(1 / 12)),
    "skewed, beta(2, 5)": (lambda rng, shape: rng.beta(2, 5, shape), 2 / 7, math.sqrt(10 / 392)),
    "counts, Poisson(3)": (lambda rng, shape: rng.poisson(3, shape).astype(float), 3.0, math.sqrt(3)),
    "lognormal(0, 1)": (
        lambda rng, shape: rng.lognormal(0, 1, shape), math.exp(0.5), math.sqrt((math.e - 1) * math.e)
    ),
}  # fmt: skip
CHANCES = (0.5, 0.1, 0.02, 0.01)
#: Standard deviations of the gain of a cell of Figure 11 [percentage points].
SPREADS = (1, 2, 3, 4, 5, 6, 8, 10)


def naive(values: Values, width: float) -> NDArray[np.int64]:
    """Return where the interval is narrow enough for the first time."""
    n = np.arange(1, values.shape[1] + 1)
    mean = np.cumsum(values, axis=1) / n
    variance = np.maximum(np.cumsum(values**2, axis=1) - n * mean**2, 0) / np.maximum(n - 1, 1)
    is_narrow = (2 * stdtrit(np.maximum(n - 1, 1), 0.975) * np.sqrt(variance / n) <= width) & (n >= 10)
    is_narrow[:, -1] = True
    found: NDArray[np.int64] = is_narrow.argmax(axis=1) + 1
    return found


def of_studies(
    values: Values, width: float, *, is_flag: bool = False, first_look: int = FIRST_LOOK
) -> NDArray[np.int64]:
    """Return the replicates that a study makes."""
    settings, most = values.shape
    setting, replicate = np.divmod(np.arange(values.size), most)
    until = Until(width, limit=most)
    present = Present(setting, replicate, np.zeros(values.size, bool), values.ravel(), is_flag)
    return all_needed(until, 1, present, settings, first_look)[0]


def of_flags(values: Values, width: float) -> NDArray[np.int64]:
    """Return the replicates that a study of a flag makes."""
    return of_studies(values, width, is_flag=True)


def of_figure_11(values: Values, width: float) -> NDArray[np.int64]:
    """Return the explorations of a cell of Figure 11."""
    return of_studies(values, width, first_look=FIRST_EXPLORATIONS)


def covers(values: Values, count: NDArray[np.int64], mean: float, *, is_flag: bool) -> NDArray[np.bool_]:
    """Return whether the interval of the first replicates of each setting covers the mean."""
    shown = np.where(np.arange(values.shape[1]) < count[:, None], values, np.nan)
    middle = np.nanmean(shown, axis=1)
    if is_flag:
        # Wilson's interval are the probabilities that a test of the normal score does not reject.
        found: NDArray[np.bool_] = np.abs(middle - mean) <= 1.959964 * np.sqrt(mean * (1 - mean) / count)
        return found
    half = stdtrit(count - 1, 0.975) * np.nanstd(shown, axis=1, ddof=1) / np.sqrt(count)
    inside: NDArray[np.bool_] = np.abs(middle - mean) <= half
    return inside


def coverage(measure: tuple[Draw, float, float], needed: int, rule: Rule) -> tuple[float, float]:
    """Return the share of intervals that cover the mean, and the mean number of replicates."""
    return covered_by(measure, 2 * 1.96 * measure[2] / math.sqrt(needed), 4 * needed + 200, rule, needed)


def covered_by(
    measure: tuple[Draw, float, float], width: float, most: int, rule: Rule, seed: int
) -> tuple[float, float]:
    """Return the share of intervals that cover the mean, and the mean number of replicates, of which most are given."""
    draw, mean, _ = measure
    rng, covered, replicates = np.random.default_rng(seed), 0, 0
    for _ in range(SETTINGS // BLOCK):
        values = draw(rng, (BLOCK, most))
        count = rule(values, width)
        covered += int(covers(values, count, mean, is_flag=rule is of_flags).sum())
        replicates += int(count.sum())
    return covered / SETTINGS, replicates / SETTINGS


def main() -> None:
    """Print the table."""
    print(f"coverage [%] (mean replicates), {SETTINGS:,} settings each; the standard error is 0.2 %")
    print(f"{'replicates needed':30}" + "".join(f"{needed:>13}" for needed in NEEDED))
    chances = {f"happens with {chance:g}": happens(chance) for chance in CHANCES}
    cases: list[tuple[str, tuple[Draw, float, float], Rule]] = []
    for name, measure in {**NUMBERS, **chances}.items():
        cases += [(f"{name}, naive", measure, naive), (f"{name}, studies", measure, of_studies)]
    cases += [(f"{name}, flag", measure, of_flags) for name, measure in chances.items()]
    for name, measure, rule in cases:
        found = [coverage(measure, needed, rule) for needed in NEEDED]
        print(f"{name:30}" + "".join(f"{share * 100:7.1f} ({n:3.0f})" for share, n in found), flush=True)
    plan = Touzet()
    print(f"{'figure 11: standard deviation':30}" + "".join(f"{spread:>13}" for spread in SPREADS))
    for name in ("normal", "uniform", "skewed, beta(2, 5)"):
        draw, mean, deviation = NUMBERS[name]
        found = [
            covered_by(
                (draw, mean, deviation), plan.interval * deviation / spread, EXPLORATIONS * plan.runs, of_figure_11, 11
            )
            for spread in SPREADS
        ]
        print(f"{name:30}" + "".join(f"{share * 100:7.1f} ({n:3.0f})" for share, n in found), flush=True)


if __name__ == "__main__":
    main()
