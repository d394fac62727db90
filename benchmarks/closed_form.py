"""Compare the closed form for the largest number of neighbours with random walks, as a table in Markdown.

python benchmarks/closed_form.py [--runs 2000]
"""

from __future__ import annotations

import argparse
from itertools import product

from teamsight import run_many
from teamsight.analysis.delta.closed_form import predict
from teamsight.analysis.plot.markdown import table
from teamsight.analysis.runs.seeds import model_seed, root

ROBOTS, RADII, SPEED, STEPS = (5, 10, 30, 50), (1.5, 2.0, 3.0, 5.0, 8.0), 0.1, 600
RISKS = (0.05, 0.01)


def main() -> None:
    """Simulate the grid, and print δ for two risks and P(max > δ), simulated and predicted."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=2000, help="runs of each cell")
    runs = parser.parse_args().runs
    columns = ["N", "R", "E[max]", *(f"δ for {risk:g}" for risk in RISKS), *(f"P(max > δ), {risk:g}" for risk in RISKS)]
    print(table(columns, [row(robots, radius, runs) for robots, radius in product(ROBOTS, RADII)]))


def row(robots: int, radius: float, runs: int) -> list[str]:
    """Return a line of the table; δ is the simulated one, and pairs are simulated / predicted."""
    walk = {"policy": "random-walk", "awareness": "none", "robot_speed": SPEED, "targets": 1}
    seeds = [model_seed(root("closed form: report"), run, robots, 1, radius) for run in range(runs)]
    largest = run_many({**walk, "robots": robots, "radius": radius}, steps=STEPS, seeds=seeds)["max_neighbours"]
    closed = predict(robots, radius, steps=STEPS, speed=SPEED)
    deltas = [next(delta for delta in range(robots) if (largest > delta).mean() <= risk) for risk in RISKS]
    return [
        f"{robots}",
        f"{radius:g}",
        f"{largest.mean():.1f} / {closed.expected_maximum:.1f}",
        *(f"{delta} / {closed.delta(risk)}" for delta, risk in zip(deltas, RISKS, strict=True)),
        *(f"{(largest > delta).mean():.3f} / {closed.exceedance(delta):.3f}" for delta in deltas),
    ]


if __name__ == "__main__":
    main()
