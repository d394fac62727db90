"""Arrivals: what it costs to add agents in mid-run, and to run with them.

A world of 1,000 robots with 100 arrivals of one robot each is compared with one of 1,100 robots from the start, side by
side: the ratio of the times of a run afterwards. Then the time of one `Group.add`, with and without the next step.
Last, a run of 600 steps in which a robot comes every 6 steps is compared with one that has all of them from the start:
a crowd in the paper's arena, and a team of the paper's density.

    python benchmarks/arrivals.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from teamsight import CMOMMT
from teamsight.agents.group import Group

AGENTS, ARRIVALS, STEPS, REPEATS = 1_000, 100, 100, 7


def build(robots: int) -> CMOMMT:
    """Return a model of this many robots, with the density of the paper's."""
    model = CMOMMT(robots=robots, targets=AGENTS, radius=50.0, rng=1)
    model.run(1)
    return model


def seconds(action: Callable[[], object]) -> float:
    """Return the time of an action."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def main() -> None:
    grown, whole = build(AGENTS), build(AGENTS + ARRIVALS)
    adding = [seconds(grown.robots.add) for _ in range(ARRIVALS)]
    grown.run(1)
    # In turn, so that both meet the same disturbances.
    pairs = [(seconds(lambda: grown.run(STEPS)), seconds(lambda: whole.run(STEPS))) for _ in range(REPEATS)]
    ratios = [one / other for one, other in pairs]
    print(f"a run after {ARRIVALS} arrivals takes {np.median(ratios):.2f} times as long as with all from the start")
    print(f"adding one robot to {AGENTS}: {np.median(adding) * 1e3:.2f} ms")
    print(f"adding one robot and making a step: {np.median(steps(grown.robots.add, grown)) * 1e3:.2f} ms")
    print(f"removing one and making a step: {np.median(steps(lambda: leave(grown.robots), grown)) * 1e3:.2f} ms")
    print(f"a step alone: {np.median(steps(lambda: None, grown)) * 1e3:.2f} ms")


    for radius in (5.0, 13.0):
        runs = [(coming(radius, 100, 0), coming(radius, 1, 99)) for _ in range(REPEATS)]
        ratio = np.median([came / whole for whole, came in runs])
        one = np.median([came for _, came in runs]) / 99
        print(f"radius {radius:g}: a run in which 99 come takes {ratio:.2f} times as long as with all from the start,")
        print(f"and {one * 1e6:.0f} µs for each")


def coming(radius: float, robots: int, come: int) -> float:
    """Return the time of 600 steps in which so many robots come, one every 6 steps."""
    model = CMOMMT(robots=robots, targets=15, radius=radius, rng=1)
    model.run(1)
    for number in range(come):
        model.clock.at(6 * number + 4, model.robots.add)
    return seconds(lambda: model.run(600))


def steps(change: Callable[[], object], model: CMOMMT) -> list[float]:
    """Return the times of a change, each with one step after it."""
    return [seconds(lambda: (change(), model.run(1))) for _ in range(ARRIVALS)]


def leave(group: Group) -> None:
    """Remove an agent from the middle of a group."""
    group[len(group) // 2].remove()


if __name__ == "__main__":
    main()
