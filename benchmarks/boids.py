"""Boids beside the example of mesa: the same statistics, and the time of a step.

``python benchmarks/boids.py`` runs both from 20 seeds (about a minute). Both have the same rules and constants; mesa's
boids move one after the other, in random order, and those of teamsight all at once.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
from measure import cpu_seconds
from mesa.examples.basic.boid_flockers.model import BoidFlockers

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from boids import flock

SEEDS, STEPS, BOIDS, NEAR = 20, (20, 60, 120), 100, 10.0


def statistics(position: npt.NDArray[np.float64], heading: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Return the length of the mean heading, and the mean number of neighbours within sight."""
    ways = position[:, None] - position
    ways -= 100.0 * np.rint(ways / 100.0)
    near = (np.hypot(ways[..., 0], ways[..., 1]) <= NEAR).sum() / len(position) - 1.0
    unit = heading / np.hypot(*heading.T)[:, None]
    return float(np.hypot(*unit.mean(axis=0))), float(near)


def main() -> None:
    """Compare both."""
    found: dict[str, list[list[tuple[float, float]]]] = {"teamsight": [], "mesa": []}
    times = dict.fromkeys(found, 0.0)
    flock(0).run(1)
    for seed in range(SEEDS):
        world, model = flock(seed, BOIDS), BoidFlockers(BOIDS, seed=seed)
        for kind in found.values():
            kind.append([])
        for before, after in zip((0, *STEPS), STEPS, strict=False):
            times["teamsight"] += cpu_seconds(lambda count=after - before, world=world: world.run(count))
            times["mesa"] += cpu_seconds(lambda count=after - before, model=model: [model.step() for _ in range(count)])
            robots, boids = world.groups[0], list(model.agents)
            found["teamsight"][-1].append(statistics(robots.position, robots.heading))
            found["mesa"][-1].append(statistics(
                np.array([one.position for one in boids]), np.array([one.direction for one in boids])
            ))  # fmt: skip
    for name, rows in found.items():
        values = np.array(rows)
        half = 1.96 * values.std(axis=0, ddof=1) / np.sqrt(SEEDS)
        for number, step in enumerate(STEPS):
            order, near = values[:, number].mean(axis=0)
            print(
                f"{name}, step {step}: mean heading {order:.2f} ± {half[number, 0]:.2f}, "
                f"neighbours {near:.1f} ± {half[number, 1]:.1f}"
            )
    each = {name: time / SEEDS / STEPS[-1] * 1e6 for name, time in times.items()}
    ratio = each["mesa"] / each["teamsight"]
    print(f"a step: teamsight {each['teamsight']:.0f} µs, mesa {each['mesa']:.0f} µs ({ratio:.0f} times)")


if __name__ == "__main__":
    main()
