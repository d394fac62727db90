"""What components cost: 1,000 robots with failures and batteries, about one event a step, against none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from measure import Row, cpu_seconds, interleave, ratio

from teamsight import CMOMMT
from teamsight.agents.components import Batteries, Failures
from teamsight.agents.events import EventSource

ROBOTS, STEPS = 1_000, 300
FAILURES, BATTERIES = Failures(2_500, 250), Batteries(200, low_level=10)
#: The charges at the start, so that batteries become low and empty one after the other.
CHARGES = np.linspace(12, 192, ROBOTS)
MOST = 2.0


def measure_components(rounds: int) -> list[Row]:
    """Compare runs with failures, with batteries, with both, and with none, side by side."""
    sources: dict[str, list[EventSource]] = {
        "failures and batteries": [FAILURES, BATTERIES], "failures": [FAILURES], "batteries": [BATTERIES], "": [],
    }  # fmt: skip
    worlds = {name: _runs(given) for name, given in sources.items()}
    taken = interleave(worlds, rounds)
    return [
        ratio(f"1,000 robots with {name}", taken[name], taken[""], **({"most": MOST} if given[1:] else {}))
        for name, given in sources.items() if given
    ]  # fmt: skip


def _runs(sources: list[EventSource]) -> Callable[[], float]:
    model = CMOMMT(robots=ROBOTS, targets=ROBOTS, radius=50.0, events=sources, rng=1)

    def run() -> float:
        model.reset(1)
        if BATTERIES in sources:
            model.robots.columns["battery"][:] = CHARGES
        return cpu_seconds(lambda: model.run(STEPS))

    run()
    events = len(model.events)
    if len(sources) == 2 and not 0.7 < events / STEPS < 1.6:
        raise RuntimeError(f"{events} events in {STEPS} steps: about one a step is what is measured")
    return run
