"""The largest clique of a graph: a largest set of robots that all sense one another."""

from __future__ import annotations

from itertools import islice

import networkx as nx
import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

#: Maximal cliques that are examined, in about a second, before the search for the largest is abandoned.
CLIQUE_BUDGET = 100_000


def largest_clique(edges: Ints, size: int, *, budget: int = CLIQUE_BUDGET) -> Ints | None:
    """Return a largest set of robots that all sense one another, sorted, or None if it is too costly to find.

    Parameters
    ----------
    edges : ndarray of int64, shape (m, 2)
        Mutual edges.
    size : int
        Number of robots.
    budget : int
        Maximal cliques to examine before giving up.

    Notes
    -----
    A robot of a clique of size c has a core number of at least c − 1. Only robots whose core number is at least the
    size of the best clique found can belong to a larger one; in sparse teams few or none remain.
    """
    if not len(edges):
        return np.arange(min(size, 1), dtype=np.int64)
    network = nx.Graph()
    network.add_edges_from(edges.tolist())
    core = nx.core_number(network)
    best = _greedy_clique(network, core)
    dense = network.subgraph([robot for robot, number in core.items() if number >= len(best)])
    cliques = list(islice(nx.find_cliques(dense), budget))
    best = max([best, *cliques], key=len)
    return None if len(cliques) == budget else np.array(sorted(best), dtype=np.int64)


def _greedy_clique(network: nx.Graph, core: dict[int, int]) -> list[int]:
    """Return a large clique, grown from each robot of the densest core through its densest neighbours."""
    densest = max(core.values())
    best: list[int] = []
    for seed in [robot for robot, number in core.items() if number == densest]:
        clique, candidates = [seed], set(network[seed])
        while candidates:
            robot = max(candidates, key=lambda one: (core[one], -one))
            clique.append(robot)
            candidates &= set(network[robot])
        best = max(best, clique, key=len)
        if len(best) == densest + 1:  # no clique can be larger
            break
    return best
