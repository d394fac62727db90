"""Connected components in every frame, found in one graph whose nodes are robots in frames."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.sparse import coo_array, csgraph

from teamsight.analysis.contacts.frames import Edges

Ints = NDArray[np.int64]


def labels(edges: Edges, present: NDArray[np.bool_]) -> Ints:
    """Return the component of each robot in each frame, int64 of shape (frames, n).

    Components are numbered throughout, those of a frame one after the other; −1 stands for robots that are not there.
    """
    frames, size = present.shape
    nodes = frames * size
    one, other = (edges.frame * size + side for side in (edges.one, edges.other))
    matrix = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(nodes, nodes))
    found = csgraph.connected_components(matrix, directed=False)[1] if nodes else np.zeros(0)
    label = np.full(nodes, -1, np.int64)
    there = present.ravel()
    label[there] = np.unique(found[there], return_inverse=True)[1]
    return label.reshape(frames, size)


def component_table(label: Ints, time: NDArray[np.float64]) -> pd.DataFrame:
    """Return one row a frame; see `TemporalGraph.components`."""
    frames = len(label)
    there = label >= 0
    robots = there.sum(axis=1)
    sizes = np.bincount(label[there])
    # The frame of a component is that of any of its robots.
    frame = np.zeros(len(sizes), np.int64)
    frame[label[there]] = np.broadcast_to(np.arange(frames)[:, np.newaxis], label.shape)[there]
    largest = np.zeros(frames, np.int64)
    np.maximum.at(largest, frame, sizes)
    return pd.DataFrame(
        {
            "time": time,
            "robots": robots,
            "components": np.bincount(frame, minlength=frames),
            "largest": largest,
            "largest_share": np.divide(largest, robots, out=np.full(frames, np.nan), where=robots > 0),
            "isolated": np.bincount(frame[sizes == 1], minlength=frames),
        }
    )
