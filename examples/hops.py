"""δ, and the gain of awareness, against the number of hops over which robots pass on what they know: docs/hops.md.

``python examples/hops.py [REPLICATES [TABLE]]`` makes the runs of `hops.toml`, and prints the tables of the page;
``docs/hops.parquet`` is the table that it writes.
"""

from __future__ import annotations

import math
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from teamsight import CMOMMT, TASKS, Study, World
from teamsight.agents.awareness import NoAwareness, RelayedAwareness
from teamsight.analysis.papers.hops import CELL, CONTROLS, OBSERVE, points, tables

FILE = Path(__file__).with_name("hops.toml")
REPORTS: dict[str, Any] = {
    "0": NoAwareness(), "1": RelayedAwareness(1), "2": RelayedAwareness(2), "4": RelayedAwareness(4),
    "all": RelayedAwareness(), "all, 5 ticks a hop": RelayedAwareness(delay=5),
    "all, 30 % lost": RelayedAwareness(loss=0.3),
}  # fmt: skip
#: In place of no awareness, for a policy that needs relayed targets: no report is ever heard.
BLIND = RelayedAwareness(1, loss=1.0)


class Row(NamedTuple):
    """What is measured of a run: the score, and the largest and the mean number of teammates in a percept."""

    score: float
    has_ended: bool
    delta: int
    known: float


def world(team: str, neighbours: int, reports: str, rng: int) -> World:
    """Return a world; in a random placement without borders a robot would have so many neighbours on average."""
    degree = BLIND if team == "b-cmommt" and reports == "0" else REPORTS[reports]
    if team in OBSERVE:
        reach = round(5 * math.sqrt(neighbours / 19), 1)
        return CMOMMT(*CELL, policy=team, awareness=degree, awareness_range=reach, rng=rng)
    reach = round(64 * math.sqrt(neighbours / 15 / math.pi), 1)
    name, _, kind = team.partition(", ")
    scenario = {"robots": 16, "communication_range": reach, "sensing_range": 5.0 if kind == "short-sighted" else 20.0}
    made = TASKS[name].build("skilled", rng=rng, awareness=degree, **scenario)
    if team in CONTROLS:
        robots: Any = made.groups[1]
        robots.policy = replace(robots.policy, communication="none", robot=0.0, robot_at_work=0.0)
    return made


def measured(world: Any, steps: int) -> Row:
    """Run a world to its end, and look at the percepts on which robots decide."""
    is_task, known = not isinstance(world, CMOMMT), []
    for _ in range(steps if is_task else 600):
        known.append(np.diff(world.robots.percept.teammates.start))
        world.step()
        if is_task and not world.attractors.mass.any():
            break
    score = float(world.tick) if is_task else 100.0 * world.observed_fraction
    return Row(score, world.tick < steps, int(np.max(known)), float(np.mean(known)))


def main() -> None:
    replicates, *to = sys.argv[1:] or [""]
    study = Study.from_file(FILE)
    if replicates:
        study = Study.from_dict({**study.as_dict(), "replicates": int(replicates)})
    with tempfile.TemporaryDirectory() as folder:
        found = points(study.run(Path(folder) / "results", workers=2).frame)
    for file in to:
        found.to_parquet(file, index=False)
    print("\n\n".join(f"{name}\n\n{table}" for name, table in tables(found).items()))


if __name__ == "__main__":
    main()
