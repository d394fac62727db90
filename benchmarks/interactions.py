"""What interactions cost: runs with one that does nothing, and with a capture, against runs without."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from measure import Row, cpu_seconds, interleave, ratio

from teamsight import CMOMMT, Interaction
from teamsight.core.kernel import kernel

STEPS = 600
SEEDS = range(8)


@kernel
def _nothing(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    pass


@kernel
def _capture(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots, targets = bodies.robots, bodies.targets
    for j in range(targets.position.shape[0]):
        for i in range(robots.position.shape[0]):
            x = robots.position[i, 0] - targets.position[j, 0]
            y = robots.position[i, 1] - targets.position[j, 1]
            if x * x + y * y < parameters[0] * parameters[0]:
                robots.reward[i] += noise.targets[0, j]
                scores[0] += 1.0


class Nothing(Interaction):
    """An interaction that does nothing."""

    roles = ("robots", "targets")
    writes = ()
    kernel = _nothing


@dataclass(frozen=True)
class Touch(Interaction):
    """Robots are rewarded for the targets that they touch."""

    roles = ("robots", "targets")
    scores = ("touches",)
    writes = ("reward",)
    draws = 1
    reach: float = 0.1
    kernel = _capture


def measure_interactions(rounds: int) -> list[Row]:
    """Compare 10 robots and 15 targets with each interaction, and without, side by side."""
    worlds = {name: _runs(one) for name, one in {"": None, "nothing": Nothing(), "touch": Touch()}.items()}
    taken = interleave(worlds, rounds)
    return [
        ratio("a run with an interaction that does nothing", taken["nothing"], taken[""], most=1.1),
        ratio("a run with one that compares all robots and targets", taken["touch"], taken[""]),
    ]


def _runs(interaction: Interaction | None) -> Callable[[], float]:
    models = [CMOMMT(robots=10, targets=15, rng=seed) for seed in SEEDS]
    for model in models if interaction else ():
        model.interact(interaction, robots=model.robots, targets=model.targets)

    def run() -> float:
        for model, seed in zip(models, SEEDS, strict=True):
            model.reset(seed)
        return cpu_seconds(lambda: [model.run(STEPS) for model in models])

    run()
    return run
