"""The neighbour graph: its degrees, components and cliques, at one time and over time.

All functions work on the flat arrays of a `NeighbourList`; networkx is used for cliques, and by `to_networkx`. With
unequal ranges the graph is directed. Degrees count the robots that a robot senses; edges, components and cliques are
those of the mutual edges, where both robots sense each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import networkx as nx
import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csgraph

from teamsight.analysis.cliques import largest_clique
from teamsight.analysis.teams import active_team_graph, check_team
from teamsight.core import checks
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.search import proximity_graph

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.world.arena import Arena

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


class Frame(NamedTuple):
    """Numbers of the neighbour graph at one time."""

    robots: int
    mean_degree: float
    max_degree: int
    edges: int
    components: int
    largest_component: int
    largest_clique: int | None  # None: not requested, or too costly


def mutual_edges(graph: NeighbourList) -> Ints:
    """Return the pairs of robots that sense each other, int64 of shape (m, 2), sorted, the smaller index first."""
    size = len(graph.degree)
    observer = np.repeat(np.arange(size, dtype=np.int64), graph.degree)
    low, high = np.minimum(observer, graph.identity), np.maximum(observer, graph.identity)
    pair, seen = np.unique(low * size + high, return_counts=True)
    return np.column_stack(np.divmod(pair[seen == 2], max(size, 1)))


def components(edges: Ints, size: int) -> Ints:
    """Return the component of each robot, int64 of shape (size,), numbered from 0.

    Parameters
    ----------
    edges : ndarray of int64, shape (m, 2)
        Mutual edges.
    size : int
        Number of robots.
    """
    matrix = coo_array((np.ones(len(edges), dtype=np.int8), tuple(edges.T)), shape=(size, size))
    return np.asarray(csgraph.connected_components(matrix, directed=False)[1], dtype=np.int64)


def frame(graph: NeighbourList, *, cliques: bool = True) -> Frame:
    """Return the numbers of a neighbour graph.

    Parameters
    ----------
    graph : NeighbourList
        Robots among themselves.
    cliques : bool
        Whether to find the largest clique, which is by far the most costly.
    """
    size = len(graph.start) - 1
    degree, edges = graph.degree, mutual_edges(graph)
    label = components(edges, size)
    clique = largest_clique(edges, size) if cliques else None
    return Frame(
        robots=size,
        mean_degree=float(degree.mean()) if size else 0.0,
        max_degree=int(np.max(degree, initial=0)),
        edges=len(edges),
        components=int(np.max(label, initial=-1)) + 1,
        largest_component=int(np.max(np.bincount(label), initial=0)),
        largest_clique=None if clique is None else len(clique),
    )


def to_networkx(
    graph: NeighbourList, position: Floats | None = None, identity: ArrayLike | None = None, *, directed: bool = False
) -> Any:
    """Return a neighbour graph as a graph of networkx.

    Parameters
    ----------
    graph : NeighbourList
        Robots among themselves.
    position : ndarray of float64, shape (n, 2), optional
        Attribute ``position`` of each node, a pair of floats [length].
    identity : array_like of shape (n,), optional
        Names of the nodes, such as ``model.teammates.identity``; 0 .. n − 1 by default.
    directed : bool
        Return all edges, each from the robot that senses to the one that is sensed, instead of the mutual ones.

    Returns
    -------
    networkx.Graph or networkx.DiGraph
        Each edge has the attribute ``distance`` [length].
    """
    names = range(len(graph.degree)) if identity is None else np.asarray(identity).tolist()
    network = nx.DiGraph() if directed else nx.Graph()
    network.add_nodes_from(names)
    if position is not None:
        nx.set_node_attributes(network, dict(zip(names, map(tuple, position.tolist()), strict=True)), "position")
    observer = np.repeat(np.arange(len(graph.degree)), graph.degree)
    mutual = set(map(tuple, mutual_edges(graph).tolist()))
    for one, other, distance in zip(observer.tolist(), graph.identity.tolist(), graph.distance.tolist(), strict=True):
        if directed or (one, other) in mutual:
            network.add_edge(names[one], names[other], distance=distance)
    return network


def over_time(
    model: World, steps: int, *, every: int = 1, cliques: bool = True, team: str | None = None, sensed: bool = False
) -> pd.DataFrame:
    """Run a model and return the numbers of the neighbour graph of its teams, from its present step on.

    Parameters
    ----------
    model : World
        All active agents on a team count, whatever their group; agents of different teams are not neighbours.
    steps : int
        Number of steps.
    every : int
        Steps between frames.
    cliques : bool
        Whether to find the largest clique in each frame.
    team : str, optional
        The only team that counts; by default all do.
    sensed : bool
        Count only the teammates that a robot's sensor detects, not all within its awareness range; see `Group.sensors`.

    Returns
    -------
    DataFrame
        One row a frame: time [steps], and the fields of `Frame`; largest_clique is missing where it was not computed.
        There are fewer rows if the model stops running.

    Raises
    ------
    TypeError, ValueError
        If a number is not whole or outside its limits, or no group of the model is on a team, or on the given one;
        the model stays as it is.
    """
    from teamsight.agents.world import World

    if not isinstance(model, World):
        raise TypeError(f"model={checks.shown(model)}: must be a World, such as CMOMMT(robots=5)")
    steps, every = checks.count("steps", steps, least=0), checks.count("every", every)
    check_team(model, team, f"model={checks.shown(model)}")

    def graphs() -> Iterator[tuple[float, NeighbourList]]:
        yield model.tick, active_team_graph(model, team, sensed=sensed)
        end = model.tick + steps
        while (before := model.tick) < end and model.running:
            model.run(min(every, end - before))
            if model.tick == before:
                return  # the model has stopped
            yield model.tick, active_team_graph(model, team, sensed=sensed)

    return table(graphs(), cliques=cliques)


def over_positions(
    time: ArrayLike,
    position: Floats,
    awareness_range: float | Floats,
    arena: Arena | None = None,
    *,
    range_shape: str = "disc",
    cliques: bool = True,
) -> pd.DataFrame:
    """Return the numbers of the neighbour graph for recorded positions of a team of constant size.

    Parameters
    ----------
    time : array_like of float, shape (frames,)
        Times of the frames.
    position : ndarray of float64, shape (frames, robots, 2)
        Positions [length]; NaN while a robot is not there, because it has failed or left.
    awareness_range : float or ndarray of float64, shape (robots,)
        Distance within which each robot senses others [length].
    arena : Disc, Box or Torus, optional
        Changes distances only if it is periodic, as a torus is.
    range_shape : {"disc", "square"}
        The shape of ranges. In a square are robots at most the range away along either axis.
    cliques : bool
        Whether to find the largest clique in each frame.

    Returns
    -------
    DataFrame
        See `over_time`.
    """
    reach = np.broadcast_to(np.asarray(awareness_range, float), position.shape[1:2])
    present = ~np.isnan(position[..., 0])
    graphs = (
        proximity_graph(place[there], None, reach[there], arena, range_shape=range_shape)
        for place, there in zip(position, present, strict=True)
    )
    return table(zip(np.asarray(time).tolist(), graphs, strict=True), cliques=cliques)


def over_trajectory(
    trajectory: pd.DataFrame,
    awareness_range: float | Mapping[str, float],
    arena: Arena | None = None,
    *,
    range_shape: str = "disc",
    cliques: bool = True,
) -> pd.DataFrame:
    """Return the numbers of the neighbour graph for a trajectory, in which agents may come and go.

    Parameters
    ----------
    trajectory : DataFrame
        Columns time, x, y: one row an agent and time, from ``model.recording.trajectory``; x and y are NaN while an
        agent is not there. With a column run, agents of different runs do not meet.
    awareness_range : float or mapping of str to float
        Distance within which robots sense each other [length]; or that of each group of one team, by its name in the
        column group. Agents of other groups are left out.
    arena, range_shape, cliques
        See `over_positions`.

    Returns
    -------
    DataFrame
        As `over_time`; with a column run in front if the trajectory has one.

    Raises
    ------
    ValueError
        If the trajectory holds several groups and there is one range: their agents would count as one another's
        neighbours. If it lacks a group of the mapping.
    """
    if isinstance(awareness_range, Mapping):
        trajectory = _of_groups(trajectory, awareness_range)
    elif "group" in trajectory and (several := trajectory["group"].unique()).size > 1:
        raise ValueError(
            f"the trajectory holds the groups {', '.join(map(str, several))}: select one, as in "
            f"trajectory[trajectory.group == {several[0]!r}]; or give the range of each group of one team, as in "
            f"awareness_range={{{several[0]!r}: {awareness_range}, …}}"
        )
    else:
        trajectory = trajectory.assign(reach=awareness_range)
    keys = ["run", "time"] if "run" in trajectory else ["time"]
    frames = [(key, rows[["x", "y", "reach"]].to_numpy(float)) for key, rows in trajectory.groupby(keys, observed=True)]
    frames = [(key, rows[~np.isnan(rows[:, 0])]) for key, rows in frames]
    graphs = (
        (key[-1], proximity_graph(rows[:, :2].copy(), None, rows[:, 2].copy(), arena, range_shape=range_shape))
        for key, rows in frames
    )
    found = table(graphs, cliques=cliques)
    if "run" in trajectory:
        found.insert(0, "run", [key[0] for key, _ in frames])
    return found


def _of_groups(trajectory: pd.DataFrame, awareness_range: Mapping[str, float]) -> pd.DataFrame:
    """Return the rows of some groups, with their ranges in a column reach."""
    held = trajectory["group"].unique().tolist() if "group" in trajectory else []
    if missing := [name for name in awareness_range if name not in held]:
        found = f"holds {', '.join(map(repr, held))}" if held else "has no column group"
        raise ValueError(f"awareness_range: names the group {missing[0]!r}, but the trajectory {found}; name others")
    chosen = trajectory[trajectory["group"].isin(list(awareness_range))]
    return chosen.assign(reach=chosen["group"].map(dict(awareness_range)).astype(float))


def table(graphs: Iterable[tuple[Any, NeighbourList]], *, cliques: bool = True) -> pd.DataFrame:
    """Return one row for each time and graph: the time, and the fields of `Frame`."""
    rows = [(time, *frame(graph, cliques=cliques)) for time, graph in graphs]
    return pd.DataFrame(rows, columns=["time", *Frame._fields]).astype({"largest_clique": "Int64"})
