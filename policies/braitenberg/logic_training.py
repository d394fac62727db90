"""Supervised training of binary logic trees on examples of cues and options."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.core import checks

Integers = npt.NDArray[np.int64]

# Counters of nodes stay within these limits, so that a node can change its function later.
_LIMIT = 8
_MOST_DEPTH = 10


def train_trees(
    cues: npt.ArrayLike, options: npt.ArrayLike, *, inputs: int, kinds: int, trees: int = 9, depth: int = 7,
    epochs: int = 60, rng: int = 0,
) -> npt.NDArray[np.float32]:  # fmt: skip
    """Return trees that have learned which option belongs to which cues; `logic_trees.most_votes` reads them.

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
