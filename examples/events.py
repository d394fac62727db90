"""Discrete events on the clock: a process that lets fog rise, and a robot that breaks down at one moment.

The clock is a SimPy environment, counted in ticks. Between two events the world runs in one compiled stretch.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from teamsight import CMOMMT


def fog(model: CMOMMT, seen: list[tuple[float, float]]) -> Iterator[Any]:
    """Let fog rise every 100 ticks for 50, in which robots sense half as far; note what is observed."""
    while True:
        yield model.clock.timeout(100)
        seen.append((model.clock.now, model.observed))
        model.adjust(model.robots, sensing_range=0.5)
        yield model.clock.timeout(50)
        seen.append((model.clock.now, model.observed))
        model.adjust(model.robots, sensing_range=1.0)


def main() -> None:
    model = CMOMMT(rng=1)
    seen: list[tuple[float, float]] = []
    model.clock.process(fog(model, seen))
    model.clock.at(200, model.robots[0].remove)
    model.run(600)
    for time, share in seen:
        print(f"tick {time:5.0f}: {share:.0%} observed")
    print(f"over the run: {model.observed_fraction:.0%}, by {len(model.robots)} robots in the end")


if __name__ == "__main__":
    main()
