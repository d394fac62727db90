"""Forces between robots and targets as functions of distance: magnitudes, positive for attraction.

Notes
-----
*Source:* §7 and Fig. 9 for the repulsion of robots; Parker (1997, 1999, 2002) for the attraction of targets.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight import checks
from teamsight.kernel import inlined


def repulsion(distance: npt.ArrayLike, d1: float, d2: float) -> npt.NDArray[np.float64]:
    """Return the force along the way to a teammate: −1 below `d1`, linear to 0 at `d2`, 0 beyond.

    Parameters
    ----------
    distance : array_like
        [length].
    d1, d2 : float
        Where the force begins to fall and where it ends [length]; 0 ≤ d1 ≤ d2.

    Returns
    -------
    ndarray, of the shape of `distance`, float64
        Between −1 and 0.

    Notes
    -----
    *Source:* §7, Fig. 9.
    """
    check_ascending(d1=d1, d2=d2)
    return np.asarray(np.vectorize(repel.py_func, otypes=[float])(np.asarray(distance, float), d1, d2))


def attraction(distance: npt.ArrayLike, do1: float, do2: float, do3: float, predictive: float) -> npt.NDArray[np.float64]:
    """Return the force along the way to a target: −1 at 0, 0 at `do1`, 1 from `do2` to `do3`, 0 from `predictive` on.

    Parameters
    ----------
    distance : array_like
        [length].
    do1, do2, do3, predictive : float
        Where the force changes its slope [length]; ascending.

    Returns
    -------
    ndarray, of the shape of `distance`, float64
        Between −1 and 1.
    """
    check_ascending(do1=do1, do2=do2, do3=do3, predictive=predictive)
    return np.asarray(
        np.vectorize(attract.py_func, otypes=[float])(np.asarray(distance, float), do1, do2, do3, predictive)
    )


def check_ascending(**limits: float) -> None:
    """Refuse distances that are not finite, at least 0 and in ascending order.

    Raises
    ------
    ValueError
        Naming the first that is wrong.
    """
    before, least = "", 0.0
    for name, value in limits.items():
        checks.number(name, value)
        if value < least:
            raise ValueError(f"{name}={value:g}: must be at least {before or '0'}{f'={least:g}' if before else ''}")
        before, least = name, value


@inlined
def repel(distance: float, d1: float, d2: float) -> float:
    """Return the force of one teammate; see `repulsion`."""
    if distance < d1:
        return -1.0
    if distance < d2:
        return (distance - d2) / (d2 - d1)
    return 0.0


@inlined
def attract(distance: float, do1: float, do2: float, do3: float, predictive: float) -> float:
    """Return the force of one target; see `attraction`."""
    if distance < do1:
        return distance / do1 - 1.0
    if distance < do2:
        return (distance - do1) / (do2 - do1)
    if distance <= do3:
        return 1.0
    if distance < predictive:
        return (predictive - distance) / (predictive - do3)
    return 0.0
