"""Binary trees of AND, OR, LEFT and RIGHT nodes over cues and their complements: their values, and their votes."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined

#: The functions of a node. RIGHT and LEFT are the value of one child; bit 0 is the value where only the right child is
#: true, bit 1 that where only the left one is.
AND, RIGHT, LEFT, OR = range(4)


@inlined
def leaf_value(literal: float, cues: int) -> int:
    """Return the value of a leaf: that of cue c for the literal c + 1, and its complement for −(c + 1)."""
    if literal > 0.0:
        return (cues >> (int(literal) - 1)) & 1
    return 1 - ((cues >> (int(-literal) - 1)) & 1)


@inlined
def node_value(function: float, left: int, right: int) -> int:
    """Return the value of a node: where its children agree, theirs; otherwise what its function says."""
    if left == right:
        return left
    return (int(function) >> left) & 1


@inlined
def tree_value(row: Any, leaves: int, cues: int, values: Any) -> int:
    """Return the value of a tree: its leaves, then its nodes, from the last to the root.

    Parameters
    ----------
    row : ndarray, shape (2 · leaves − 1,), float32
        The literals of the leaves, then the functions of the nodes; the children of node k are 2 k + 1 and 2 k + 2, and
        the leaves follow the nodes.
    leaves : int
        A power of 2.
    cues : int
        The bits.
    values : ndarray, shape (2 · leaves − 1,), int64
        Room for the values of nodes and leaves.
    """
    for k in range(leaves):
        values[leaves - 1 + k] = leaf_value(row[k], cues)
    for k in range(leaves - 2, -1, -1):
        values[k] = node_value(row[leaves + k], values[2 * k + 1], values[2 * k + 2])
    return values[0]  # type: ignore[no-any-return]


@inlined
def most_votes(table: Any, options: int, cues: int, values: Any) -> int:
    """Return the option for which most of its trees vote, the first of several.

    Parameters
    ----------
    table : ndarray, shape (options · trees, 2 · leaves − 1), float32
        A row for each tree, those of an option one after the other.
    options : int
        The number of options.
    cues, values
        As for `tree_value`.
    """
    leaves = (table.shape[1] + 1) // 2
    trees = table.shape[0] // options
    most = -1
    best = 0
    for option in range(options):
        votes = 0
        for tree in range(trees):
            votes += tree_value(table[option * trees + tree], leaves, cues, values)
        if votes > most:
            most = votes
            best = option
    return best
