"""The regression: how long it takes to fit, and a world of robots that decide by it, beside A-CMOMMT."""

from __future__ import annotations

from measure import Row, cpu_seconds, interleave, median, ratio

from teamsight import CMOMMT
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.policies import LazyRegression

MANY, STEPS = 1_000_000, 2_000


def measure_regression(rounds: int, quick: bool) -> list[Row]:
    """Fit the paper's 600 transitions and a million, and run A-CMOMMT's world; quick without the million."""
    memory = explore(Exploration())
    policy = LazyRegression(memory)  # compiles
    fits = [1e3 * cpu_seconds(lambda: LazyRegression(memory)) for _ in range(rounds)]
    rows = [median(f"fit {len(memory)} transitions", "ms", fits, most=10)]
    if not quick:
        large = explore(Exploration(runs=-(-MANY // len(memory))))
        times = [cpu_seconds(lambda: LazyRegression(large)) for _ in range(min(rounds, 5))]
        rows.append(median(f"fit {len(large):,} transitions", "s", times, most=5))
    settings = {"robots": 15, "targets": 15, "radius": 5.0, "rng": 1}
    worlds = {
        "regression, ring": CMOMMT(policy=policy, awareness="ring", **settings),
        "A-CMOMMT, pairwise": CMOMMT(policy="a-cmommt", awareness="pairwise", **settings),
    }
    for world in worlds.values():
        world.run(600)
    taken = interleave(
        {name: lambda world=world: cpu_seconds(lambda: world.run(STEPS)) / STEPS for name, world in worlds.items()},
        rounds,
    )
    names = list(worlds)
    rows.append(ratio(f"a step, {names[0]} / {names[1]}", taken[names[0]], taken[names[1]], most=1.5))
    rows += [median(f"a step, {name}", "µs", [1e6 * one for one in taken[name]]) for name in names]
    return rows
