"""Two paths, one answer, where it is hard: groups that change on the way, and events that need Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from chance import generator

from teamsight import CMOMMT, Robot, World

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


def test_leaving_often_changes_no_last_bit() -> None:
    # The mean over several stretches is a sum of shares: summed in another way it differs in the last bit.
    for seed in generator().integers(2**31, size=8).tolist():

        def leave(model: World, advance: Callable[[int], Any]) -> World:
            for _ in range(4):
                advance(7)
                model.groups[1][0].remove()
            return model

        run, stepped = (CMOMMT(robots=4, targets=14, radius=3.0, rng=seed) for _ in range(2))
        leave(run, run.run)
        leave(stepped, lambda steps: [stepped.step() for _ in range(steps)])
        assert run.datacollector.get_model_vars_dataframe().equals(stepped.datacollector.get_model_vars_dataframe())


def test_when_all_targets_have_left() -> None:
    run, stepped = (CMOMMT(robots=3, targets=2, rng=1) for _ in range(2))
    for model in (run, stepped):
        model.run(3)
        for target in list(model.targets):
            target.remove()
    run.run(2)
    stepped.step()
    stepped.step()
    assert run.datacollector.get_model_vars_dataframe().equals(stepped.datacollector.get_model_vars_dataframe())


@pytest.mark.parametrize("late", ["group", "recorder", "collector"])
def test_an_event_that_brings_python_into_a_run(late: str) -> None:
    calls: list[int] = []

    def make() -> CMOMMT:
        model = CMOMMT(rng=1)

        def watch(world: World) -> float:
            calls.append(world.tick)
            return 0.0

        def come() -> None:
            if late == "group":
                model.add(Robot, 2, policy=lambda percept, rng: (watch(model), 0.05), name="late")
            elif late == "recorder":
                model.recording.callbacks.append(watch)
            else:
                import mesa

                model.datacollector = mesa.DataCollector({"tick": watch})

        model.clock.at(5, come)
        return model

    stepped = make()
    for _ in range(10):
        stepped.step()
    expected, calls = calls, []
    make().run(10)
    assert expected
    assert calls == expected


def test_counters_in_an_event() -> None:
    seen: list[Any] = []
    for advance in (lambda model: model.run(5), lambda model: [model.step() for _ in range(5)]):
        model = CMOMMT(rng=1)
        model.clock.at(3, lambda model=model: seen.append((model.tick, model.clock.now, model.steps)))
        advance(model)
    assert seen[0] == seen[1]
