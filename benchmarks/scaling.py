"""The cost of an agent's step from 1,000 to 100,000 robots, at the density of 15 robots in a disc of radius 5."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from measure import Row, cpu_seconds, interleave, median, ratio
from plain_c import PlainC

from teamsight import CMOMMT, Disc, Robot, World

FEW, MANY = 1_000, 100_000
STEPS = 4


def radius_for(robots: int) -> float:
    """Return the radius of the disc in which so many robots are as dense as 15 in a disc of radius 5."""
    return 5.0 * math.sqrt(robots / 15)


def measure_scaling(c: PlainC, rounds: int) -> list[Row]:
    """Compare few with many, side by side: the steps are those of worlds that began at the same time."""
    rows = []
    for words, build, agents in (("robots and as many targets", _with_targets, 2), ("robots only", _robots_only, 1)):
        contenders = {size: _steps(build, size, agents) for size in (FEW, MANY)}
        taken = interleave({str(size): work for size, work in contenders.items()}, rounds)
        few, many = taken[str(FEW)], taken[str(MANY)]
        rows.append(ratio(f"growth from {FEW:,} to {MANY:,} {words}", many, few, most=1.5))
        for size, seconds in ((FEW, few), (MANY, many)):
            rows.append(median(f"{size:,} {words}", "ns/agent-step", [1e9 * value for value in seconds]))
    if c.is_there:
        taken = interleave({"few": _steps_in_c(c, FEW), "many": _steps_in_c(c, MANY)}, min(rounds, 3))
        rows.append(ratio("growth in plain C with cells, robots and as many targets", taken["many"], taken["few"]))
        for size, name in ((FEW, "few"), (MANY, "many")):
            rows.append(median(f"{size:,} in plain C with cells", "ns/agent-step", [1e9 * t for t in taken[name]]))
    return rows


def _with_targets(robots: int, seed: int) -> Any:
    return CMOMMT(robots=robots, targets=robots, radius=radius_for(robots), rng=seed)


def _robots_only(robots: int, seed: int) -> Any:
    world = World(Disc(radius_for(robots)), rng=seed)
    world.add(Robot, robots, policy="a-cmommt", awareness="pairwise")
    return world


def _steps(build: Callable[[int, int], Any], robots: int, agents: int) -> Callable[[], float]:
    # As many small worlds as keep the clock busy.
    worlds = [build(robots, seed) for seed in range(max(20_000 // robots, 1))]
    unit = len(worlds) * STEPS * robots * agents

    def step() -> None:
        for world in worlds:
            world.run(STEPS)

    for _ in range(5):
        step()
    return lambda: cpu_seconds(step) / unit


def _steps_in_c(c: PlainC, robots: int) -> Callable[[], float]:
    def seconds() -> float:
        worlds = max(20_000 // robots, 1)
        runs = [
            c.run(robots, robots, radius_for(robots), 10 * STEPS, "--cells", "--seed", str(seed))["cpu_seconds"]
            for seed in range(worlds)
        ]
        return float(sum(runs)) / (worlds * 10 * STEPS * robots * 2)

    return seconds
