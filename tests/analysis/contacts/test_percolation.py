"""Percolation, compared with networkx and with the threshold of random geometric graphs."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import Torus
from teamsight.analysis.contacts import percolation


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), unequal=st.booleans())
def test_the_curve_is_what_networkx_finds(seed: int, unequal: bool) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 10))
    position = rng.uniform(0, 3, (3, size, 2))
    position[0, rng.random(size) < 0.3] = np.nan
    scale = rng.uniform(0.5, 2.0, size) if unequal else np.ones(size)
    ranges = np.sort(rng.uniform(0.1, 3.0, 4))
    found = percolation(position, ranges, awareness_range=scale)
    shares = []
    for frame in position:
        there = np.flatnonzero(~np.isnan(frame[:, 0]))
        if len(there) < 2:
            continue
        shares.append([])
        for reach in ranges:
            network = nx.Graph()
            network.add_nodes_from(there.tolist())
            for a in there.tolist():
                for b in there.tolist():
                    near = float(np.hypot(*(frame[a] - frame[b])))
                    if a < b and near <= reach * min(scale[a], scale[b]):
                        network.add_edge(a, b)
            shares[-1].append(max(map(len, nx.connected_components(network))) / len(there))
    assert found.curve["share"].tolist() == pytest.approx(np.mean(shares, axis=0).tolist())


def test_random_points_percolate_near_the_known_mean_degree() -> None:
    """An infinite team of Poisson points percolates at a mean degree of 4.512 (Quintanilla and Ziff, 2007).

    In 20 samples of 1,500 points on a torus, the range at which half of them are joined is within 8 % of it: the
    standard error is about 1 %, the shift of a finite team about 2 %.
    """
    rng, side, size = np.random.default_rng(8), 30.0, 1_500
    found = percolation(rng.uniform(-side / 2, side / 2, (20, size, 2)), None, Torus(side, side), run=np.arange(20))
    known = np.sqrt(4.512 * side * side / (np.pi * size))
    assert found.critical.mean == pytest.approx(known, rel=0.08)
    assert 0 < found.critical.high - found.critical.low < 0.1 * known
    assert found.connected.mean > found.critical.mean
    degree = np.interp(1.0, found.curve["range"], found.curve["mean_degree"])
    assert degree == pytest.approx(np.pi * size / side**2, rel=0.03)


def test_ranges_of_a_line_are_known() -> None:
    position = np.zeros((2, 4, 2))
    position[:, :, 0] = [0.0, 1.0, 3.0, 6.0]
    found = percolation(position, [0.5, 1.0, 2.5, 3.0])
    assert found.curve["share"].tolist() == [0.25, 0.5, 0.75, 1.0]
    assert found.curve["mean_degree"].tolist() == [0.0, 0.5, 1.0, 2.0]
    assert found.frames[["critical", "connected"]].to_numpy().tolist() == [[1.0, 3.0]] * 2
    assert found.critical.mean == 1.0


def test_wrong_input_is_named() -> None:
    place = np.zeros((2, 3, 2))
    for wrong, text in (
        (lambda: percolation(np.full((2, 3, 2), np.nan)), "no frame has two robots"),
        (lambda: percolation(place, [0.0]), "above 0"),
        (lambda: percolation(place, awareness_range=0.0), "above 0 for every robot"),
        (lambda: percolation(place, [3.0], Torus(4.0, 4.0)), "3"),
    ):
        with pytest.raises(ValueError, match=text):
            wrong()
