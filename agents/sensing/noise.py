"""The noise of sensors: four random words for each tick, observer and observed agent.

Notes
-----
*Source:* G. E. P. Box and M. E. Muller, "A note on the generation of random normal deviates", Annals of Mathematical
Statistics 29 (1958).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.core.angles import direction
from teamsight.core.kernel import bits_of, float_of, inlined
from teamsight.world.noise import philox

#: In place of an identity: the noise of an observer's false detections.
NOBODY = 2**32 - 1

# The parts of a float64.
_BIAS = 1023
_FRACTION = np.uint64(2**52 - 1)
_ONE = np.uint64(_BIAS << 52)

_ROOT = math.sqrt(2.0)
_LOG_2 = math.log(2.0)
_FULL_TURN = 2.0 * math.pi

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
def _minus_log(word: np.uint64) -> float:
    """Return −ln of the uniform number of a word, to within 1e-11 of its value.

    Unlike that of the mathematics library, it can be computed in SIMD lanes and is the same on every machine.
    """
    bits = bits_of(np.float64(np.int64(word)) + 0.5)
    power = np.int64(bits >> np.uint64(52)) - (_BIAS + 32)
    part = float_of((bits & _FRACTION) | _ONE)
    # From [1, 2) to [√½, √2), where the series converges fast.
    is_high = part > _ROOT
    part = 0.5 * part if is_high else part
    s = (part - 1.0) / (part + 1.0)
    t = s * s
    # Here and below sums are grouped so that their parts can be computed at the same time: nothing else waits.
    tt = t * t
    series = (1.0 + t * (1 / 3)) + tt * (1 / 5 + t * (1 / 7)) + tt * tt * ((1 / 9 + t * (1 / 11)) + tt * (1 / 13))
    return -((power + is_high) * _LOG_2 + 2.0 * s * series)  # type: ignore[no-any-return]


@inlined
def normals(word: np.uint64, other: np.uint64) -> tuple[float, float]:
    """Return two independent standard normal numbers, from two words."""
    x, y = direction(uniform(other))
    length = math.sqrt(2.0 * _minus_log(word))
    return length * x, length * y


@inlined
def rotation(turns: float) -> tuple[float, float]:
    """Return cosine and sine of any number of full turns, to within 1e-12; faster than `direction`."""
    quarter = np.rint(4.0 * turns)
    t = (turns - 0.25 * quarter) * _FULL_TURN
    s = t * t
    ss = s * s
    sine = (1.0 - s * (1 / 6)) + ss * (1 / 120 - s * (1 / 5040)) + ss * ss * (1 / 362880 - s * (1 / 39916800))
    sine = t * (sine + ss * ss * ss * (1 / 6227020800))
    cosine = (1.0 - s * 0.5) + ss * (1 / 24 - s * (1 / 720)) + ss * ss * (1 / 40320 - s * (1 / 3628800))
    cosine += ss * ss * ss * (1 / 479001600 - s * (1 / 87178291200))
    which = int(quarter)
    x = -sine if which & 1 else cosine
    y = cosine if which & 1 else sine
    return (-x if which & 2 else x), (-y if which & 2 else y)
