"""Simulate the coverage of the 95 % interval that is left when a study stops adding replicates.

python benchmarks/adaptive_coverage.py

Each row is a distribution of a measure; each column, the replicates that a study of fixed size would need for the
wanted interval. "naive" stops at the first of 10, 11, 12, … replicates whose interval is narrow enough; "studies" is
the rule of `teamsight.analysis.studies.adaptive`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from teamsight.analysis.studies.adaptive import FIRST_LOOK, NARROW_LOOKS, looks
from teamsight.analysis.studies.definition.recording import Until

SETTINGS = 20_000
NEEDED = (12, 20, 28, 36, 50, 80)

Draw = Callable[[np.random.Generator, tuple[int, int]], NDArray[np.float64]]
#: A measure by name: how it is drawn, its mean and its standard deviation.
MEASURES: dict[str, tuple[Draw, float, float]] = {
    "normal": (lambda rng, shape: rng.normal(0, 1, shape), 0.0, 1.0),
    "uniform": (lambda rng, shape: rng.uniform(0, 1, shape), 0.5, math.sqrt(1 / 12)),
    "skewed, beta(2, 5)": (lambda rng, shape: rng.beta(2, 5, shape), 2 / 7, math.sqrt(10 / 392)),
    "counts, Poisson(3)": (lambda rng, shape: rng.poisson(3, shape).astype(float), 3.0, math.sqrt(3)),
}


def coverage(draw: Draw, mean: float, deviation: float, needed: int, first: int, growth: bool) -> tuple[float, float]:
    """Return the share of intervals that cover the mean, and the mean number of replicates."""
    width, most = 2 * 1.96 * deviation / math.sqrt(needed), 4 * needed + 100
    values = draw(np.random.default_rng(needed), (SETTINGS, most)) - mean
    sums, squares = np.cumsum(values, axis=1), np.cumsum(values**2, axis=1)
    done, narrow = np.zeros(SETTINGS, bool), np.zeros(SETTINGS, int)
    covered, replicates = 0, 0
    for n in looks(Until(width, limit=most), first) if growth else count(first):
        middle = sums[:, n - 1] / n
        variance = np.maximum(squares[:, n - 1] - n * middle**2, 0) / (n - 1)
        half = stdtrit(n - 1, 0.975) * np.sqrt(variance / n)
        narrow = np.where(2 * half <= width, narrow + 1, 0)
        stops = ~done & ((narrow >= (NARROW_LOOKS if growth else 1)) | (n == most))
        covered += int((np.abs(middle) <= half)[stops].sum())
        replicates += n * int(stops.sum())
        done |= stops
        if done.all():
            break
    return covered / SETTINGS, replicates / SETTINGS


def main() -> None:
    """Print the table."""
    print(f"coverage [%] (mean replicates), {SETTINGS:,} settings each; the standard error is 0.16 %")
    print(f"{'replicates needed':30}" + "".join(f"{needed:>13}" for needed in NEEDED))
    for name, (draw, mean, deviation) in MEASURES.items():
        for rule, first, growth in (("naive", 10, False), ("studies", FIRST_LOOK, True)):
            found = [coverage(draw, mean, deviation, needed, first, growth) for needed in NEEDED]
            print(f"{name + ', ' + rule:30}" + "".join(f"{share * 100:7.1f} ({n:3.0f})" for share, n in found))


if __name__ == "__main__":
    main()
