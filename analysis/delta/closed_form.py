"""The largest number of neighbours, predicted without simulating.

The formula treats every robot as placed uniformly and independently of the others, and a run of T steps as a number of
independent snapshots of the team. It is exact for one snapshot of one robot; the rest is a Poisson approximation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from teamsight.core import checks

# Midpoints over the area of the disc; more do not change the first six digits of a prediction.
_RINGS = 2000
_BLOCK = 64
_NEVER = 1e-40


@dataclass(frozen=True)
class Prediction:
    """Prediction of the largest degree by the closed form.

    Parameters
    ----------
    at_least : ndarray of float64, shape (N,)
        P(the largest degree ≥ k), for k = 0 .. N − 1.
    snapshots : float
        T_eff, the effective number of independent snapshots in the runs.
    """

    at_least: NDArray[np.float64]
    snapshots: float

    @property
    def expected_maximum(self) -> float:
        """E[max], the expected largest degree."""
        return float(self.at_least[1:].sum())

    def exceedance(self, delta: int) -> float:
        """Return P(the largest degree > δ)."""
        return float(self.at_least[delta + 1]) if delta + 1 < len(self.at_least) else 0.0

    def delta(self, risk: float) -> int:
        """Return the smallest δ whose exceedance is at most `risk`."""
        risk = checks.number("risk", risk, least=0.0, most=1.0)
        return next(delta for delta in range(len(self.at_least)) if self.exceedance(delta) <= risk)


def overlap_share(distance: NDArray[np.float64], arena_radius: float, reach: float) -> NDArray[np.float64]:
    """Return p(ρ), the share of a disc arena within `reach` of a point at `distance` from its centre.

    Parameters
    ----------
    distance : ndarray of float64
        ρ, distance of the point from the centre [length], at most `arena_radius`.
    arena_radius, reach : float
        Radii of the arena and of the awareness disc [length].

    Notes
    -----
    *Source:* elementary geometry: the area that two discs have in common, over πR².
    """
    rho = np.asarray(distance, dtype=np.float64)
    area = np.full(rho.shape, np.pi * min(arena_radius, reach) ** 2)
    crossing = (rho > abs(arena_radius - reach)) & (rho < arena_radius + reach)
    d = rho[crossing]
    near = np.arccos(np.clip((d**2 + reach**2 - arena_radius**2) / (2 * d * reach), -1.0, 1.0))
    far = np.arccos(np.clip((d**2 + arena_radius**2 - reach**2) / (2 * d * arena_radius), -1.0, 1.0))
    # Each disc's sector less its triangle; together the triangles are a kite of the area d · R · sin(far).
    area[crossing] = reach**2 * near + arena_radius**2 * far - d * arena_radius * np.sin(far)
    area[rho >= arena_radius + reach] = 0.0
    return area / (np.pi * arena_radius**2)


def degree_tail(team_size: int, arena_radius: float, reach: float) -> NDArray[np.float64]:
    """Return q_k = P(a robot has at least k neighbours) in one snapshot, for k = 0 .. N − 1.

    Notes
    -----
    *Source:* q_k is the mean over ρ of P[Bin(N − 1, p(ρ)) ≥ k]; a uniform robot has ρ² uniform in [0, R²].
    """
    rho = arena_radius * np.sqrt((np.arange(_RINGS) + 0.5) / _RINGS)
    share = overlap_share(rho, arena_radius, reach)
    tail = np.zeros(team_size)
    for first in range(0, team_size, _BLOCK):
        k = np.arange(first, min(first + _BLOCK, team_size))
        tail[k] = stats.binom.sf(k[:, np.newaxis] - 1, team_size - 1, share).mean(axis=1)
        if tail[k[-1]] < _NEVER:
            break  # large teams: all larger degrees are less likely still
    return tail


def snapshots(steps: int, speed: float, reach: float) -> float:
    """Return T_eff of one run: clip(8 T v²/r², 1, T) for a walk that redraws its direction each step."""
    return float(np.clip(8.0 * steps * (speed / reach) ** 2, 1.0, steps))


def predict(
    team_size: int,
    arena_radius: float,
    *,
    steps: int = 600,
    runs: int = 1,
    awareness_range: float = 1.0,
    speed: float = 0.1,
) -> Prediction:
    """Predict the largest number of neighbours that any robot meets in a disc arena.

    Parameters
    ----------
    team_size : int
        N.
    arena_radius : float
        R [length].
    steps : int
        T, the length of a run.
    runs : int
        Number of runs over which the largest degree is taken; 1 for the exceedance in one run.
    awareness_range : float
        r, distance within which two robots are neighbours [length].
    speed : float
        v, the length of a step [length per step].

    Returns
    -------
    Prediction

    Raises
    ------
    ValueError
        If a number is outside its limits.

    Notes
    -----
    λ_k = N · runs · T_eff · q_k and P(max ≥ k) = 1 − exp(−λ_k).

    *Source:* this package; the paper only measures (Figs. 4 and 5).

    *Departs:* robots neither attract nor repel each other, and the robots of a snapshot count as independent. Policies
    that keep robots apart (A-CMOMMT) stay below the prediction, those that gather them exceed it; for these only a
    simulation is valid.
    """
    team_size = checks.count("team_size", team_size)
    steps, runs = checks.count("steps", steps), checks.count("runs", runs)
    arena_radius = checks.number("arena_radius", arena_radius, above=0.0)
    awareness_range = checks.number("awareness_range", awareness_range, above=0.0)
    speed = checks.number("speed", speed, least=0.0)
    independent = runs * snapshots(steps, speed, awareness_range)
    rate = team_size * independent * degree_tail(team_size, arena_radius, awareness_range)
    at_least = -np.expm1(-rate)
    at_least[0] = 1.0  # every robot has at least no neighbour
    return Prediction(at_least, independent)
