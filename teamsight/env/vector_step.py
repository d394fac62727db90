"""What a step of the vectorised environment returns."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
Flags: TypeAlias = npt.NDArray[np.bool_]
Observations: TypeAlias = npt.NDArray[np.float32]


class Step(NamedTuple):
    """What a step of `TeamVectorEnv` returns.

    Attributes
    ----------
    observations : ndarray, shape (worlds, robots, width), float32
        What the robots perceive after the step.
    rewards : ndarray, shape (worlds, robots), float64
        Their rewards.
    terminated, truncated : ndarray, shape (worlds,), bool
        Whether something has stopped a world; whether its episode has lasted for `max_cycles` steps.
    info : dict of str to ndarray
        Of each world the ``observed`` share of targets, ``mean_neighbours`` and ``max_neighbours``, shape (worlds,); of
        each robot the targets ``sensed``, the ``neighbours`` and whether it is ``active``, shape (worlds, robots). With
        "same-step", if episodes have ended: ``final_observations``, shape (worlds, robots, width), whose rows of other
        worlds are as in `observations`; the rest of `info` is of the last step of the episode.
    """

    observations: Observations
    rewards: Floats
    terminated: Flags
    truncated: Flags
    info: dict[str, npt.NDArray[Any]]
