"""World-steps a second at the paper's size: the two paths, plain mesa and plain C."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from measure import Row, cpu_seconds, interleave, median, ratio
from numpy_policy import NumpyACmommt
from plain_c import PlainC
from plain_mesa import PlainCMOMMT

from teamsight import CMOMMT
from teamsight.agents.reused_worlds import ReusedWorlds

ROBOTS, TARGETS, RADIUS = 15, 15, 5.0
WARM_UP = 100


def measure_speed(c: PlainC, rounds: int) -> list[Row]:
    """Compare worlds of 15 robots and 15 targets: long runs, and runs of 600 steps with their beginning."""
    settings: dict[str, Any] = {"robots": ROBOTS, "targets": TARGETS, "radius": RADIUS}
    contenders = {
        "run": lambda: _run(settings, 60_000),
        "mesa": _steps(PlainCMOMMT(ROBOTS, TARGETS, RADIUS), 300),
        "step": _steps(CMOMMT(**settings, rng=1), 2_000),
        "numpy": _steps(CMOMMT(**settings, rng=1, policy=NumpyACmommt()), 500),
        "built": lambda: cpu_seconds(lambda: _built_world(settings)) / 600,
        "reused": _reused_worlds(settings),
    }
    if c.is_there:
        contenders["c"] = lambda: c.run(ROBOTS, TARGETS, RADIUS, 60_000)["cpu_seconds"] / 60_000
    taken = interleave(contenders, rounds)
    rows = [
        ratio("model.run against plain mesa", taken["mesa"], taken["run"], least=300, aim=500),
        ratio("model.step, compiled policy, against plain mesa", taken["mesa"], taken["step"], least=5),
        ratio("model.step, NumPy policy, against plain mesa", taken["mesa"], taken["numpy"], least=1),
        ratio("a run of 600 steps in a built world, against mesa", taken["mesa"], taken["built"]),
        ratio("a run of 600 steps in a reused world, against mesa", taken["mesa"], taken["reused"]),
        ratio("a run of 600 steps: built over reused", taken["built"], taken["reused"], least=1.7),
    ]
    if c.is_there:
        rows.insert(1, ratio("time of model.run over that of plain C", taken["run"], taken["c"], most=2, aim=1.2))
    names = {"run": "model.run", "c": "plain C", "mesa": "plain mesa", "step": "model.step", "numpy": "NumPy policy"}
    for name, words in names.items():
        if name in taken:
            rows.append(median(words, "world-steps/s", [1 / seconds for seconds in taken[name]]))
    return rows


def _run(settings: dict[str, Any], count: int) -> float:
    # A new model each time: what it has recorded so far is no part of the price of a step.
    model = CMOMMT(**settings, rng=1)
    model.run(WARM_UP)
    seconds = cpu_seconds(lambda: model.run(count))
    model.close()
    return seconds / count


def _steps(model: Any, count: int) -> Callable[[], float]:
    def step() -> None:
        for _ in range(count):
            model.step()

    for _ in range(WARM_UP):
        model.step()
    return lambda: cpu_seconds(step) / count


def _reused_worlds(settings: dict[str, Any]) -> Callable[[], float]:
    worlds, seeds = ReusedWorlds(), range(20)

    def runs() -> None:
        worlds.expect([(settings, seed) for seed in seeds])
        for seed in seeds:
            worlds.begin(CMOMMT, settings, seed).run(600)

    return lambda: cpu_seconds(runs) / 600 / len(seeds)


def _built_world(settings: dict[str, Any]) -> None:
    model = CMOMMT(**settings, rng=2)
    model.run(600)
    model.close()
