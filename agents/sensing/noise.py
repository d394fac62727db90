"""The noise of sensors: four random words for each tick, observer and observed agent.

Notes
-----
*Source:* M. J. Wichura, "Algorithm AS 241: the percentage points of the normal distribution", Applied Statistics 37
(1988), function PPND7.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.core.kernel import inlined, kernel
from teamsight.world.noise import philox

#: In place of an identity: the noise of an observer's false detections.
NOBODY = 2**32 - 1

_MIDDLE = 0.425


@inlined
def words_of(view: Any, i: int, identity: Any) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return four random words of 32 bits: those of observer `i` and of the observed agent with this identity.

    They depend on the observer's number within its group, on the agent's identity and on the tick, but not on the
    order or the number of agents.

    Parameters
    ----------
    view : View
        What the sensor starts from.
    i : int
        The observer.
    identity : int
        From `View.everyone`, or `NOBODY` for the observer's false detections.
    """
    return philox(
        np.uint64(view.tick[0]), np.uint64(view.member[i]), np.uint64(identity), np.uint64(view.stream),
        view.key[0] ^ view.salt[0], view.key[1] ^ view.salt[1],
    )  # fmt: skip


@inlined
def uniform(word: np.uint64) -> float:
    """Return the uniform number in (0, 1) of a word."""
    return (np.float64(np.int64(word)) + 0.5) * 2.0**-32  # type: ignore[no-any-return]


@inlined
def middle_normal(q: float) -> float:
    """Return the standard normal number whose distribution function is q + ½, if \\|q\\| ≤ 0.425."""
    r = _MIDDLE * _MIDDLE - q * q
    above = 3.3871327179 + r * (50.434271938 + r * (159.29113202 + r * 59.109374720))
    return q * above / (1.0 + r * (17.895169469 + r * (78.757757664 + r * 67.187563600)))


@inlined
def is_tail(q: float) -> bool:
    """Whether `tail_normal` is to be used: in 15 % of all cases."""
    return abs(q) > _MIDDLE


@kernel
def tail_normal(q: float) -> float:
    """Return the standard normal number whose distribution function is q + ½, if \\|q\\| > 0.425."""
    # The function's third part begins at r = 5, but r is below 4.8 for words of 32 bits.
    r = math.sqrt(-math.log(0.5 - abs(q))) - 1.6
    above = 1.4234372777 + r * (2.7568153900 + r * (1.3067284816 + r * 0.17023821103))
    z = above / (1.0 + r * (0.73700164250 + r * 0.12021132975))
    return -z if q < 0.0 else z


@inlined
def normal(word: np.uint64) -> float:
    """Return the standard normal number of a word, to within 1e-6: the inverse of its distribution function."""
    q = uniform(word) - 0.5
    return tail_normal(q) if is_tail(q) else middle_normal(q)
