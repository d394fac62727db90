"""How far bodies change δ: the table of docs/delta.md, and the same δ from recordings of such teams.

``python benchmarks/delta_of_bodies.py`` prints it (about two minutes of CPU time). All cells have the same seeds.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import pandas as pd

from teamsight import CMOMMT
from teamsight.analysis.delta import choose_delta, delta_from_trajectories

# Fixed before any result was seen. The control is the radius 0, which is the same for all contacts.
ROBOTS, TARGETS, RADIUS, STEPS, RISK, SEED = 30, 15, 5.0, 600, 0.01, 6
RADII, CONTACTS, POLICIES = (0.05, 0.1, 0.2), ("stop", "slide"), ("random-walk", "a-cmommt")
RECORDED = 40


def settings(policy: str, radius: float, contact: str) -> dict[str, Any]:
    """Return the parameters of `CMOMMT` of a cell; ranges are 1."""
    return {
        "robots": ROBOTS, "targets": TARGETS, "radius": RADIUS, "policy": policy, "robot_radius": radius,
        "contact": contact,
    }  # fmt: skip


def recorded(cell: dict[str, Any]) -> tuple[list[int], list[int]]:
    """Return the largest number of neighbours in each of some runs, from the worlds and from their recordings."""
    seeds = [SEED * 1000 + run for run in range(RECORDED)]
    direct, rows = [], []
    for run, seed in enumerate(seeds):
        model = CMOMMT(**cell, rng=seed)
        model.recording.record_positions()
        model.run(STEPS)
        direct.append(model.max_neighbours)
        # Before the first step nothing counts.
        table = model.recording.trajectory.query("group == 'robots' and time > 0").rename(columns={"identity": "robot"})
        rows.append(table[["time", "robot", "x", "y"]].assign(run=run))
    report = delta_from_trajectories(pd.concat(rows), awareness_range=1.0, risk=0.1)
    return direct, np.asarray(report.maxima["max_neighbours"]).tolist()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=int(10 / RISK), help="runs of a cell")
    runs = parser.parse_args().runs
    print("| policy | contact | radius | δ | δ, safe | mean of the largest number | bumps of a robot in 100 steps |")
    print("|---|---|---|---|---|---|---|")
    agree = cells = 0
    for policy in POLICIES:
        for contact, radius in [("pass", 0.0), *((one, size) for one in CONTACTS for size in RADII)]:
            cell = settings(policy, radius, contact)
            report = choose_delta(cell, steps=STEPS, risk=RISK, runs=runs, rng=SEED)
            largest = np.asarray(report.maxima["max_neighbours"], float)
            half = 1.96 * largest.std(ddof=1) / np.sqrt(len(largest))
            model = CMOMMT(**cell, rng=SEED)
            model.run(10 * STEPS)
            bumps = model.robots.bumps.mean() / model.tick * 100
            print(
                f"| {policy} | {contact} | {radius:g} | {report.delta} | {report.delta_safe} "
                f"| {largest.mean():.2f} ± {half:.2f} | {bumps:.2f} |",
                flush=True,
            )
            direct, seen = recorded(cell)
            agree, cells = agree + (direct == seen), cells + 1
    print(f"\nFrom recordings of {RECORDED} runs of a cell, the largest numbers agree in {agree} of {cells} cells.")


if __name__ == "__main__":
    main()
