"""The neighbour graph, compared with networkx's own geometric graphs and scipy's cKDTree."""

from __future__ import annotations

from itertools import pairwise

import networkx as nx
import numpy as np
import pandas as pd
import pytest
from chance import generator
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from teamsight.analysis import neighbour_graph
from teamsight.world.search import proximity_graph

teams = st.builds(
    lambda size, side, seed: np.random.default_rng(seed).uniform(0, side, (size, 2)),
    st.integers(1, 30),
    st.floats(0.5, 8.0),
    st.integers(0, 2**32 - 1),
)


def _geometric(position: np.ndarray, reach: float) -> nx.Graph:
    network = nx.Graph()
    network.add_nodes_from(range(len(position)))
    network.add_edges_from(cKDTree(position).query_pairs(reach))
    return network


@settings(deadline=None)  # the first example compiles
@given(position=teams)
def test_frame_is_what_networkx_finds(position: np.ndarray) -> None:
    network = _geometric(position, 1.0)
    parts = list(nx.connected_components(network))
    degree = [number for _, number in network.degree]
    found = neighbour_graph.frame(proximity_graph(position, None, 1.0))
    assert found == neighbour_graph.Frame(
        robots=len(position),
        mean_degree=pytest.approx(np.mean(degree)),
        max_degree=max(degree),
        edges=network.number_of_edges(),
        components=len(parts),
        largest_component=max(map(len, parts)),
        largest_clique=max(map(len, nx.find_cliques(network))),
    )


@settings(deadline=None)  # the first example compiles
@given(position=teams)
def test_flat_arrays_hold_the_same_graph(position: np.ndarray) -> None:
    network = _geometric(position, 1.0)
    graph = proximity_graph(position, None, 1.0)
    edges = neighbour_graph.mutual_edges(graph)
    assert set(map(tuple, edges.tolist())) == {tuple(sorted(edge)) for edge in network.edges}
    assert (edges[:, 0] < edges[:, 1]).all()
    label = neighbour_graph.components(edges, len(position))
    for part in nx.connected_components(network):
        assert len(set(label[sorted(part)])) == 1
    clique = neighbour_graph.largest_clique(edges, len(position))
    assert clique is not None
    assert all(network.has_edge(one, other) for one in clique for other in clique if one < other)


@settings(deadline=None)  # the first example compiles
@given(position=teams, seed=st.integers(0, 2**32 - 1))
def test_unequal_ranges_leave_the_mutual_edges(position: np.ndarray, seed: int) -> None:
    reach = np.random.default_rng(seed).uniform(0.2, 2.0, len(position))
    graph = proximity_graph(position, None, reach)
    distance = np.hypot(*(position[:, np.newaxis] - position[np.newaxis]).transpose(2, 0, 1))
    sees = (distance <= reach[:, np.newaxis]) & ~np.eye(len(position), dtype=bool)
    assert graph.degree.tolist() == sees.sum(axis=1).tolist()
    mutual = np.argwhere(np.triu(sees & sees.T))
    assert neighbour_graph.mutual_edges(graph).tolist() == mutual.tolist()
    assert neighbour_graph.to_networkx(graph).number_of_edges() == len(mutual)
    assert neighbour_graph.to_networkx(graph, directed=True).number_of_edges() == sees.sum()


def test_nobody_and_one() -> None:
    nobody = neighbour_graph.frame(proximity_graph(np.empty((0, 2)), None, 1.0))
    assert nobody == neighbour_graph.Frame(0, 0.0, 0, 0, 0, 0, 0)
    alone = neighbour_graph.frame(proximity_graph(np.zeros((1, 2)), None, 1.0))
    assert alone == neighbour_graph.Frame(1, 0.0, 0, 0, 1, 1, 1)


def test_networkx_graph_carries_names_positions_and_distances() -> None:
    position = np.array([[0.0, 0.0], [0.6, 0.8], [5.0, 5.0]])
    network = neighbour_graph.to_networkx(proximity_graph(position, None, 1.5), position, ["a", "b", "c"])
    assert dict(network.nodes(data="position")) == {"a": (0.0, 0.0), "b": (0.6, 0.8), "c": (5.0, 5.0)}
    assert list(network.edges) == [("a", "b")]
    assert network.edges["a", "b"]["distance"] == pytest.approx(1.0)


def test_a_large_team_in_one_place_is_quick() -> None:
    graph = proximity_graph(generator().uniform(0, 0.5, (300, 2)), None, 1.0)
    assert neighbour_graph.frame(graph).largest_clique == 300


def test_a_costly_clique_is_given_up() -> None:
    # Twenty pairs that are everyone's neighbours but each other's: 2^20 maximal cliques of the same size.
    network = nx.complement(nx.Graph([(2 * pair, 2 * pair + 1) for pair in range(20)]))
    edges = np.array(sorted(tuple(sorted(edge)) for edge in network.edges), dtype=np.int64)
    assert neighbour_graph.largest_clique(edges, 40, budget=1000) is None


@pytest.fixture
def walk() -> np.ndarray:
    rng = generator()
    return np.cumsum(rng.normal(0, 0.2, (12, 8, 2)), axis=0) + rng.uniform(0, 3, (1, 8, 2))


def test_over_positions_has_a_row_for_each_frame(walk: np.ndarray) -> None:
    time = np.arange(12) * 0.5
    found = neighbour_graph.over_positions(time, walk, 1.0)
    assert found["time"].tolist() == time.tolist()
    for row, position in zip(found.itertuples(), walk, strict=True):
        network = _geometric(position, 1.0)
        assert row.edges == network.number_of_edges()
        assert row.max_degree == max(number for _, number in network.degree)


def test_over_trajectory_is_the_same_in_any_row_order(walk: np.ndarray) -> None:
    frame, robot = np.mgrid[:12, :8]
    flat = {"time": frame * 0.5, "identity": robot, "x": walk[..., 0], "y": walk[..., 1]}
    trajectory = pd.DataFrame({name: values.ravel() for name, values in flat.items()}).sample(frac=1)
    expected = neighbour_graph.over_positions(np.arange(12) * 0.5, walk, 1.0)
    pd.testing.assert_frame_equal(neighbour_graph.over_trajectory(trajectory, 1.0), expected)


def test_over_trajectory_refuses_mixed_groups() -> None:
    trajectory = pd.DataFrame({"time": [0.0, 0.0], "group": ["robots", "targets"], "x": [0.0, 0.0], "y": [0.0, 0.0]})
    with pytest.raises(ValueError, match="robots, targets: select one"):
        neighbour_graph.over_trajectory(trajectory, 1.0)


def test_cliques_can_be_left_out(walk: np.ndarray) -> None:
    found = neighbour_graph.over_positions(range(12), walk, 1.0, cliques=False)
    assert found["largest_clique"].isna().all()
    assert all(later > earlier for earlier, later in pairwise(found["time"]))


def test_robots_that_are_not_there_have_no_neighbours(walk: np.ndarray) -> None:
    gone = walk.copy()
    gone[3:7, 2] = np.nan
    gone[5] = np.nan
    found = neighbour_graph.over_positions(range(12), gone, np.linspace(0.5, 1.5, 8))
    for row, position in zip(found.itertuples(), gone, strict=True):
        there = ~np.isnan(position[:, 0])
        alone = neighbour_graph.frame(proximity_graph(position[there], None, np.linspace(0.5, 1.5, 8)[there]))
        assert tuple(row)[2:] == tuple(alone)
    frame, robot = np.mgrid[:12, :8]
    flat = {"time": frame, "identity": robot, "x": gone[..., 0], "y": gone[..., 1]}
    trajectory = pd.DataFrame({name: values.ravel() for name, values in flat.items()})
    expected = neighbour_graph.over_positions(range(12), gone, 1.0)
    pd.testing.assert_frame_equal(neighbour_graph.over_trajectory(trajectory, 1.0), expected)


@given(position=teams)
def test_square_ranges_follow_the_chebyshev_distance(position: np.ndarray) -> None:
    pairs = cKDTree(position).query_pairs(1.0, p=np.inf)
    found = neighbour_graph.over_positions([0.0], position[None], 1.0, range_shape="square")
    assert found["edges"].tolist() == [len(pairs)]
    rows = pd.DataFrame({"time": 0.0, "x": position[:, 0], "y": position[:, 1]})
    assert neighbour_graph.over_trajectory(rows, 1.0, range_shape="square")["edges"].tolist() == [len(pairs)]
