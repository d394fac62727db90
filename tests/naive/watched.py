"""A compiled policy that is compared, decision by decision, with its slow twin."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from teamsight import CMOMMT
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import percept_of_one


class Watched(Policy):
    """A NumPy policy that decides as the compiled one and, robot by robot, as its slow twin; and compares."""

    def __init__(self, policy: CompiledPolicy, twin: Callable[[Any], Any], accuracy: float = 1e-6) -> None:
        self.policy, self.twin, self.accuracy = policy, twin, accuracy
        self.draws, self.needs = policy.draws, policy.needs
        self.lost = self.met = 0

    def start(self, size: int) -> Any:
        return self.policy.start(size), [self.twin(self.policy) for _ in range(size)]

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        own, robots = memory
        action, own = self.policy.decide(percept, own, noise)
        for i, robot in enumerate(robots):
            one = percept_of_one(percept, i)
            heading, distance = robot.decide(one, noise[:, i].tolist())
            assert action.distance[i] == pytest.approx(distance, abs=1e-8)
            # Where forces cancel, the heading is that of what rounding leaves.
            if distance > 1e-7 or not self.draws:
                assert action.heading[i] == pytest.approx(heading, abs=self.accuracy)
            self.lost += sum(track[2] < robot.tick for track in getattr(robot, "target_tracks", ()))
            self.met += len(one.teammates.distance)
        return action, (own, robots)


def watch(policy: CompiledPolicy, twin: Callable[[Any], Any], awareness: str, accuracy: float) -> None:
    """Let robots meet and lose targets while they are compared with their slow twins."""
    watched = Watched(policy, twin, accuracy)
    model = CMOMMT(
        robots=5, targets=9, radius=2.5, policy=watched, awareness=awareness, awareness_range=0.8, sensing_range=0.9,
        target_speed=0.12,
    )  # fmt: skip
    # Some of them meet, wherever they were placed.
    for robot, x in zip(model.robots, (-0.3, 0.0, 0.4), strict=False):
        robot.position = (x, 0.0)
    with pytest.warns(UserWarning, match="Python"):
        model.run(40)
    assert watched.lost
    assert watched.met
