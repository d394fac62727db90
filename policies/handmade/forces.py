"""Forces of teammates and targets as functions of distance, positive values attract; and who is near a target.

Notes
-----
*Source:* §7 and Fig. 9 for the repulsion of robots; Parker (1997, 1999, 2002) for the attraction of targets.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.kernel import inlined, plain


def repulsion(distance: npt.ArrayLike, d1: float, d2: float) -> npt.NDArray[np.float64]:
    """Return the force of a teammate: −1 up to `d1`, rising linearly to 0 at `d2`, 0 beyond.

    Parameters
    ----------
    distance : array_like
        [length].
    d1, d2 : float
        Distances where the force starts to weaken and where it ends [length]; 0 ≤ d1 ≤ d2.

    Returns
    -------
    ndarray, of the shape of `distance`, float64
        Between −1 and 0.

    Notes
    -----
    *Source:* §7, Fig. 9.
    """
    check_ascending(d1=d1, d2=d2)
    corners = repulsion_corners(d1, d2)
    return np.asarray(np.vectorize(lambda d: plain(repel)(d, corners), otypes=[float])(np.asarray(distance, float)))


def attraction(
    distance: npt.ArrayLike, do1: float, do2: float, do3: float, predictive: float
) -> npt.NDArray[np.float64]:
    """Return the force of a target: −1 at 0, 0 at `do1`, 1 from `do2` to `do3`, 0 beyond `predictive`.

    Parameters
    ----------
    distance : array_like
        [length].
    do1, do2, do3, predictive : float
        Distances where the slope of the force changes [length]; ascending.

    Returns
    -------
    ndarray, of the shape of `distance`, float64
        Between −1 and 1.
    """
    check_ascending(do1=do1, do2=do2, do3=do3, predictive=predictive)
    corners = attraction_corners(do1, do2, do3, predictive)
    return np.asarray(np.vectorize(lambda d: plain(attract)(d, corners), otypes=[float])(np.asarray(distance, float)))


def check_ascending(**limits: float) -> None:
    """Raise an error for the first distance that is not finite, not at least 0 or below the one before."""
    before, least = "", 0.0
    for name, value in limits.items():
        checks.number(name, value)
        if value < least:
            raise ValueError(f"{name}={value:g}: must be at least {before or '0'}{f'={least:g}' if before else ''}")
        before, least = name, value


def repulsion_corners(d1: float, d2: float) -> tuple[float, ...]:
    """Return the parameters of `repel`: where the slope changes, and the slope."""
    return d1, d2, _slope(d1, d2)


def attraction_corners(do1: float, do2: float, do3: float, predictive: float) -> tuple[float, ...]:
    """Return the parameters of `attract`: where the slope changes, and the slopes."""
    return do1, do2, do3, predictive, _slope(0.0, do1), _slope(do1, do2), _slope(do3, predictive)


def _slope(begin: float, end: float) -> float:
    # Over an interval of length 0 the force jumps.
    return 1.0 / max(end - begin, 1e-300)


@inlined
def repel(distance: float, corners: tuple[float, ...]) -> float:
    """Return the force of one teammate; see `repulsion`."""
    # Limits instead of branches, which the processor could not predict.
    return max(min((distance - corners[1]) * corners[2], 0.0), -1.0)


@inlined
def attract(distance: float, corners: tuple[float, ...]) -> float:
    """Return the force of one target; see `attraction`."""
    near = distance * corners[4] - 1.0
    rise = min((distance - corners[0]) * corners[5], 1.0)
    fall = max((corners[3] - distance) * corners[6], 0.0)
    force = near if distance < corners[0] else rise
    return fall if distance > corners[2] else force


@inlined
def rivals(x: float, y: float, square: float, percept: Any, i: int) -> int:
    """Return how many teammates that robot `i` perceives are nearer to (x, y) than the root of `square`."""
    teammates = percept.teammates
    count = 0
    # Unsigned: numba would check each signed index for a negative value.
    for k in range(np.uint64(teammates.start[i]), np.uint64(teammates.start[i + 1])):
        way_x = x - teammates.offset[k, 0]
        way_y = y - teammates.offset[k, 1]
        count += way_x * way_x + way_y * way_y < square
    return count


#: Probability per step with which a target turns (§5).
TURN_PROBABILITY = 0.05


class Idle(NamedTuple):
    """An idle behaviour: its number in kernels, and how many random numbers a robot needs per decision."""

    number: float
    draws: int


BEHAVIOURS = {"redraw": Idle(0.0, 1), "wander": Idle(1.0, 2), "stay": Idle(2.0, 0)}


@inlined
def idle_step(behaviour: float, turn_probability: float, i: int, percept: Any, noise: Any, action: Any) -> None:
    """Write the action of the idle robot `i`; `behaviour` is a number of `BEHAVIOURS`.

    Row 0 of the noise decides the direction, row 1 (wander only) whether to turn.
    """
    if behaviour == 2.0:
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
        action.distance[i] = 0.0
        return
    action.distance[i] = percept.speed[i]
    if behaviour == 0.0 or noise[1, i] < turn_probability:
        x, y = direction(noise[0, i])
    else:
        x, y = percept.heading[i, 0], percept.heading[i, 1]
    action.heading[i, 0] = x
    action.heading[i, 1] = y
