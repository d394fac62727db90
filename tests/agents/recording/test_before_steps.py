"""Functions that are called just before steps: after all events, and on both paths."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT


def still(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    return 0.0, 0.0


@pytest.mark.filterwarnings("ignore:run.* makes its steps one by one")
@pytest.mark.parametrize("policy", ["random-walk", still])
def test_they_are_called_after_all_events_before_each_step(policy: Any) -> None:
    model = CMOMMT(robots=3, policy=policy, rng=1)
    seen: list[tuple[int, int]] = []
    model.recording.before_steps.append(lambda world: seen.append((world.tick, len(world.robots))))

    def arrive() -> None:
        # An event that is planned when those of the tick are being processed.
        model.clock.at(model.clock.now, lambda: model.robots.add(1))

    model.clock.at(2, arrive)
    for _ in range(4):
        model.run(1)
    assert seen == [(0, 3), (1, 3), (2, 4), (3, 4)]


def test_one_compiled_call_is_preceded_by_one_call_and_they_cannot_make_steps() -> None:
    model = CMOMMT(robots=3, rng=1)
    ticks: list[int] = []
    model.recording.before_steps.append(lambda world: ticks.append(world.tick))
    model.run(20)
    assert ticks == [0]
    model.recording.before_steps[:] = [lambda world: world.step()]
    with pytest.raises(RuntimeError, match="called in a recorder"):
        model.run(1)
    assert model.tick == 20
