"""What events cost: millions of planned events a minute, with a step of the world for each, and many in one step."""

from __future__ import annotations

from collections.abc import Callable

from measure import Row, cpu_seconds, interleave, median

from teamsight import CMOMMT, EventSource

STEPS = 3_000


class Ticking(EventSource):
    """Plans one event after the other, each with a random number."""

    needs_group = False

    def __init__(self, interval: float, *, logs: bool = False) -> None:
        self.interval, self.logs = interval, logs

    def begin(self) -> None:
        """Plan the first."""
        self.happened = 0
        self.plan(self.now, "happen", 0)

    def happen(self, index: int) -> None:
        """Plan the next."""
        self.happened += 1
        if self.logs:
            self.log("happened", index=index, number=self.random(0, index))
        self.plan(self.now + self.interval, "happen", index + 1)


def measure_events(rounds: int) -> list[Row]:
    """Count the events that 10 robots and 15 targets process in a minute, the steps between them included."""
    taken = interleave(
        {
            "one a step, in run": _run(Ticking(1.0)),
            "one a step, in step": _run(Ticking(1.0), by_steps=True),
            "one a step, each logged": _run(Ticking(1.0, logs=True)),
            "ten a step, each logged": _run(Ticking(0.1, logs=True)),
        },
        rounds,
    )
    goals: dict[str, dict[str, float]] = {"one a step, in step": {"least": 1, "aim": 3}}
    minute = {name: [60e-6 / seconds for seconds in values] for name, values in taken.items()}
    unit = "10⁶ a minute"
    return [median(f"planned events: {name}", unit, of, **goals.get(name, {})) for name, of in minute.items()]


def _run(source: Ticking, *, by_steps: bool = False) -> Callable[[], float]:
    world = CMOMMT(robots=10, targets=15, rng=1)
    ticking = world.attach(source)

    def steps() -> None:
        for _ in range(STEPS):
            world.step()

    def once() -> float:
        """Return the time of one event."""
        world.reset()
        before = ticking.happened
        return cpu_seconds(steps if by_steps else lambda: world.run(STEPS)) / (ticking.happened - before)

    once()
    return once
