"""What conditions of agents cost: a world in which one was once inactive, and one in which one changes every step."""

from __future__ import annotations

from collections.abc import Callable

from measure import Row, cpu_seconds, interleave, ratio

from teamsight import CMOMMT

STEPS = 600
SEEDS = range(8)
MANY, MANY_STEPS = 1_000, 100


def measure_conditions(rounds: int) -> list[Row]:
    """Compare worlds with and without conditions, side by side."""
    few = {"with": _runs(is_bound=True), "without": _runs(is_bound=False)}
    many = {"with": _changes(is_changing=True), "without": _changes(is_changing=False)}
    whole, changing = interleave(few, rounds), interleave(many, rounds)
    return [
        ratio("a run in which an agent was once inactive", whole["with"], whole["without"]),
        ratio(f"{MANY:,} robots, one fails or is repaired at each step", changing["with"], changing["without"]),
    ]


def _runs(*, is_bound: bool) -> Callable[[], float]:
    """Return runs of 10 robots and 15 targets, all active again from the start if conditions are bound."""
    models = [CMOMMT(robots=10, targets=15, rng=seed) for seed in SEEDS]
    for model in models if is_bound else ():
        model.robots[0].active = False
        model.targets[0].active = False

    def run() -> float:
        for model, seed in zip(models, SEEDS, strict=True):
            model.reset(seed)
        return cpu_seconds(lambda: [model.run(STEPS) for model in models])

    run()
    return run


def _changes(*, is_changing: bool) -> Callable[[], float]:
    """Return events, one before each step, that change a robot's condition, or do nothing."""
    model = CMOMMT(robots=MANY, targets=MANY, radius=50.0, rng=1)

    def change(step: int) -> None:
        robot = model.robots[7 * step % MANY]
        robot.active = not robot.active if is_changing else True

    def run() -> float:
        first = model.tick
        for step in range(MANY_STEPS):
            model.clock.at(first + step, lambda step=step: change(step))
        return cpu_seconds(lambda: model.run(MANY_STEPS))

    run()
    return run
