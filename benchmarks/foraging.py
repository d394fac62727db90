"""How fast 30 robots forage among obstacles on 15 % of the area, with motor schemas in the compiled loop."""

from __future__ import annotations

from collections.abc import Callable

from measure import Row, cpu_seconds, interleave, median

from teamsight import TASKS
from teamsight.agents.world import World

ROBOTS, ATTRACTORS, STEPS = 30, 100, 500
#: Agent-steps a second of robots that forage.
LEAST = 200_000.0


def measure_foraging(rounds: int) -> list[Row]:
    """Measure robots that forage, consume and graze and communicate goals; most attractors are still there."""
    names = {"forage": LEAST, "consume": None, "graze": None}
    taken = interleave({name: _cost(name) for name in names}, rounds)
    return [
        median(
            f"{name}, {ROBOTS} robots, 15 % obstacles: agent-steps a second", "/s",
            [1.0 / seconds for seconds in taken[name]], **({} if least is None else {"least": least}),
        )
        for name, least in names.items()
    ]  # fmt: skip


def _cost(name: str) -> Callable[[], float]:
    """Return what measures the CPU time of an agent-step of a task's skilled team."""
    task = TASKS[name]
    scenario = {"robots": ROBOTS} | ({"attractors": ATTRACTORS} if "attractors" in task.scenario else {})
    world: World = task.build("skilled", rng=1, **scenario)
    world.run(5)

    def cost() -> float:
        world.reset()
        return cpu_seconds(lambda: world.run(STEPS)) / (STEPS * ROBOTS)

    return cost
