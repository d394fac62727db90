"""The size of the largest component as edges are added one by one, by union and find, as machine code."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.core.kernel import Entry, Record, inlined, kernel, plain

Ints = NDArray[np.int64]


class Joining(NamedTuple):
    """The record of one graph.

    Attributes
    ----------
    one, other : ndarray of int64, shape (m,)
        The nodes of each edge, in the order in which edges are added.
    parent : ndarray of int64, shape (n,)
        Overwritten: a node nearer to the root of its component; or, of a root, minus the size of the component.
    largest : ndarray of int64, shape (m,)
        Written: the size of the largest component after each edge.
    """

    one: Annotated[Ints, "m"]
    other: Annotated[Ints, "m"]
    parent: Annotated[Ints, "n"]
    largest: Annotated[Ints, "m"]


JOINING = Record(Joining)
joining_at = JOINING.at


@inlined
def _root(parent: Any, node: int) -> int:
    """Return the root of a component, and shorten the way to it by halving."""
    while parent[node] >= 0:
        above = parent[node]
        if parent[above] >= 0:
            parent[node] = parent[above]
        node = above
    return node


@kernel
def join(address: int) -> int:
    """Add the edges of a record one by one; return the number of the edge after which all nodes are joined, or −1."""
    graph = joining_at(address)
    parent = graph.parent
    parent[:] = -1
    largest = np.int64(1)
    done: Any = np.int64(-1)
    for edge in range(graph.one.shape[0]):
        low = _root(parent, graph.one[edge])
        high = _root(parent, graph.other[edge])
        if low != high:
            if parent[low] > parent[high]:
                low, high = high, low
            parent[low] += parent[high]
            parent[high] = low
            largest = max(largest, -parent[low])
            if largest == parent.shape[0] and done < 0:
                done = np.int64(edge)
        graph.largest[edge] = largest
    return done  # type: ignore[no-any-return]


_ENTRY = Entry(plain(join))


def largest_components(one: Ints, other: Ints, size: int) -> Ints:
    """Return the size of the largest component after each edge is added, int64 of shape (m,).

    Parameters
    ----------
    one, other : ndarray of int64, shape (m,)
        The nodes of each edge, 0 .. size − 1, in the order in which edges are added.
    size : int
        Number of nodes.
    """
    largest = np.zeros(len(one), np.int64)
    one, other = np.ascontiguousarray(one), np.ascontiguousarray(other)
    _ENTRY(JOINING.pack(Joining(one, other, np.zeros(size, np.int64), largest)))
    return largest
