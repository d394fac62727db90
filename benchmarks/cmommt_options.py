"""Screen options of B-CMOMMT and P-CMOMMT over the N × R scenarios of the benchmark, on worlds of their own.

The best of each are the teams `b-cmommt, strongest` and `p-cmommt, strongest` of `teamsight benchmark`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import product
from typing import Any

from teamsight.analysis import benchmark
from teamsight.analysis.plot import markdown
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import interval_of

WANDERING: dict[str, Any] = {"idle": "wander", "turn_probability": 0.0}


def main() -> None:
    """Parse the command line, simulate and print the best of each policy."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10, help="runs of each scenario")
    parser.add_argument("--best", type=int, default=5, help="rows for each policy")
    options = parser.parse_args()
    benchmark.ROOT = root("benchmark: screen")
    for name, choices in (("b-cmommt", of_b()), ("p-cmommt", of_p())):
        entrants = {str(one): benchmark.Entrant(name, "shared", one) for one in choices}
        results = benchmark.run(entrants, options.runs, timed=False)
        found = {one: results.percent(one, benchmark.base_names()) for one in entrants}
        means = {one: interval_of(part.mean(axis=0)) for one, part in found.items() if part is not None}
        best = sorted(means, key=lambda one: -means[one].mean)[: options.best]
        rows = [[one, f"{means[one].mean:.2f}"] for one in best]
        print(markdown.table((f"{name}, {len(means)} options", "observed [%]"), rows))


def of_b() -> Iterator[dict[str, Any]]:
    """Yield options of B-CMOMMT; the defaults are the first."""
    yield {}
    repulsions: tuple[dict[str, float], ...] = ({}, {"dr1": 0.0, "dr2": 0.0})
    for weights, escape, answer, repulsion in product(
        ("nearest", "shared", "none"), (0.6, 0.8, 1.0), (0.0, 0.5, 1.0, 2.0), repulsions
    ):
        yield WANDERING | {"weights": weights, "escape": escape, "answer": answer} | repulsion


def of_p() -> Iterator[dict[str, Any]]:
    """Yield options of P-CMOMMT; the defaults are the first."""
    yield {}
    evennesses, gains = (0.1, 0.25, 0.5, 1.0), (1.0, 2.0, 4.0, 8.0)
    for weights, evenness, gain in product(("nearest", "shared", "per-teammate"), evennesses, gains):
        yield WANDERING | {"weights": weights, "evenness": evenness, "gain": gain}


if __name__ == "__main__":
    main()
