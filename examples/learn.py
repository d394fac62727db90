"""Learning: explore once, write a reward in a few lines, and run the learned policies.

The same transitions serve every learner and every reward. Not every learner succeeds: here the paper's LazyQ observes
no more than robots that walk at random, and LinearQ a third more. This is one exploration and one world; for results
over many see docs/learning-results.md.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight import CMOMMT
from teamsight.agents.recording.explore import explore
from teamsight.policies import LazyQ, LinearQ, RandomWalk
from teamsight.policies.memory import LazyMemory


def keep(memory: LazyMemory) -> npt.NDArray[np.float64]:
    """A reward of your own: −1 for each target that only this robot sensed, and no longer senses."""
    return -np.asarray(memory.fact("alone_lost"), float)


def main() -> None:
    walk = RandomWalk(random_distance=True)
    memory = explore(CMOMMT(robots=5, targets=10, radius=3.0, policy=walk, awareness="ring", rng=1), steps=960)
    print(memory)
    for policy in (walk, LazyQ(memory, keep), LinearQ(memory, keep)):
        model = CMOMMT(robots=5, targets=15, radius=3.0, policy=policy, awareness="ring", rng=2)
        model.run(600)
        print(f"{type(policy).__name__:10} {100 * model.observed_fraction:.1f} % observed")


if __name__ == "__main__":
    main()
