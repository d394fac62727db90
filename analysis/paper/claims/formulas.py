"""Claims that need no simulation: inputs and search space (Fig. 2), and the repulsive force (Fig. 9)."""

from __future__ import annotations

import numpy as np

from teamsight.analysis.paper.claims.interface import Finding, claim

_D1, _D2 = 0.481, 0.769


@claim(
    where="§3, Figs. 1, 2",
    statement="inputs d against N for Θ(0), Θ(1), Θ(N), o(N); search space p^d",
    figure="n = 16, δ = 16, σ = 2, N = 1..30",
    rule="exact",
    by_construction=True,
)
def degrees() -> Finding:
    from teamsight.analysis.search_space import inputs, log10_size

    paper = {"none": (16, 0), "ring": (32, 0), "pairwise": (16, 2), "shared": (16, 16)}
    wrong = [
        (degree, team)
        for degree, (fixed, per_robot) in paper.items()
        for team in range(1, 31)
        if inputs(degree, team) != fixed + per_robot * team
        or not np.isclose(log10_size(inputs(degree, team), 10), fixed + per_robot * team)
    ]
    largest = ", ".join(str(inputs(degree, 30)) for degree in paper)
    measured = f"{largest} inputs; at N = 30" if not wrong else f"wrong for {wrong[0][0]} at N = {wrong[0][1]}"
    return measured, 2.0 if wrong else 0.0


@claim(
    where="§7, Fig. 9",
    statement="the repulsive force: −1 below d1, linear to 0 at d2, 0 beyond",
    figure="shape",
    rule="exact",
    by_construction=True,
)
def repulsion() -> Finding:
    from teamsight.policies.handmade.forces import repulsion

    distance = np.linspace(0.0, 1.5, 3001)
    paper = np.interp(distance, [_D1, _D2], [-1.0, 0.0])
    worst = float(np.abs(repulsion(distance, _D1, _D2) - paper).max())
    return f"largest deviation {worst:.1g}", worst / 1e-12
