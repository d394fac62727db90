"""What a run of 600 steps costs, in a reused world and in a new one, beside its compiled steps alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from measure import Row, cpu_seconds, interleave, median, ratio

from teamsight import CMOMMT
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.agents.world import World
from teamsight.analysis.runs.run_many import summary

STEPS, SEEDS = 600, range(50)
POLICIES = ("a-cmommt", "random-walk")


def measure_short_runs(rounds: int) -> list[Row]:
    """Compare worlds of 15 robots and 15 targets, each run with its beginning and its summary."""
    rows = []
    for policy in POLICIES:
        settings: dict[str, Any] = {"robots": 15, "targets": 15, "radius": 5.0, "policy": policy}
        taken = interleave(_contenders(settings), rounds)
        steps = taken.pop("steps")
        for name, seconds in taken.items():
            rows.append(median(f"{policy}: {name} run of {STEPS} steps", "ms", [1e3 * one for one in seconds]))
            rows.append(ratio(f"{policy}: share of the compiled steps in {name} run", steps, seconds))
    return rows


def _contenders(settings: dict[str, Any]) -> dict[str, Callable[[], float]]:
    worlds = ReusedWorlds()

    def reused() -> Iterable[World]:
        worlds.expect([(settings, seed) for seed in SEEDS])
        return (worlds.begin(CMOMMT, settings, seed) for seed in SEEDS)

    def new() -> None:
        for seed in SEEDS:
            world = CMOMMT(**settings, rng=seed)
            summary(world, STEPS)
            world.close()

    def run_all() -> None:
        for world in reused():
            summary(world, STEPS)

    def steps() -> float:
        return sum(_compiled(world) for world in reused()) / len(SEEDS)

    run_all()
    return {
        "a reused": lambda: cpu_seconds(run_all) / len(SEEDS), "a new": lambda: cpu_seconds(new) / len(SEEDS),
        "steps": steps,
    }  # fmt: skip


def _compiled(world: World) -> float:
    """Return the CPU time of the compiled steps of a run that begins."""
    engine = world._engine
    engine._make_room(STEPS)
    engine._binding.progress["steps"] = STEPS
    (phase,) = engine._binding.run
    return cpu_seconds(partial(phase.entry, phase.record))
