"""What avoiding costs: the step of worlds whose robots avoid each other, beside the same policy alone.

``python benchmarks/avoiding.py`` prints a line for each: a team of 30, a crowd of 5,000, and the circle of
`examples/avoiding.py` on its way through the middle, beside the reference library if pyrvo is installed.
"""

from __future__ import annotations

import math
import runpy
import statistics
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from measure import cpu_seconds, interleave

from teamsight import CMOMMT, Box, Robot, World
from teamsight.policies import Avoiding

EXAMPLE = runpy.run_path(str(Path(__file__).resolve().parents[1] / "examples" / "avoiding.py"))
# Steps until robots of the circle are close together, and those that are measured from then on.
BEGIN, STEPS, ROUNDS = 300, 400, 9


def team(policy: Any) -> CMOMMT:
    """Return a team of 30 robots with bodies, which pass through each other: no contacts are computed."""
    return CMOMMT(
        30, 15, policy=policy, awareness="pairwise", robot_radius=0.1, target_radius=0.1, rng=1
    )


def crowd(policy: Any, robots: int = 5000) -> World:
    """Return robots that wander, whose bodies would cover a tenth of a box, and pass through each other."""
    world = World(Box(100.0, 100.0), rng=1)
    radius = math.sqrt(0.1 * 100.0**2 / robots / math.pi)
    world.add(
        Robot, robots, policy=policy, radius=radius, speed=0.1, awareness="pairwise", awareness_range=5 * radius
    )
    return world


def on_the_circle(policy: Avoiding) -> float:
    """Return the time of a step on the circle: search for neighbours, decisions, motion and contacts."""
    world = EXAMPLE["circle"](policy)
    world.run(BEGIN)
    return cpu_seconds(lambda: world.run(STEPS)) / STEPS


def of_the_reference(pyrvo: Any, policy: Avoiding) -> float:
    """Return the time of a step of the reference library on the same circle, without what the robots prefer."""
    example = EXAMPLE
    turn = 2 * math.pi * np.arange(example["ROBOTS"]) / example["ROBOTS"]
    start = example["CIRCLE"] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    speed, radius = example["SPEED"], (1 + policy.margin) * example["RADIUS"]

    simulator, rng = pyrvo.RVOSimulator(), np.random.default_rng(1)
    simulator.set_time_step(1.0)
    for place in start.tolist():
        reach = 10 * example["RADIUS"]
        simulator.add_agent(tuple(place), reach, policy.neighbours, policy.horizon, 1.0, radius, speed)

    def step() -> float:
        ways = -start - np.array([simulator.get_agent_position(i).to_tuple() for i in range(len(start))])
        ways += example["SWERVE"] * (rng.random((len(start), 1)) - 0.5) * ways[:, ::-1] * [-1, 1]
        ways *= np.minimum(speed / np.maximum(np.hypot(*ways.T), 1e-9), 1.0)[:, np.newaxis]
        for i, way in enumerate(ways.tolist()):
            simulator.set_agent_pref_velocity(i, tuple(way))
        return cpu_seconds(simulator.do_step)

    for _ in range(BEGIN):
        step()
    return sum(step() for _ in range(STEPS)) / STEPS


def compare(contenders: dict[str, Callable[[], float]], rounds: int) -> None:
    """Print the time of a step of each, and its ratio to the first."""
    taken = interleave(contenders, rounds)
    medians = {name: statistics.median(times) for name, times in taken.items()}
    first = next(iter(medians.values()))
    for name, time in medians.items():
        print(f"{name}: {time * 1e6:.1f} µs a step, {time / first:.2f} times the first")


def running(world: World, steps: int) -> Callable[[], float]:
    """Return what measures some steps of a world."""
    world.run(20)
    return lambda: cpu_seconds(lambda: world.run(steps)) / steps


def main() -> None:
    """Compare all."""
    compare({
        "30 robots, A-CMOMMT": running(team("a-cmommt"), 1500),
        "avoiding": running(team(Avoiding("a-cmommt")), 1500),
        "avoiding targets too": running(team(Avoiding("a-cmommt", targets=True)), 1500),
    }, ROUNDS)  # fmt: skip
    compare({
        "5,000 robots, random walk": running(crowd("random-walk"), 20),
        "avoiding": running(crowd(Avoiding("random-walk")), 20),
    }, ROUNDS)  # fmt: skip
    policy = Avoiding(EXAMPLE["Cross"]())
    circle = {"200 on a circle, avoiding": partial(on_the_circle, policy)}
    with suppress(ImportError):
        import pyrvo

        circle["pyrvo"] = partial(of_the_reference, pyrvo, policy)
    compare(circle, 5)


if __name__ == "__main__":
    main()
