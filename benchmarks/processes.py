"""What processes cost: their wake-ups, a wait for an event of the world, and a log of contacts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from measure import Row, cpu_seconds, interleave, median, ratio

from teamsight import CMOMMT, Robot, Sensor

STEPS, WAKE_UPS = 2_000, 1_000


def measure_processes(rounds: int) -> list[Row]:
    """Measure worlds of 15 robots and 15 targets, side by side."""
    taken = interleave(
        {
            "plain": _runs(0), "one wait": _runs(1), "15 waits": _runs(15), "log": _runs(0, is_logged=True),
            "timeouts": _wake_ups(_every_tick), "contacts": _wake_ups(_follow_contacts),
        },
        rounds,
    )  # fmt: skip
    return [
        ratio("a run in which a process waits for a contact", taken["one wait"], taken["plain"]),
        ratio("a run in which 15 processes wait for one each", taken["15 waits"], taken["plain"]),
        ratio("a run with a log of contacts", taken["log"], taken["plain"]),
        median("wake-ups by timeout(1), steps included", "per minute", [60 / one for one in taken["timeouts"]]),
        median("wake-ups by contacts, steps included", "per minute", [60 / one for one in taken["contacts"]]),
    ]


def _model() -> CMOMMT:
    return CMOMMT(robots=15, targets=15, rng=1)


def _runs(waits: int, *, is_logged: bool = False) -> Callable[[], float]:
    """Return runs in which this many processes wait for what never comes."""
    model = _model()
    far = model.add(Robot, 1, policy="stationary", position=(0, 0), team=None, name="far")
    model.senses(model.robots, far, as_="far", sensor=Sensor(range=1e-6))
    for robot in list(model.robots)[:waits]:
        model.clock.process(_wait(model, robot, far[0]))
    if is_logged:
        model.log_contacts(model.robots)
    model.run(STEPS)
    return lambda: cpu_seconds(lambda: model.run(STEPS))


def _wait(model: CMOMMT, robot: Robot, other: Robot) -> Iterator[Any]:
    yield model.until.contact(robot, other, "far")


def _wake_ups(story: Callable[[CMOMMT, list[int]], None]) -> Callable[[], float]:
    """Return runs that last until processes have been woken, and give the time of one wake-up."""
    model, count = _model(), [0]
    story(model, count)

    def run() -> float:
        before = count[0]

        def go() -> None:
            while count[0] < before + WAKE_UPS:
                model.run(100)

        return cpu_seconds(go) / (count[0] - before)

    run()
    return run


def _every_tick(model: CMOMMT, count: list[int]) -> None:
    def tick() -> Iterator[Any]:
        while True:
            yield model.clock.timeout(1)
            count[0] += 1

    model.clock.process(tick())


def _follow_contacts(model: CMOMMT, count: list[int]) -> None:
    def follow(robot: Robot) -> Iterator[Any]:
        while True:
            yield model.until.contact(robot)
            yield model.until.contact_ended(robot)
            count[0] += 2

    for robot in model.robots:
        model.clock.process(follow(robot))
