"""The base of lazy learners: at each decision they search the memory for the nearest situations."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.action_values import action_values
from teamsight.policies.learner import Learner
from teamsight.policies.memory.nearest import SearchTable, k_nearest, search_table
from teamsight.policies.memory.transitions import MOST

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
        Sweeps of value iteration; see `teamsight.policies.lazy.action_values`.

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

    discount: float = 0.7
    k: int = 10
    sweeps: int = 10
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
