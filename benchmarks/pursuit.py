"""Hunters that learn online, on one core: agent-steps a second."""

from __future__ import annotations

import statistics

from measure import Row, cpu_seconds

from teamsight.policies import LatticeWalk, ModularQ, PreyQ
from teamsight.tasks.pursuit import Pursuit

STEPS = 50_000
#: Agent-steps a second: the goal.
LEAST = 1e6


def measure_pursuit(rounds: int) -> list[Row]:
    """Measure Tan's two tasks, and that of Ono and Fukumoto, with learning hunters."""
    return [
        _row("Ono and Fukumoto's pursuit, modules", _surround(), rounds),
        _row("Tan's pursuit, one captures", Pursuit(2, 1, policy=PreyQ(4), rng=1), rounds),
        _row("Tan's pursuit, two capture", _joint(), rounds),
    ]


def _surround() -> Pursuit:
    how = {"rule": "surround", "torus": True, "awareness": "pairwise", "prey_policy": LatticeWalk(5)}
    return Pursuit(4, 1, 20, depth=3, policy=ModularQ(3), rng=1, **how)  # type: ignore[arg-type]


def _joint() -> Pursuit:
    return Pursuit(2, 2, rule="pair", awareness="pairwise", policy=PreyQ(4, partner=4), rng=1)


def _row(name: str, world: Pursuit, rounds: int) -> Row:
    world.run(1000, progress=False)
    agents = len(world.hunters) + len(world.prey)
    rates = [agents * STEPS / cpu_seconds(lambda: world.run(STEPS, progress=False)) for _ in range(rounds)]
    return Row(name, "agent-steps/s", statistics.median(rates), (min(rates), max(rates)), least=LEAST)
