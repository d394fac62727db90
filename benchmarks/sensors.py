"""What sensors cost: runs with each against runs without, in worlds that are reused as `run_many` does."""

from __future__ import annotations

import math
from collections.abc import Callable

from measure import Row, cpu_seconds, interleave, ratio

from teamsight import CMOMMT, Sensor

STEPS = 600
SEEDS = range(8)
VIEW = math.radians(120)

#: What is measured; there is a goal for the first.
SENSORS = {
    "120° with errors of range and bearing": Sensor(VIEW, range_noise=0.05, bearing_noise=0.05),
    "120°": Sensor(VIEW),
    "errors of range and bearing": Sensor(range_noise=0.05, bearing_noise=0.05),
    "missed detections": Sensor(missed=0.1),
    "false detections": Sensor(false_positives=0.1),
    "a delay of 2": Sensor(delay=2),
}
MOST = {"120° with errors of range and bearing": 1.3}


def measure_sensors(rounds: int) -> list[Row]:
    """Compare 10 robots and 15 targets with each sensor of targets, and without, side by side."""
    worlds = {name: _runs(sensor) for name, sensor in {"": None, **SENSORS}.items()}
    taken = interleave(worlds, rounds)
    goals = {name: {"most": MOST[name]} if name in MOST else {} for name in SENSORS}
    return [ratio(f"a run with a sensor of {name}", taken[name], taken[""], **goals[name]) for name in SENSORS]


def _runs(sensor: Sensor | None) -> Callable[[], float]:
    models = [CMOMMT(robots=10, targets=15, sensor=sensor, rng=seed) for seed in SEEDS]

    def run() -> float:
        for model, seed in zip(models, SEEDS, strict=True):
            model.reset(seed)
        return cpu_seconds(lambda: [model.run(STEPS) for model in models])

    run()
    return run
