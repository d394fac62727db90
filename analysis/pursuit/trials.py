"""The trials of a run: hunters learn for some trials, and are then tested without learning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from teamsight.policies.online.online_q import OnlineQ

if TYPE_CHECKING:
    from teamsight.agents.world import World

Floats = npt.NDArray[np.float64]

#: Trials that one point of a learning curve averages.
BLOCK = 50
#: Trials at the end of training that give its result.
SETTLED = 500
# Steps that are made at once, at least; and for how many times the longest expected training.
_LEAST, _MOST_STEPS = 2000, 40_000_000


@dataclass(frozen=True)
class Learning:
    """Measures a world of `Pursuit`: trains its hunters, and tests them.

    Parameters
    ----------
    trials, tests : int
        Trials of training, and of the test.
    """

    trials: int
    tests: int

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Return the mean steps of a trial in each block of training, at its end, and in the test.

        Parameters
        ----------
        world : World
            A `Pursuit`.
        steps : int
            An estimate of the steps of the training.
        """
        hunters: Any = cast("Any", world).hunters
        training = next_trials(world, self.trials)
        test = training[-SETTLED:]
        if isinstance(hunters.policy, OnlineQ):
            hunters.policy = hunters.policy.frozen(hunters.policy_state.floats)
            test = next_trials(world, self.tests)
        whole = training[: len(training) // BLOCK * BLOCK].reshape(-1, BLOCK)
        return {
            "curve": whole.mean(axis=1).tolist(),
            "training": float(training[-SETTLED:].mean()),
            "test": float(test.mean()),
            "neighbours": int(world.max_neighbours),
        }


def next_trials(world: World, count: int) -> Floats:
    """Run a world until `count` more trials have ended, and return their steps.

    Raises
    ------
    ValueError
        If they take more steps than any team should need.
    """
    first, lengths = world.tick, np.zeros(0)
    while len(lengths) < count:
        missing = count - len(lengths)
        mean = lengths.mean() if len(lengths) else 1.0
        if world.tick - first > _MOST_STEPS:
            raise ValueError(f"trials={count}: only {len(lengths)} have ended after {_MOST_STEPS:,} steps")
        world.run(int(max(_LEAST, 1.05 * missing * (mean + 1.0))), progress=False)
        lengths = trials_of(world, first)
    return lengths[:count]


def trials_of(world: World, first: int = 0) -> Floats:
    """Return the steps of each trial that has ended since step `first`."""
    history = world.recording.history.iloc[first:]
    return np.asarray(history["trial_steps"].to_numpy()[history["captures"].to_numpy() > 0], float)
