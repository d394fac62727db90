"""The largest number of neighbours, predicted without simulating.

Robots are placed uniformly and independently of each other, which gives the distribution of a robot's number of
neighbours. While they diffuse, it changes by one at a time, like a birth-death process. The formula counts how often
such a process reaches k neighbours afresh. Two constants were measured; docs/closed-form.md has a table of the errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from teamsight.core import checks

# Midpoints over the area of the disc; more do not change the first six digits of a prediction.
_RINGS = 2000
_BLOCK = 64
_NEVER = 1e-40
# A neighbour leaves with this probability per step, times v²/r².
_LEAVES = 1.1
# Events of one run come in clusters: their number has a negative binomial distribution with this shape.
_SHAPE = 2.0


@dataclass(frozen=True)
class Prediction:
    """Prediction of the largest degree by the closed form.

    Parameters
    ----------
    at_least : ndarray of float64, shape (N,)
        P(the largest degree ≥ k), for k = 0 .. N − 1.
    """

    at_least: NDArray[np.float64]

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

    def tail(k: NDArray[np.int64], share: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(stats.binom.sf(k - 1, team_size - 1, share))

    return _over_arena(tail, team_size, arena_radius, reach)


def degree_descent(team_size: int, arena_radius: float, reach: float) -> NDArray[np.float64]:
    """Return P(a robot has k neighbours) times how fast their number then falls, for k = 0 .. N − 1.

    The unit is the rate at which one neighbour leaves.

    Notes
    -----
    Each of the k neighbours leaves at rate 1, and each of the N − 1 − k others comes at rate p/(1 − p), which keeps
    Bin(N − 1, p) stationary. On average the number falls at the rate (k − (N − 1) p)/(1 − p). It falls and rises many
    times before it is far from k; all that is one event, and the average rate counts these events.

    *Source:* D. Aldous, Probability Approximations via the Poisson Clumping Heuristic, 1989.
    """

    def descent(k: NDArray[np.int64], share: NDArray[np.float64]) -> NDArray[np.float64]:
        # Where nobody can leave the awareness disc, the limit is taken.
        inside = np.minimum(share, 1 - 1e-12)
        speed = np.maximum(k - (team_size - 1) * inside, 0.0) / (1 - inside)
        return np.asarray(stats.binom.pmf(k, team_size - 1, inside) * speed)

    return _over_arena(descent, team_size, arena_radius, reach)


def _over_arena(
    measure: Callable[[NDArray[np.int64], NDArray[np.float64]], NDArray[np.float64]],
    team_size: int,
    arena_radius: float,
    reach: float,
) -> NDArray[np.float64]:
    """Return the mean of `measure(k, p(ρ))` over the places of a robot, for k = 0 .. N − 1."""
    rho = arena_radius * np.sqrt((np.arange(_RINGS) + 0.5) / _RINGS)
    share = overlap_share(rho, arena_radius, reach)
    found = np.zeros(team_size)
    for first in range(0, team_size, _BLOCK):
        k = np.arange(first, min(first + _BLOCK, team_size))
        found[k] = measure(k[:, np.newaxis], share).mean(axis=1)
        if found[k[-1]] < _NEVER and k[-1] > (team_size - 1) * share.max():
            break  # large teams: all larger degrees are less likely still
    return found


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
    λ_k = N [q_k + 1.1 T (v/r)² d_k], at most N T q_k, with q_k from `degree_tail` and d_k from `degree_descent`, and
    P(max ≥ k) = 1 − (1 + λ_k / 2)^(−2 runs): robots at one place share their neighbours, and a run is short against the
    time that it takes to mix, so the events of a run come in clusters. Small probabilities are λ_k.

    *Source:* this package; the paper only measures (Figs. 4 and 5). The factors 1.1 and 2 were measured on random walks
    (N = 5..50, R = 1..8, v = 0.05..0.5, T = 150..2400).

    *Departs:* robots neither attract nor repel each other, and turn to a new direction each step. Policies that keep
    robots apart (A-CMOMMT) stay below the prediction, those that gather them exceed it; for these only a simulation is
    valid.
    """
    team_size = checks.count("team_size", team_size)
    steps, runs = checks.count("steps", steps), checks.count("runs", runs)
    arena_radius = checks.number("arena_radius", arena_radius, above=0.0)
    awareness_range = checks.number("awareness_range", awareness_range, above=0.0)
    speed = checks.number("speed", speed, least=0.0)
    tail = degree_tail(team_size, arena_radius, awareness_range)
    events = _LEAVES * steps * (speed / awareness_range) ** 2 * degree_descent(team_size, arena_radius, awareness_range)
    rate = team_size * np.minimum(tail + events, steps * tail)
    # Who has more than k neighbours has had k: below the mean the descent alone would not say so.
    rate = np.maximum.accumulate(rate[::-1])[::-1]
    at_least = np.maximum(-np.expm1(-_SHAPE * runs * np.log1p(rate / _SHAPE)), tail)
    at_least[0] = 1.0  # every robot has at least no neighbour
    return Prediction(at_least)
