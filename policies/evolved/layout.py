"""Where each constant of the learned rule stands in its vector, and the rule that evolution begins with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

#: What a robot feels as a whole; see `teamsight.policies.evolved.senses`.
CONTEXT = 7
#: What it feels of a target, or of a teammate, besides.
TARGET_FEATURES, MATE_FEATURES = 8, 2
TARGET_NEURONS, MATE_NEURONS = 8, 5
#: Knots of the force laws: one each fifth of the range.
TARGET_KNOTS, MATE_KNOTS = 8, 6
#: Forces from memory: onward, off the fresh trail, off the old trail, off teammates met, to the middle.
DRIVES = 5

TARGET_INPUTS = CONTEXT + TARGET_FEATURES
MATE_INPUTS = CONTEXT + MATE_FEATURES

# One block after the other; a neuron is its bias and its weights.
TURN, GAIN, LEAD, OWN_SLOPE, OWN_OFFSET, DECAY = range(6)
TARGET_LAW = 6
MATE_LAW = TARGET_LAW + TARGET_KNOTS
DRIVE = MATE_LAW + MATE_KNOTS
TARGET_HIDDEN = DRIVE + DRIVES * (1 + CONTEXT)
TARGET_OUT = TARGET_HIDDEN + TARGET_NEURONS * (1 + TARGET_INPUTS)
MATE_HIDDEN = TARGET_OUT + 2 * (1 + TARGET_NEURONS)
MATE_OUT = MATE_HIDDEN + MATE_NEURONS * (1 + MATE_INPUTS)
SIZE = MATE_OUT + 1 + MATE_NEURONS


class Block(NamedTuple):
    """A part of the vector."""

    first: int
    shape: tuple[int, ...]


#: The parts of the vector by name, in their order.
BLOCKS = {
    "scalars": Block(TURN, (6,)),
    "target_law": Block(TARGET_LAW, (TARGET_KNOTS,)),
    "mate_law": Block(MATE_LAW, (MATE_KNOTS,)),
    "drives": Block(DRIVE, (DRIVES, 1 + CONTEXT)),
    "target_hidden": Block(TARGET_HIDDEN, (TARGET_NEURONS, 1 + TARGET_INPUTS)),
    "target_out": Block(TARGET_OUT, (2, 1 + TARGET_NEURONS)),
    "mate_hidden": Block(MATE_HIDDEN, (MATE_NEURONS, 1 + MATE_INPUTS)),
    "mate_out": Block(MATE_OUT, (1, 1 + MATE_NEURONS)),
}

_HIDDEN_SPREAD = 0.7


def spreads() -> npt.NDArray[np.float64]:
    """Return how far evolution shall look in each constant, relative to the others."""
    wide = np.ones(SIZE)
    wide[TARGET_HIDDEN:TARGET_OUT] = wide[MATE_HIDDEN:MATE_OUT] = 2.0
    return wide


#: Parts of the rule that can be silenced, to see what they are worth.
SILENCED = ("target network", "mate network", "both networks", "memory of ground and trail")


def silenced(constants: npt.NDArray[np.float64], part: str) -> npt.NDArray[np.float64]:
    """Return the rule without a part: its outputs are 0."""
    changed = constants.copy()
    if part in ("target network", "both networks"):
        changed[TARGET_OUT:MATE_HIDDEN] = 0.0
    if part in ("mate network", "both networks"):
        changed[MATE_OUT:SIZE] = 0.0
    if part == "memory of ground and trail":
        # All drives but the one onward.
        changed[DRIVE + 1 + CONTEXT : TARGET_HIDDEN] = 0.0
    return changed


def beginning(seed: int) -> npt.NDArray[np.float64]:
    """Return the rule that evolution begins with: about A-CMOMMT's forces, straight search, and silent networks.

    Parameters
    ----------
    seed : int
        Of the hidden neurons, whose outputs are all 0 to begin with.

    Returns
    -------
    ndarray, shape (SIZE,), float64
    """
    constants = np.zeros(SIZE)
    constants[[TURN, GAIN, LEAD, OWN_SLOPE, OWN_OFFSET, DECAY]] = 0.22, 1.0, 0.0, 20.0, 0.0, 0.3
    constants[TARGET_LAW : TARGET_LAW + TARGET_KNOTS] = -0.8, 0.2, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0
    constants[MATE_LAW : MATE_LAW + MATE_KNOTS] = -1.0, -1.0, -1.0, -0.5, 0.0, 0.0
    # Onward, unless there are targets of its own.
    constants[DRIVE], constants[DRIVE + 2] = 1.0, -1.5
    rng = np.random.default_rng(seed)
    for first, last in ((TARGET_HIDDEN, TARGET_OUT), (MATE_HIDDEN, MATE_OUT)):
        constants[first:last] = rng.normal(0.0, _HIDDEN_SPREAD, last - first)
    return constants
