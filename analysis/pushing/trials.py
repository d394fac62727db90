"""What is measured of a run of box pushing, and the runs from which an adaptive logic network learns."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.analysis.runs.run import task_seed
from teamsight.policies.braitenberg.adaptive_network import AdaptiveNetwork
from teamsight.policies.braitenberg.vehicle import BEHAVIOUR, LAST_CUES
from teamsight.tasks.pushing import PUSH, completion_time

if TYPE_CHECKING:
    import numpy.typing as npt

    from teamsight.agents.world import World

# A run stops at the first multiple of these steps at which the box has been moved far enough.
_PART = 100
# Steps of a run from which the network learns.
_STEPS = 300


def until_moved(world: World, steps: int) -> dict[str, Any]:
    """Run a world until the box was moved by its distance, and return what happened until then.

    Returns
    -------
    dict
        ``time`` [steps], that of a censored run being `steps`; whether it is ``censored``; ``box_moved`` [length]; the
        number of steps with at least two robots that push, ``together``, and of those in which the box does not move,
        ``stagnating``; ``max_neighbours`` up to the end of the run.
    """
    made, time = 0, float("inf")
    while made < steps and time == float("inf"):
        world.run(min(_PART, steps - made))
        made += min(_PART, steps - made)
        time = completion_time(world)
    is_censored = time == float("inf")
    end = steps if is_censored else int(time)
    history = world.recording.history.iloc[:end]
    return {
        "time": end,
        "censored": is_censored,
        "box_moved": float(history["box_moved"].sum()),
        "together": int((history["pushing"] >= 2).sum()),
        "stagnating": int((history["stagnating"] >= 2).sum()),
        "max_neighbours": int(world.recording.max_neighbours("robots")),
    }


def examples_of(root: int, replicates: Iterable[int], robots: Iterable[int]) -> npt.NDArray[np.int64]:
    """Return what robots with the fixed priority perceive and do: cues and behaviours, shape (2, examples).

    Parameters
    ----------
    root : int
        The root seed.
    replicates : iterable of int
        Numbers of the runs; those for training are below 0, so that no other run meets these worlds.
    robots : iterable of int
        Team sizes; each has a run for each replicate.
    """
    found = []
    for size in robots:
        for replicate in replicates:
            world: Any = PUSH.build(rng=task_seed(PUSH, root, replicate, {"robots": size}), robots=size)
            for _ in range(_STEPS):
                world.step()
                kept = world.robots.policy_state.ints[:, 0]
                found.append(kept[kept[:, BEHAVIOUR] >= 0][:, [LAST_CUES, BEHAVIOUR]].T)
            world.close()
    return np.concatenate(found, axis=1)


def agreement(network: AdaptiveNetwork, examples: npt.NDArray[np.int64]) -> float:
    """Return the share of examples, shape (2, examples), for which a network selects the same behaviour."""
    return float(np.mean(network.select(examples[0]) == examples[1]))
