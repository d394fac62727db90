"""Forces with a memory of rivals and of lost targets, whose constants depend on how crowded it was lately."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.elementary import exp
from teamsight.core.kernel import inlined, lowest_bit, scratch
from teamsight.policies import group_forces
from teamsight.policies.constants import ConstantsPolicy, ends
from teamsight.policies.evolved import few
from teamsight.policies.group_forces import (
    DECAY,
    FARTHEST,
    FIELDS,
    HELD,
    HELD_OF,
    OLDEST,
    TRACKS,
    go_along,
    pull,
    push,
    share,
    weigh,
)
from teamsight.policies.handmade.target_tracks import AGE, USED, X, Y, update_target_tracks
from teamsight.policies.interface import PolicyState

#: The constants of one place, by name with their shape, in their order: those of `group_forces.BLOCKS`, then
#:
#: - fade: by how much farther from its target per step a rival is taken to be that is perceived no longer
#: - alone_forward: force along the heading of a robot with one target of its own
#: - lost: force of a lost target on a robot without targets of its own, and how fast it is forgotten (its square root);
#:   a target that was the robot's own attracts, one that a teammate held repels
_ONE = {**group_forces.BLOCKS, "fade": (1,), "alone_forward": (1,), "lost": (2,)}
*_, _FADE, _ALONE_FORWARD, _LOST, ONE = ends(_ONE)

#: All constants: those of a place where the robot meets nobody, and what is added to them in proportion to the targets
#: and to the teammates that it has met lately.
_PLACES = ("", "targets_", "teammates_")
BLOCKS = {f"{by}{name}": shape for by in _PLACES for name, shape in _ONE.items()}
SIZE = ends(BLOCKS)[-1]

# What is added to those of `GroupForces` before any search.
_BEGINNING = {"fade": [0.06], "alone_forward": [0.3], "lost": [0.7, 0.25]}
_ONE_SPREADS = {**group_forces.SPREADS, "fade": 0.02, "alone_forward": 0.1, "lost": 0.1}
_SPREADS = {f"{by}{name}": spread for by in _PLACES for name, spread in _ONE_SPREADS.items()}

#: What is added to `GroupForces` by name: its constants, and their value when it is removed.
PARTS = {
    "memory of rivals": ("fade", 9.0), "memory of lost targets": ("lost", 0.0),
    "forward with one target": ("alone_forward", 0.0),
}  # fmt: skip

# The row of a robot's memory after its tracks: the targets and teammates that it has met lately.
_LATELY = TRACKS
_SEEN, _MET = range(2)
# The share of the present moment in these.
_RATE = 0.03


def without(constants: npt.ArrayLike, part: str) -> tuple[float, ...]:
    """Return the constants with a part removed."""
    name, value = PARTS[part]
    removed = {f"{by}{name}": np.full(_ONE[name], 0.0 if by else value) for by in _PLACES}
    return AdaptiveForces.vector(AdaptiveForces.parts(constants) | removed)


@inlined
def _adapt(i: int, percept: Any, given: Any, lately: Any, constants: Any) -> None:
    """Update what the robot has met lately, and write its constants for such a place."""
    lately[_SEEN] += _RATE * (few(percept.targets.start[i + 1] - percept.targets.start[i]) - lately[_SEEN])
    lately[_MET] += _RATE * (few(percept.teammates.start[i + 1] - percept.teammates.start[i]) - lately[_MET])
    for j in range(ONE):
        constants[j] = given[j] + lately[_SEEN] * given[ONE + j] + lately[_MET] * given[2 * ONE + j]


@inlined
def _chase(idle: float, lost: Any, constants: Any, floats: Any, ints: Any) -> tuple[float, float]:
    """Return the sum of the forces of lost targets."""
    force_x = 0.0
    force_y = 0.0
    while lost != 0:
        slot, lost = lowest_bit(lost)
        forgotten = exp(-ints[slot, AGE] * constants[_LOST + 1] * constants[_LOST + 1])
        x = floats[slot, X]
        y = floats[slot, Y]
        force = idle * constants[_LOST] * forgotten * (2.0 * floats[slot, HELD] - 1.0)
        force /= max(math.sqrt(x * x + y * y), 1e-9)
        force_x += force * x
        force_y += force * y
    return force_x, force_y


@inlined
def decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Make a full step of each robot along the sum of its forces; straight on without any."""
    constants = scratch(ONE, np.float64)
    for i in range(percept.heading.shape[0]):
        floats = arrays.state.floats[i]
        ints = arrays.state.ints[i]
        per_range = 1.0 / percept.sensing_range[i]
        _adapt(i, percept, arrays.parameters, floats[_LATELY], constants)
        before = np.uint64(ints[0, USED])
        used, sensed = update_target_tracks(i, percept, arrays.state, FARTHEST * percept.sensing_range[i], OLDEST)
        kept = weigh(used, floats, ints, constants[DECAY])
        mine = share(i, kept, before, constants[_FADE], constants, percept, arrays.state)
        idle = max(1.0 - mine, 0.0)
        x, y = pull(idle, kept, constants, floats, per_range)
        push_x, push_y = push(i, idle, constants, percept)
        chase_x, chase_y = _chase(idle, used & ~sensed, constants, floats, ints)
        forward = constants[_ALONE_FORWARD] * max(1.0 - abs(mine - 1.0), 0.0)
        x += push_x + chase_x + forward * percept.heading[i, 0]
        y += push_y + chase_y + forward * percept.heading[i, 1]
        go_along(i, x, y, percept, action)


@dataclass(frozen=True, repr=False)
class AdaptiveForces(ConstantsPolicy):
    """Forces like those of `GroupForces`, with more memory and constants that depend on the place.

    A target stays a teammate's after that is perceived no longer, for a while. A robot without targets goes to where
    one that it lost should be, unless a teammate held it. Each constant grows or shrinks with the numbers of targets
    and of teammates that the robot met lately.

    Parameters
    ----------
    constants : sequence of float, optional
        The `SIZE` constants, in the order of `BLOCKS`; by default those shipped.

    Raises
    ------
    ValueError
        If there are not `SIZE` of them, or one is not finite.

    Notes
    -----
    *Source:* none; found by ``teamsight evolve train --policy adaptive-forces`` in worlds of CMOMMT; see
    docs/evolved.md. It reads odometry (``percept.moved``), the heading in the world's frame, and the identities of the
    targets that a robot senses itself, of which it remembers at most 24.
    """

    kernel = decide
    needs = ("teammates",)
    blocks = BLOCKS
    file = Path(__file__).parent / "data" / "adaptive_forces.json"
    cure = "make it again with `teamsight evolve train --policy adaptive-forces`"
    spreads = _SPREADS

    @classmethod
    def beginning(cls, seed: int) -> npt.NDArray[np.float64]:
        """Return the constants of `GroupForces`, with a memory, in every place the same."""
        parts = group_forces.GroupForces.parts(group_forces.GroupForces.shipped())
        nowhere = {name: np.zeros(shape) for name, shape in BLOCKS.items()}
        return np.array(cls.vector({**nowhere, **parts, **_BEGINNING}))

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, TRACKS + 1, FIELDS)), np.zeros((size, TRACKS, HELD_OF + 1), np.int64))
