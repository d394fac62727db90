"""The neighbours of docs/tasks/foraging.md, where ranges are short.

python benchmarks/foraging_tables.py [--workers 2]
"""

from __future__ import annotations

import argparse

from teamsight import run_many
from teamsight.analysis.plot import markdown
from teamsight.analysis.stats.paired import Interval, interval_of

WIDE = {"robots": 30, "side": 128.0, "communication_range": 10.0}
TEAMS = ({"policy": "random-walk", "awareness": "none"}, {"policy": "schemas"})


def neighbours(workers: int) -> str:
    """Return the largest number of neighbours in a run, by task and team."""
    rows = []
    for task in ("forage", "consume", "graze"):
        tables = [run_many(WIDE | team, task=task, steps=600, seeds=range(10), workers=workers) for team in TEAMS]
        rows.append([f"`{task}`", *(_shown(interval_of(table["max_neighbours"].to_numpy(float))) for table in tables)])
    return markdown.table(["task", "random exploration", "motor schemas"], rows, align="lrr")


def _shown(interval: Interval) -> str:
    return f"{interval.mean:.1f} ({interval.low:.1f} to {interval.high:.1f})".replace("-", "−")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    print(neighbours(options.workers))


if __name__ == "__main__":
    main()
