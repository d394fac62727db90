"""Behaviours by an adaptive logic network: trees of logic nodes that have learned to select them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.braitenberg import cues as all_cues
from teamsight.policies.braitenberg.behaviours import BEHAVIOURS, behave
from teamsight.policies.braitenberg.cues import cues_of
from teamsight.policies.braitenberg.logic_training import train_trees
from teamsight.policies.braitenberg.logic_trees import most_votes
from teamsight.policies.braitenberg.recovery import BEHAVIOUR, CUES, recovers
from teamsight.policies.braitenberg.vehicle import Vehicle
from teamsight.policies.interface import PolicyState

_OPTIONS = len(BEHAVIOURS)


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    kept = arrays.state.ints
    for i in range(percept.heading.shape[0]):
        if recovers(i, percept, arrays, noise[0, i], action):
            continue
        kept[i, 0, CUES] = cues_of(i, percept, arrays.parameters)
        kept[i, 0, BEHAVIOUR] = most_votes(arrays.table, _OPTIONS, kept[i, 0, CUES], kept[i, 1])
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
        From `AdaptiveNetwork.trained`, or `logic_training.train_trees`.

    Raises
    ------
    TypeError, ValueError
        If the trees have another shape or other values, or another value is outside its limits.

    Notes
    -----
    *Source:* Kube and Zhang (1994), as Touzet (2000, §9) reports it; the structure of their network is recalled, not
    verified. *Departs:* see `logic_training.train_trees`.
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
            Cues as bits, one for each of `teamsight.policies.braitenberg.cues.CUES`.
        behaviours : array_like, shape (examples,), int64
            The behaviour that belongs to each, an index into `behaviours.BEHAVIOURS`.
        rng, trees, depth
            As for `logic_training.train_trees`.
        **options
            The other parameters of the policy.

        Raises
        ------
        TypeError, ValueError
            As for `logic_training.train_trees` and the policy.
        """
        inputs = len(all_cues.CUES)
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
            Indices into `behaviours.BEHAVIOURS`.
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
    cues = len(all_cues.CUES)
    are_literals = np.isin(np.abs(literals), np.arange(1, cues + 1)).all()
    if not are_literals or not np.isin(functions, range(4)).all():
        raise ValueError(
            f"trees: leaves must be whole numbers from 1 to {cues}, or their negatives, and nodes from 0 to 3; make "
            "them with AdaptiveNetwork.trained"
        )
    found.flags.writeable = False
    return found
