"""Tables of docs/tasks/foraging.md: neighbours where ranges are short, and what communication saves with heavy loads.

python benchmarks/foraging_tables.py [--workers 2]
"""

from __future__ import annotations

import argparse
from typing import Any

from teamsight import run_many
from teamsight.analysis.plot import markdown
from teamsight.analysis.stats.paired import Interval, interval_of

WIDE = {"robots": 30, "side": 128.0, "communication_range": 10.0}
TEAMS = ({"policy": "random-walk", "awareness": "none"}, {"policy": "schemas"})
HEAVY = {"attractors": 3, "mass": 50.0, "policy": "schemas", "awareness": "pairwise"}
# The page had the seeds from 0 on at first.
SEEDS = (range(60), range(1000, 1060))


def neighbours(workers: int) -> str:
    """Return the largest number of neighbours in a run, by task and team."""
    rows = []
    for task in ("forage", "consume", "graze"):
        tables = [run_many(WIDE | team, task=task, steps=600, seeds=range(10), workers=workers) for team in TEAMS]
        rows.append([f"`{task}`", *(_shown(interval_of(table["max_neighbours"].to_numpy(float))) for table in tables)])
    return markdown.table(["task", "random exploration", "motor schemas"], rows, align="lrr")


def saved(workers: int) -> str:
    """Return which share of the time communication saves where loads are heavy."""
    rows = []
    for seeds in SEEDS:
        levels: dict[str, Any] = {"communication": ["none", "state", "goal"]}
        runs = run_many(HEAVY | levels, task="forage", steps=1000, seeds=seeds, workers=workers)
        steps = runs.pivot(index="seed", columns="communication", values="completion_time")
        share = 100 * steps[["state", "goal"]].rsub(steps["none"], axis=0) / steps["none"].mean()
        shown = (_shown(interval_of(share[level].to_numpy()), " %") for level in ("state", "goal"))
        rows.append([f"{seeds[0]} to {seeds[-1]}", *shown])
    return markdown.table(["seeds", "states save", "goals save"], rows, align="lrr")


def _shown(interval: Interval, unit: str = "") -> str:
    return f"{interval.mean:.1f}{unit} ({interval.low:.1f} to {interval.high:.1f})".replace("-", "−")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    print(neighbours(options.workers), saved(options.workers), sep="\n\n")


if __name__ == "__main__":
    main()
