"""The base of lazy learners: at each decision they search the memory for the nearest situations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, Index, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.interface import Floats, Integers
from teamsight.policies.learner import Learner, components
from teamsight.policies.memory import LazyMemory
from teamsight.policies.memory.nearest import SearchTable, k_nearest, search_table
from teamsight.policies.memory.transitions import MOST
from teamsight.policies.rewards import Reward, rewards_of

#: The largest k: kernels keep the matches of a situation on the stack.
MOST_MATCHES = 128
#: What k may be.
Matches = Annotated[int, Allowed(least=1, most=MOST_MATCHES, cure="use a smaller k, up to the size of the memory")]

_BLOCK = 4096
# By memory and number of components. They do not depend on reward, discount or sweeps.
_MATCHES: WeakKeyDictionary[LazyMemory, dict[int, Integers]] = WeakKeyDictionary()


def action_values(
    memory: LazyMemory,
    reward: Reward,
    *,
    inputs: int | None = None,
    k: int = 10,
    discount: float = 0.7,
    sweeps: int = 10,
) -> Floats:
    """Return the action value of each transition: its reward plus the discounted best value that can follow.

    Value iteration: starting with Q = r, ``Q_i ← r_i + γ · max Q_j`` is repeated `sweeps` times for all transitions i
    at once, where j runs over the `k` transitions whose situations are nearest to the next situation of i.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    reward : callable
        See `teamsight.policies.rewards`.
    inputs : int, optional
        Number of components that are compared; all by default.
    k : int
        Number of transitions that match a situation: 1 to 128, and at most the size of the memory.
    discount : float
        Discount factor γ, in [0, 1].
    sweeps : int
        Number of sweeps; values include the rewards of that many further steps.

    Returns
    -------
    ndarray, shape (transitions,), float64

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, the memory has fewer than `k` transitions, or the reward does not return a
        finite number for each transition.

    Notes
    -----
    *Source:* §8.1. *Departs:* the paper computes a Q on demand; computing all at once gives the same numbers. Most time
    is spent in the search for matches, see `next_matches`; with γ = 0 or no sweeps it is skipped.
    """
    width = components(memory, inputs)
    check_constants(memory, k, discount, sweeps)
    rewards = rewards_of(memory, reward)
    if discount == 0 or sweeps == 0:
        return rewards
    follow = next_matches(memory, k, width)
    values = rewards.copy()
    for _ in range(sweeps):
        values = rewards + discount * values[follow].max(axis=1)
    return values


def next_matches(
    memory: LazyMemory,
    k: int,
    inputs: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Integers:
    """Return the `k` transitions that match the next situation of each transition; cached as long as the memory lives.

    The search takes transitions² × inputs subtractions: about a second for 30,000 transitions of 32 inputs, twenty
    minutes for a million. Call it before making a learner to show its progress. `LazyMemory.sample` or a discount of 0
    reduce the work.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    k : int
        Number of matches.
    inputs : int, optional
        Number of components that are compared; all by default.
    progress : callable
        Called with the numbers of transitions done and in all.

    Returns
    -------
    ndarray, shape (transitions, k), int64
        The nearest first.
    """
    width = components(memory, inputs)
    kept = _MATCHES.setdefault(memory, {})
    if width not in kept or kept[width].shape[1] < k:
        found = np.empty((len(memory), k), np.int64)
        for first in range(0, len(memory), _BLOCK):
            queries = np.ascontiguousarray(memory.next_situation[first : first + _BLOCK, :width])
            found[first : first + _BLOCK] = memory.nearest(queries, k, width)[0]
            progress(min(first + _BLOCK, len(memory)), len(memory))
        kept[width] = found
    return kept[width][:, :k]


def check_constants(memory: LazyMemory, k: int, discount: float, sweeps: int) -> None:
    """Raise an error for constants outside their limits, and for a memory that has fewer than `k` transitions."""
    checks.count("k", k)
    if k > MOST_MATCHES:
        raise ValueError(
            f"k={k}: must be at most {MOST_MATCHES}, and at most the {len(memory)} transitions of the memory; use a "
            "smaller k"
        )
    checks.number("discount", discount, least=0, most=1)
    checks.count("sweeps", sweeps, least=0)
    if len(memory) < k:
        raise ValueError(f"k={k}: the memory has only {len(memory)} transitions; use a smaller k, or explore longer")


# The parameters of a lazy learner begin with k, the margin of the search, and the k columns nearest to all ones.
K, _MARGIN, _NEAREST_TO_ONES = range(3)


@inlined
def first_own(parameters: Any) -> int:
    """Return where the parameters of the subclass begin."""
    return _NEAREST_TO_ONES + int(parameters[K])


@inlined
def find_matches(situation: Any, arrays: Any, k: int, index: Any, distance: Any) -> bool:
    """Write the `k` nearest columns to `index`; return whether all readings are within the limits of a memory."""
    inputs = arrays.table.shape[0] - 1
    is_good = True
    is_empty = True
    for component in range(inputs):
        # Written so that NaN fails too.
        is_good &= abs(situation[component]) <= MOST
        is_empty &= situation[component] == 1.0
    if is_empty:
        # By far the most frequent situation; its matches are precomputed.
        for match in range(k):
            index[match] = int(arrays.parameters[_NEAREST_TO_ONES + match])
    elif is_good:
        k_nearest(arrays.table, arrays.parameters[_MARGIN], situation, k, index, distance)
    return is_good


@dataclass(frozen=True, eq=False, repr=False)
class LazyLearner(Learner):
    """A learner that chooses among the actions of the `k` transitions nearest to the present situation.

    Parameters
    ----------
    memory, reward, inputs
        As for `Learner`.
    discount : float, default 0.7
        Discount factor γ, in [0, 1].
    k : int
        Number of transitions that match a situation: 1 to 128, and at most the size of the memory.
    sweeps : int
        Sweeps of value iteration; see `teamsight.policies.lazy.learner`.

    Attributes
    ----------
    values : ndarray, shape (transitions,), float64
        The action value of each transition.

    Raises
    ------
    TypeError, ValueError
        If the memory has fewer than `k` transitions, a constant is outside its limits, or the reward does not return a
        finite number for each transition.
    """

    discount: Probability = 0.7
    k: Matches = 10
    sweeps: Index = 10
    values: Floats = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        values = action_values(
            self.memory, self.reward, inputs=self.inputs, k=self.k, discount=self.discount, sweeps=self.sweeps
        )
        object.__setattr__(self, "values", values)

    @property
    def learned(self) -> Floats:
        return self.values

    @property
    def effort(self) -> int:  # type: ignore[override]
        """Numbers that a decision of one robot compares."""
        return len(self.memory) * self.inputs

    @cached_property
    def search_table(self) -> SearchTable:
        """The compared components of the memory's situations, as the kernel searches them."""
        return search_table(self.memory.table, self.inputs, self.k)

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.search_table.table

    @property
    def parameters(self) -> Floats:
        search = self.search_table
        return np.concatenate([[self.k, search.margin], search.nearest_to_ones])
