"""Discrete events on the clock: a process that makes fog, and a robot that fails at tick 200.

The clock is a SimPy environment in ticks. Between two events all steps are made in one compiled call.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from teamsight import CMOMMT


def fog(model: CMOMMT, seen: list[tuple[float, float]]) -> Generator[Any, Any, None]:
    """Make fog for 50 of every 150 ticks, in which robots sense half as far, and record what is observed."""
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
