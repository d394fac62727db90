"""What a task costs: CMOMMT through its task against CMOMMT itself, and worlds of tasks that runs share or do not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any
from unittest.mock import patch

from measure import Row, cpu_seconds, interleave, ratio

from teamsight import run_many
from teamsight.agents.reused_worlds import ReusedWorlds

STEPS = 600
RUNS = 200
SEEDS = range(RUNS)
#: "No slower", with what rounds of one program differ by.
_NO_SLOWER = 1.05


def measure_tasks(rounds: int) -> list[Row]:
    """Compare runs of CMOMMT as a task with runs of the same worlds without, and shared worlds with new ones."""
    team: Mapping[str, Any] = {"policy": "a-cmommt", "awareness": "pairwise"}
    task = _many({"treatment": "skilled"}, task="cmommt")
    taken = interleave({"task": task, "direct": _many(team)}, rounds)
    rows = [ratio(f"{RUNS} runs of CMOMMT as a task", taken["task"], taken["direct"], most=_NO_SLOWER)]
    for name, steps in (("pursuit", 600), ("forage", 1000)):
        shared = _many({"treatment": "explore"}, task=name, steps=steps)
        taken = interleave({"shared": shared, "new": _anew(shared)}, rounds)
        rows.append(ratio(f"{name}, {steps} steps: a new world for each run", taken["new"], taken["shared"], least=1.0))
    return rows


def _many(setting: Mapping[str, Any], steps: int = STEPS, **named: Any) -> Callable[[], float]:
    def run() -> float:
        return cpu_seconds(lambda: run_many(setting, steps=steps, seeds=SEEDS, **named))

    run()
    return run


def _anew(run: Callable[[], float]) -> Callable[[], float]:
    begin = ReusedWorlds.begin

    def begin_anew(worlds: ReusedWorlds, *given: Any) -> Any:
        worlds.close()
        return begin(worlds, *given)

    def run_anew() -> float:
        with patch.object(ReusedWorlds, "begin", begin_anew):
            return run()

    return run_anew
