"""A policy of one's own in the benchmark: `teamsight benchmark --policy examples/enter.py:Chase --awareness none`."""

from __future__ import annotations

from teamsight import CMOMMT
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, go


@kernel
def _chase(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    for i in range(percept.heading.shape[0]):
        x, y, nearest = percept.heading[i, 0], percept.heading[i, 1], 2.0 * percept.sensing_range[i]
        for k in range(percept.targets.start[i], percept.targets.start[i + 1]):
            if percept.targets.distance[k] < nearest:
                nearest = percept.targets.distance[k]
                x, y = percept.targets.offset[k, 0], percept.targets.offset[k, 1]
        go(action, i, x, y, percept.speed[i])


class Chase(CompiledPolicy):
    """Go to the nearest target in sight, else straight on."""

    kernel = _chase


def main() -> None:
    model = CMOMMT(policy=Chase(), awareness="none", rng=1)
    model.run(600)
    print(f"Chase observed {model.observed_fraction:.1%} of the targets")


if __name__ == "__main__":
    main()
