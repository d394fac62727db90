"""Behaviours by an adaptive logic network: trees of logic nodes that have learned to select them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.braitenberg.vehicle import (
    BEHAVIOUR,
    BEHAVIOURS,
    CUES,
    LAST_CUES,
    Vehicle,
    behave,
    cues_of,
    recovers,
)
from teamsight.policies.interface import PolicyState

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


Integers = npt.NDArray[np.int64]

# Counters of nodes stay within these limits, so that a node can change its function later.
_LIMIT = 8
_MOST_DEPTH = 10


def train_trees(
    cues: npt.ArrayLike, options: npt.ArrayLike, *, inputs: int, kinds: int, trees: int = 9, depth: int = 7,
    epochs: int = 60, rng: int = 0,
) -> npt.NDArray[np.float32]:  # fmt: skip
    """Return trees that have learned which option belongs to which cues; `most_votes` reads them.

    Parameters
    ----------
    cues : array_like, shape (examples,), int64
        The cues as bits.
    options : array_like, shape (examples,), int64
        The option that belongs to each, from 0 to kinds − 1.
    inputs : int
        The number of cues, at most 62.
    kinds : int
        The number of options.
    trees : int
        Trees for each option, which vote.
    depth : int
        Levels of nodes; a tree has 2 to the power of `depth` leaves. At most 10.
    epochs : int
        How often each example is presented.
    rng : int
        The seed of the connections and of the order of the examples.

    Returns
    -------
    ndarray, shape (kinds · trees, 2^(depth + 1) − 1), float32

    Raises
    ------
    TypeError, ValueError
        If there are no examples, the two arrays differ in length, or a value is outside its limits.

    Notes
    -----
    Equal examples are presented once in an epoch. Each leaf is connected to a random cue or its complement. A node
    counts, for each of the two cases in which its children differ, what was desired, and does what it counted more
    often. It learns if it is responsible: the root always is; a child if its value decides that of a responsible node,
    or if the tree is wrong and the child is, too.

    *Source:* after W. W. Armstrong and J. Gecsei, "Adaptation algorithms for binary tree networks" (IEEE Transactions
    on Systems, Man, and Cybernetics 9(5), 1979), recalled, not verified. *Departs:* the rule of responsibility, trees
    that vote, and all numbers are ours.
    """
    checks.count("inputs", inputs, most=62)
    checks.count("kinds", kinds)
    checks.count("trees", trees)
    checks.count("depth", depth, most=_MOST_DEPTH)
    checks.count("epochs", epochs)
    bits, wanted = _examples(cues, options, inputs, kinds)
    generator, rows = np.random.default_rng(rng), kinds * trees
    leaves = 2**depth
    literals = generator.integers(1, inputs + 1, (rows, leaves)) * generator.choice([-1, 1], (rows, leaves))
    counters = generator.integers(-1, 1, (rows, leaves - 1, 2))
    # What each tree should say to each example, and the values of its leaves.
    desired = (wanted[:, None] == np.repeat(np.arange(kinds), trees)).astype(np.int64)
    values = (bits[:, None, None] >> (np.abs(literals) - 1)) & 1
    values = np.where(literals > 0, values, 1 - values)
    for _ in range(epochs):
        for example in generator.permutation(len(bits)):
            _learn(counters, values[example], desired[example])
    functions = (counters[:, :, 0] >= 0) + 2 * (counters[:, :, 1] >= 0)
    return np.concatenate([literals, functions], axis=1).astype(np.float32)


def _examples(cues: npt.ArrayLike, options: npt.ArrayLike, inputs: int, kinds: int) -> tuple[Integers, Integers]:
    """Return the different examples, in ascending order."""
    bits, wanted = np.asarray(cues, np.int64), np.asarray(options, np.int64)
    if bits.ndim != 1 or bits.shape != wanted.shape or not len(bits):
        raise ValueError(
            f"cues, options: have the shapes {bits.shape} and {wanted.shape}; give one option for each of at least one "
            "example"
        )
    for name, array, limit in (("cues", bits, 2**inputs), ("options", wanted, kinds)):
        if array.min() < 0 or array.max() >= limit:
            raise ValueError(f"{name}: are from {array.min()} to {array.max()}; they must be from 0 to {limit - 1}")
    found = np.unique(np.stack([bits, wanted]), axis=1)
    return found[0], found[1]


def _learn(counters: Integers, leaves: Integers, desired: Integers) -> None:
    """Present one example to all trees: `counters` change. Arrays have a row for each tree."""
    rows, nodes = counters.shape[:2]
    value = np.empty((rows, 2 * nodes + 1), np.int64)
    value[:, nodes:] = leaves
    first = (nodes + 1) // 2
    while True:
        at = slice(first - 1, 2 * first - 1)
        left, right = value[:, 2 * first - 1 : 4 * first - 1 : 2], value[:, 2 * first : 4 * first - 1 : 2]
        says = np.where(left == 1, counters[:, at, 1], counters[:, at, 0]) >= 0
        value[:, at] = np.where(left == right, left, says)
        if first == 1:
            break
        first //= 2
    wrong = (value[:, 0] != desired)[:, None]
    responsible = np.ones((rows, 1), bool)
    want = (2 * desired - 1)[:, None]
    first = 1
    while first <= nodes:
        at = slice(first - 1, 2 * first - 1)
        left, right = value[:, 2 * first - 1 : 4 * first - 1 : 2], value[:, 2 * first : 4 * first - 1 : 2]
        for case, is_case in ((0, (left == 0) & (right == 1)), (1, (left == 1) & (right == 0))):
            changed = counters[:, at, case] + want * (responsible & is_case)
            counters[:, at, case] = np.clip(changed, -_LIMIT, _LIMIT - 1)
        only_right, only_left = counters[:, at, 0] >= 0, counters[:, at, 1] >= 0
        # The value of a child decides if the node would have another one with the other value of the child.
        left_decides = np.where(right == 1, ~only_right, only_left)
        right_decides = np.where(left == 1, ~only_left, only_right)
        below = np.empty((rows, 2 * responsible.shape[1]), bool)
        below[:, 0::2] = responsible & (left_decides | (wrong & (left != desired[:, None])))
        below[:, 1::2] = responsible & (right_decides | (wrong & (right != desired[:, None])))
        responsible, first = below, 2 * first


_OPTIONS = len(BEHAVIOURS)


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    kept = arrays.state.ints
    for i in range(percept.heading.shape[0]):
        if recovers(i, percept, arrays, noise[0, i], action):
            continue
        kept[i, 0, LAST_CUES] = cues_of(i, percept, arrays.parameters)
        kept[i, 0, BEHAVIOUR] = most_votes(arrays.table, _OPTIONS, kept[i, 0, LAST_CUES], kept[i, 1])
        behave(kept[i, 0, BEHAVIOUR], i, percept, arrays.parameters, noise[0, i], action)


@dataclass(frozen=True, eq=False, repr=False)
class AdaptiveNetwork(Vehicle):
    """The behaviour for which most trees of an adaptive logic network vote.

    Each behaviour has some binary trees, whose leaves are cues or their complements, and whose nodes are AND, OR, LEFT
    or RIGHT.

    Parameters
    ----------
    obstacle_range, slow_range, agility, swerve, recovery, patience, contact
        As for `Vehicle`.
    trees : ndarray, shape (5 · trees of a behaviour, 2 · leaves − 1), float32
        From `AdaptiveNetwork.trained`, or `train_trees`.

    Raises
    ------
    TypeError, ValueError
        If the trees have another shape or other values, or another value is outside its limits.

    Notes
    -----
    *Source:* Kube and Zhang (1994), as Touzet (2000, §9) reports it; the structure of their network is recalled, not
    verified. *Departs:* see `train_trees`.
    """

    trees: npt.NDArray[np.float32] | None = None

    kernel = _decide

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.trees is None:
            raise TypeError("trees=None: must be an array of trees; AdaptiveNetwork.trained makes one")
        object.__setattr__(self, "trees", checked_trees(self.trees))

    @classmethod
    def trained(
        cls, cues: npt.ArrayLike, behaviours: npt.ArrayLike, *, rng: int = 0, trees: int = 9, depth: int = 7,
        **options: Any,
    ) -> AdaptiveNetwork:  # fmt: skip
        """Return a policy that has learned by supervision which behaviour belongs to which cues.

        Parameters
        ----------
        cues : array_like, shape (examples,), int64
            Cues as bits, one for each of `teamsight.policies.braitenberg.vehicle.CUES`.
        behaviours : array_like, shape (examples,), int64
            The behaviour that belongs to each, an index into `teamsight.policies.braitenberg.vehicle.BEHAVIOURS`.
        rng, trees, depth
            As for `train_trees`.
        **options
            The other parameters of the policy.

        Raises
        ------
        TypeError, ValueError
            As for `train_trees` and the policy.
        """
        inputs = len(CUES)
        made = train_trees(cues, behaviours, inputs=inputs, kinds=_OPTIONS, trees=trees, depth=depth, rng=rng)
        return cls(**options, trees=made)

    def select(self, cues: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Return the behaviour for which most trees vote, for each set of cues.

        Parameters
        ----------
        cues : array_like, shape (n,), int64
            Cues as bits.

        Returns
        -------
        ndarray, shape (n,), int64
            Indices into `teamsight.policies.braitenberg.vehicle.BEHAVIOURS`.
        """
        bits, rows = np.atleast_1d(np.asarray(cues, np.int64)), self.table.astype(np.int64)
        leaves = (rows.shape[1] + 1) // 2
        literals, functions = rows[:, :leaves], rows[:, leaves:]
        value = (bits[:, None, None] >> (np.abs(literals) - 1)) & 1
        value = np.where(literals > 0, value, 1 - value)
        for first in (leaves >> level for level in range(1, leaves.bit_length())):
            left, right = value[..., 0::2], value[..., 1::2]
            value = np.where(left == right, left, (functions[:, first - 1 : 2 * first - 1] >> left) & 1)
        votes = value[..., 0].reshape(len(bits), _OPTIONS, -1).sum(axis=2)
        return np.asarray(votes.argmax(axis=1), np.int64)

    def __repr__(self) -> str:
        shown = ", ".join(repr(float(value)) for value in self.parameters)
        digest = hashlib.blake2b(self.table.tobytes(), digest_size=4).hexdigest()
        return f"AdaptiveNetwork({shown}, trees=<{digest}>)"

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return np.asarray(self.trees, np.float32)

    def start(self, size: int) -> PolicyState:
        """Return the state of robots that do not recover: as for others, and room for a tree."""
        first, width = super().start(size), self.table.shape[1]
        ints = np.zeros((size, 2, max(width, first.ints.shape[2])), np.int64)
        return first._replace(ints=ints, floats=np.zeros((size, 2, first.floats.shape[2])))


def checked_trees(trees: Any) -> npt.NDArray[np.float32]:
    """Return trees as an array that is not written to, after a check of its shape and its values.

    Raises
    ------
    TypeError, ValueError
        If they are no trees of this network.
    """
    try:
        found = np.array(trees, np.float32)
    except (TypeError, ValueError):
        raise TypeError(f"trees={checks.shown(trees)}: must be an array of numbers") from None
    width = found.shape[1] if found.ndim == 2 else 0
    leaves = (width + 1) // 2
    if width < 3 or width != 2 * leaves - 1 or leaves & (leaves - 1) or not len(found) or len(found) % _OPTIONS:
        raise ValueError(
            f"trees: have the shape {found.shape}; it must be ({_OPTIONS} behaviours · trees, 2 · leaves − 1), and the "
            "number of leaves a power of 2"
        )
    literals, functions = found[:, :leaves], found[:, leaves:]
    cues = len(CUES)
    are_literals = np.isin(np.abs(literals), np.arange(1, cues + 1)).all()
    if not are_literals or not np.isin(functions, range(4)).all():
        raise ValueError(
            f"trees: leaves must be whole numbers from 1 to {cues}, or their negatives, and nodes from 0 to 3; make "
            "them with AdaptiveNetwork.trained"
        )
    found.flags.writeable = False
    return found
