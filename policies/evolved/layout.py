"""The layout of the evolved policy's vector of constants, and the constants with which evolution starts."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np
import numpy.typing as npt

#: Features of a robot's whole situation; see `teamsight.policies.evolved.policy`.
CONTEXT = 7
#: Further features of a target, and of a teammate.
TARGET_FEATURES, TEAMMATE_FEATURES = 8, 2
TARGET_NEURONS, TEAMMATE_NEURONS = 8, 5
#: Knots of the force laws, a fifth of the range apart.
TARGET_KNOTS, TEAMMATE_KNOTS = 8, 6
#: Forces from memory: forward, away from the recent and the old trail, away from remembered teammates, to the middle.
DRIVES = 5

TARGET_INPUTS = CONTEXT + TARGET_FEATURES
TEAMMATE_INPUTS = CONTEXT + TEAMMATE_FEATURES

#: The shapes of the parts of the vector by name, in order; a neuron is its bias followed by its weights.
BLOCKS = {
    "scalars": (6,),
    "target_law": (TARGET_KNOTS,),
    "teammate_law": (TEAMMATE_KNOTS,),
    "drives": (DRIVES, 1 + CONTEXT),
    "target_hidden": (TARGET_NEURONS, 1 + TARGET_INPUTS),
    "target_out": (2, 1 + TARGET_NEURONS),
    "teammate_hidden": (TEAMMATE_NEURONS, 1 + TEAMMATE_INPUTS),
    "teammate_out": (1, 1 + TEAMMATE_NEURONS),
}
TURN, GAIN, LEAD, OWN_SLOPE, OWN_OFFSET, DECAY = range(6)
# Where the other parts begin.
TARGET_LAW, TEAMMATE_LAW, DRIVE, TARGET_HIDDEN, TARGET_OUT, TEAMMATE_HIDDEN, TEAMMATE_OUT, SIZE = accumulate(
    math.prod(shape) for shape in BLOCKS.values()
)


def parts(constants: npt.ArrayLike) -> dict[str, npt.NDArray[np.float64]]:
    """Return the parts of a vector by name."""
    ends = list(accumulate(math.prod(shape) for shape in BLOCKS.values()))
    pieces = np.split(np.asarray(constants, float), ends[:-1])
    return {name: piece.reshape(shape) for piece, (name, shape) in zip(pieces, BLOCKS.items(), strict=True)}


_HIDDEN_SPREAD = 0.7


def spreads() -> npt.NDArray[np.float64]:
    """Return the relative initial standard deviation of each constant in the evolution."""
    wide = np.ones(SIZE)
    wide[TARGET_HIDDEN:TARGET_OUT] = wide[TEAMMATE_HIDDEN:TEAMMATE_OUT] = 2.0
    return wide


#: Parts of the policy whose output can be set to 0 to measure their effect.
SILENCED = ("target network", "teammate network", "both networks", "memory of area and trail")


def silenced(constants: npt.NDArray[np.float64], part: str) -> npt.NDArray[np.float64]:
    """Return the constants with the outputs of a part set to 0."""
    changed = constants.copy()
    if part in ("target network", "both networks"):
        changed[TARGET_OUT:TEAMMATE_HIDDEN] = 0.0
    if part in ("teammate network", "both networks"):
        changed[TEAMMATE_OUT:SIZE] = 0.0
    if part == "memory of area and trail":
        # All drives except the first, forward.
        changed[DRIVE + 1 + CONTEXT : TARGET_HIDDEN] = 0.0
    return changed


def beginning(seed: int) -> npt.NDArray[np.float64]:
    """Return the initial constants: A-CMOMMT's forces, moving straight when idle, and networks without effect.

    Parameters
    ----------
    seed : int
        Seed of the hidden neurons, whose output weights are all 0.

    Returns
    -------
    ndarray, shape (SIZE,), float64
    """
    constants = np.zeros(SIZE)
    constants[[TURN, GAIN, LEAD, OWN_SLOPE, OWN_OFFSET, DECAY]] = 0.22, 1.0, 0.0, 20.0, 0.0, 0.3
    constants[TARGET_LAW : TARGET_LAW + TARGET_KNOTS] = -0.8, 0.2, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0
    constants[TEAMMATE_LAW : TEAMMATE_LAW + TEAMMATE_KNOTS] = -1.0, -1.0, -1.0, -0.5, 0.0, 0.0
    # Forward, unless the robot has targets of its own.
    constants[DRIVE], constants[DRIVE + 2] = 1.0, -1.5
    rng = np.random.default_rng(seed)
    for first, last in ((TARGET_HIDDEN, TARGET_OUT), (TEAMMATE_HIDDEN, TEAMMATE_OUT)):
        constants[first:last] = rng.normal(0.0, _HIDDEN_SPREAD, last - first)
    return constants
