"""Inputs and size of the search space of a learner under each degree of awareness (Fig. 2)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import product

import pandas as pd

from teamsight.agents.awareness import AWARENESS, RingAwareness
from teamsight.agents.awareness.degrees import SIGMA
from teamsight.agents.awareness.interface import OWN_SECTORS
from teamsight.core import checks

#: The degrees of the paper, in the order of Fig. 1.
TOUZET = ("none", "ring", "pairwise", "shared")
#: n, the inputs that do not describe teammates: one ring of 16 sectors (§8, footnote 2).
OWN_INPUTS = OWN_SECTORS
#: δ, the inputs that Θ(1) adds for all teammates together.
DELTA = RingAwareness.delta
#: p, the possible readings of one input. 2 is the smallest number, so that p^d is a lower bound.
READINGS = 2


def inputs(degree: str, team_size: int, *, own: int = OWN_INPUTS, delta: int = DELTA, sigma: int = SIGMA) -> int:
    """Return d, the number of inputs of a robot, which is the dimension of its search space.

    Parameters
    ----------
    degree : str
        A name in `teamsight.agents.awareness.AWARENESS`.
    team_size : int
        N, at least 1.
    own : int
        n, the inputs that do not describe teammates.
    delta : int
        δ: the inputs that a ring adds for all teammates together, or the teammates in a list of the nearest.
    sigma : int
        σ, the inputs for each robot of the team under Θ(N), or in a list.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        If the degree is unknown or a number is below 1.

    Notes
    -----
    *Source:* §3 and Fig. 1, drawn in Fig. 2 with n = 16, δ = 16, σ = 2.

    The paper calls the degree that shares all inputs o(N). Its n + nN grows in proportion to N, and is written Θ(N) in
    the usual notation, like n + σN; o(N) usually means slower growth than N. The paper's label is kept as a name.

    Fig. 1 asks for δ < N and, for σ, for N ≤ σ < nN, but Fig. 2 is drawn with δ = 16 from N = 1 on and with σ = 2. What
    §3.4 needs is δ < σN < nN: for teams of up to δ/σ, a ring does not have fewer inputs than a list of all
    teammates. These conditions are not checked.

    A robot has N − 1 teammates, so its situation vector has slightly fewer components than these formulas say; for its
    length see the ``width(team_size)`` of a degree.
    """
    formula = AWARENESS[checks.choice("degree", degree, AWARENESS)].dimensions
    sizes = (("own", own), ("delta", delta), ("sigma", sigma), ("team_size", team_size))
    return formula(*(checks.count(name, value) for name, value in sizes))


def log10_size(dimensions: int, readings: int = READINGS) -> float:
    """Return log10 of p^d, the number of different situations, without overflow.

    Parameters
    ----------
    dimensions : int
        d, the number of inputs.
    readings : int
        p, the possible readings of one input.

    Notes
    -----
    *Source:* §3, "the search space size = p^d". The paper gives no value of p.
    """
    return checks.count("dimensions", dimensions, least=0) * math.log10(checks.count("readings", readings))


def dimensions_table(
    team_sizes: Iterable[int] = range(1, 31),
    *,
    own: int = OWN_INPUTS,
    delta: int = DELTA,
    sigma: int = SIGMA,
    readings: int = READINGS,
    degrees: Iterable[str] = tuple(AWARENESS),
) -> pd.DataFrame:
    """Return the data of Fig. 2 for some degrees, one row for each degree and team size.

    Parameters
    ----------
    team_sizes : iterable of int
        Values of N.
    own, delta, sigma : int
        See `inputs`.
    readings : int
        See `log10_size`.
    degrees : iterable of str
        Names of degrees; by default all of this package. Those of the paper are `TOUZET`.

    Returns
    -------
    DataFrame
        degree, growth, formula (str); team_size, own, added, inputs (int64); log10_size (float64).

    Notes
    -----
    *Source:* Fig. 2. The exact p^d of a row is ``readings ** int(inputs)``.
    """
    rows = [
        (name, AWARENESS[name].order, AWARENESS[name].formula, int(team_size),
         inputs(name, team_size, own=own, delta=delta, sigma=sigma))
        for name, team_size in product(degrees, team_sizes)
    ]
    table = pd.DataFrame(rows, columns=["degree", "growth", "formula", "team_size", "inputs"])
    table.insert(4, "own", own)
    table.insert(5, "added", table["inputs"] - own)
    return table.assign(log10_size=[log10_size(dimensions, readings) for dimensions in table["inputs"]])
