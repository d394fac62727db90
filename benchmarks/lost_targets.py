"""What the direction is worth that a centroid robot takes when it loses its targets, as a table in Markdown.

A robot that wanders keeps its heading, which points to where the targets were. The alternative is to return to the
heading with which it searched before it sensed them.

python benchmarks/lost_targets.py [--runs 40]
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from teamsight import run_many
from teamsight.analysis.plot.markdown import table
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.core.angles import direction
from teamsight.core.kernel import kernel
from teamsight.policies import Centroid, CompiledPolicy, PolicyState, check_policy

ROBOTS, RADII, STEPS = (5, 10, 20, 30), (2.0, 3.0, 5.0, 7.0, 9.0), 600


@kernel
def _search_on(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    targets = percept.targets
    for i in range(percept.heading.shape[0]):
        search, searched = arrays.state.floats[i, 0], arrays.state.ints[i, 0]
        if searched[0]:
            # The wall may have turned the robot since.
            search[0], search[1] = percept.heading[i, 0], percept.heading[i, 1]
        first, last = targets.start[i], targets.start[i + 1]
        searched[0] = first == last
        if first == last:
            if noise[1, i] < arrays.parameters[0]:
                search[0], search[1] = direction(noise[0, i])
            action.heading[i, 0], action.heading[i, 1] = search[0], search[1]
            action.distance[i] = percept.speed[i]
            continue
        x = y = 0.0
        for k in range(first, last):
            x += targets.offset[k, 0] / (last - first)
            y += targets.offset[k, 1] / (last - first)
        distance = math.sqrt(x * x + y * y)
        action.distance[i] = distance
        action.heading[i, 0] = x / distance if distance > 0.0 else 0.0
        action.heading[i, 1] = y / distance if distance > 0.0 else 0.0


@dataclass(frozen=True)
class SearchOn(CompiledPolicy):
    """The centroid of the sensed targets; without any, on in the direction of the last search."""

    turn_probability: float = 0.05

    kernel = _search_on
    draws = 2

    @property
    def parameters(self) -> tuple[float, ...]:
        return (self.turn_probability,)

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 1, 2)), np.ones((size, 1, 1), dtype=np.int64))


def main() -> None:
    """Simulate both policies in the same scenarios, and print what they observe."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=40, help="runs of each cell")
    runs = parser.parse_args().runs
    check_policy(SearchOn())
    lines = [row(robots, radius, runs) for robots, radius in product(ROBOTS, RADII)]
    print(table(["N", "R", "keeps its direction [%]", "searches on [%]", "gain [pp]"], lines))


def row(robots: int, radius: float, runs: int) -> list[str]:
    """Return a line of the table, with the 95 % interval of the paired gain."""
    seeds = [model_seed(root("lost targets: report"), run, robots, 15, radius) for run in range(runs)]
    scenario = {"robots": robots, "radius": radius, "awareness": "none"}
    keeps, searches = (
        100 * run_many({**scenario, "policy": policy}, steps=STEPS, seeds=seeds)["observed_fraction"]
        for policy in (Centroid(idle="wander"), SearchOn())
    )
    gain = searches - keeps
    interval = f"{round(gain.mean(), 1) + 0.0:+.1f} ± {1.96 * gain.std() / runs**0.5:.1f}".replace("-", "−")
    return [f"{robots}", f"{radius:g}", f"{keeps.mean():.1f}", f"{searches.mean():.1f}", interval]


if __name__ == "__main__":
    main()
