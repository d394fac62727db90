"""Three ways to write a policy: a compiled kernel, NumPy for a whole group, and a plain function for one robot.

All three do the same: turn from the present heading towards the sensed targets and away from perceived teammates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teamsight import CMOMMT
from teamsight.core.kernel import kernel
from teamsight.policies import (
    Action,
    CompiledPolicy,
    Floats,
    Percept,
    PerceptOfOne,
    Policy,
    PolicyArrays,
    check_policy,
    go,
    turn_to,
)


@kernel
def _lean(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    for i in range(percept.heading.shape[0]):
        x, y = percept.heading[i, 0], percept.heading[i, 1]
        for seen, weight in ((percept.targets, 1.0), (percept.teammates, -arrays.parameters[0])):
            for k in range(seen.start[i], seen.start[i + 1]):
                x += weight * seen.offset[k, 0]
                y += weight * seen.offset[k, 1]
        go(action, i, x, y, percept.speed[i])


@dataclass(frozen=True)
class CompiledLean(CompiledPolicy):
    """The fast path: the kernel decides for all robots, and a run needs no Python."""

    repulsion: float = 0.5
    kernel = _lean


class NumpyLean(Policy):
    """Arrays for the whole group: an object with `draws`, `start` and `decide`."""

    draws = 0

    def start(self, size: int) -> None:
        return None

    def decide(self, percept: Percept, state: None, noise: Floats) -> tuple[Action, None]:
        way = percept.heading.copy()
        for seen, weight in ((percept.targets, 1.0), (percept.teammates, -0.5)):
            observer = np.repeat(np.arange(len(way)), np.diff(seen.start))
            np.add.at(way, observer, weight * seen.offset)
        return Action(way / np.linalg.norm(way, axis=1, keepdims=True), percept.speed), state


def lean(percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
    """One robot at a time: return how far to turn [rad, anticlockwise] and how far to go."""
    x, y = percept.heading + percept.targets.offset.sum(axis=0) - 0.5 * percept.teammates.offset.sum(axis=0)
    return turn_to(percept.heading, (x, y)), percept.speed


def main() -> None:
    for policy in (CompiledLean(), NumpyLean(), lean):
        check_policy(policy)
        model = CMOMMT(policy=policy, rng=1)
        for _ in range(100):
            model.step()
        print(f"{getattr(policy, '__name__', type(policy).__name__):12} {model.observed_fraction:.3f} observed")


if __name__ == "__main__":
    main()
