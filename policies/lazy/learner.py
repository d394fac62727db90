"""What all learners have in common that read their behaviour from a lazy memory."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from hashlib import blake2b
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.angles import direction
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Floats, Percept
from teamsight.policies.lazy.action_values import components, degree_of, remedy, utility
from teamsight.policies.memory import LazyMemory
from teamsight.policies.memory.nearest import SearchTable, k_nearest, search_table
from teamsight.policies.memory.transitions import MOST
from teamsight.policies.rewards import Reward, name_of, own_reward

_PER_TURN = 0.15915494309189535

# A lazy learner's parameters begin with k, the margin of the search, and the k columns nearest to only ones.
K, _MARGIN, _NEAREST_TO_ONES = range(3)


@inlined
def first_own(parameters: Any) -> int:
    """Return where the parameters of a kind of learner begin."""
    return _NEAREST_TO_ONES + int(parameters[K])


@inlined
def find_matches(situation: Any, arrays: Any, k: int, index: Any, distance: Any) -> bool:
    """Write the `k` nearest columns to `index`; return whether the situation holds only numbers within their limits."""
    inputs = arrays.table.shape[0] - 1
    is_good = True
    is_empty = True
    for component in range(inputs):
        # NaN is on neither side of anything.
        is_good &= abs(situation[component]) <= MOST
        is_empty &= situation[component] == 1.0
    if is_empty:
        # By far the most frequent situation; its matches are found once, when the policy is made.
        for match in range(k):
            index[match] = int(arrays.parameters[_NEAREST_TO_ONES + match])
    elif is_good:
        k_nearest(arrays.table, arrays.parameters[_MARGIN], situation, k, index, distance)
    return is_good


@inlined
def is_situation(situation: Any, inputs: int) -> bool:
    """Return whether all readings are numbers, and none beyond what distances can hold."""
    for component in range(inputs):  # noqa: SIM110 (kernels have no generators)
        # NaN is on neither side of anything.
        if not abs(situation[component]) <= MOST:
            return False
    return True


@inlined
def refuse(i: int, percept: Any, action: Any) -> None:
    """Give robot `i` an action that no world takes: whoever runs the kernel then says so."""
    action.heading[i, 0] = percept.heading[i, 0]
    action.heading[i, 1] = percept.heading[i, 1]
    action.distance[i] = np.nan


@inlined
def act(rotation: float, share: float, i: int, percept: Any, action: Any) -> None:
    """Write the action of robot `i` that turns by `rotation` [rad] and goes a share of its speed."""
    fraction = rotation * _PER_TURN
    cosine, sine = direction(fraction if fraction >= 0.0 else fraction + 1.0)
    x = percept.heading[i, 0]
    y = percept.heading[i, 1]
    x, y = cosine * x - sine * y, sine * x + cosine * y
    # A turn of a turn of a turn: rounding must not add up to a heading that is no unit vector.
    length = 1.5 - 0.5 * (x * x + y * y)
    action.heading[i, 0] = x * length
    action.heading[i, 1] = y * length
    action.distance[i] = share * percept.speed[i]


@dataclass(frozen=True, eq=False, repr=False)
class LazyLearner(CompiledPolicy):
    """A policy that looks up what to do among the pairs of a lazy memory.

    Parameters
    ----------
    memory : LazyMemory
        What was explored.
    reward : callable
        What is wanted; see `teamsight.policies.rewards`.
    inputs : int, optional
        How many components of a situation are compared: the robot's own (collective, under `NoAwareness`), or all of
        them (cooperative, under the degree of awareness of the exploration), which is the default.
    k : int
        How many pairs match a situation: 1 to 128, and no more than there are.
    discount : float
        Discount factor γ, in [0, 1].
    sweeps : int
        How many steps ahead a utility looks; see `teamsight.policies.lazy.action_values.utility`.

    Attributes
    ----------
    values : ndarray, shape (pairs,), float64
        The utility of each pair.

    Raises
    ------
    TypeError, ValueError
        If the memory is empty or smaller than `k`, a constant is outside its limits, or the reward function returns
        something else than a finite number for each pair.
    """

    memory: LazyMemory
    reward: Reward = own_reward
    inputs: int = None  # type: ignore[assignment]  # None means all; a number from here on
    k: int = 10
    discount: float = 0.7
    sweeps: int = 10
    values: Floats = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", components(self.memory, self.inputs))
        values = utility(
            self.memory, self.reward, inputs=self.inputs, k=self.k, discount=self.discount, sweeps=self.sweeps
        )
        object.__setattr__(self, "values", values)

    def __repr__(self) -> str:
        # Two reward functions may share a name, so that the utilities have to tell equal policies from others.
        told = ", ".join(f"{name}={value!r}" for name, value in self._constants().items())
        utilities = digest_of(self.values)
        return f"{type(self).__name__}({self.memory!r}, {name_of(self.reward)}, {told}, utility={utilities})"

    def _constants(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("inputs", "k", "discount", "sweeps")}

    @property
    def degree(self) -> str | None:  # type: ignore[override]
        """The name of the degree of awareness whose situations it knows; None if the memory does not tell."""
        return degree_of(self.memory, self.inputs)

    @property
    def effort(self) -> int:  # type: ignore[override]
        """How many numbers a decision of one robot compares."""
        return len(self.memory) * self.inputs

    @cached_property
    def search_table(self) -> SearchTable:
        """The table that the kernel searches: the compared part of the situations of the memory."""
        return search_table(self.memory.table, self.memory.inputs if self.inputs is None else self.inputs, self.k)

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.search_table.table

    @property
    def parameters(self) -> Floats:
        search = self.search_table
        return np.concatenate([[self.k, search.margin], search.nearest_to_ones])

    def remedy(self, degree: str, width: int) -> str:
        return remedy(self.memory, self.inputs, degree, width)

    def check_percept(self, percept: Percept) -> None:
        check_situation(type(self).__name__, percept, self.inputs)


def digest_of(numbers: npt.NDArray[np.floating[Any]]) -> str:
    """Return a few digits that tell these numbers from others."""
    return blake2b(numbers.tobytes(), digest_size=4).hexdigest()


def check_situation(name: str, percept: Percept, inputs: int | None) -> None:
    """Refuse situations that a learner's kernel would read beyond their end, and such that are no numbers.

    Raises
    ------
    ValueError
        Naming the learner, the width or the robot.
    """
    if percept.situation.shape[1] != inputs:
        raise ValueError(
            f"{name}: the percept's situations have {percept.situation.shape[1]} components; it compares {inputs}"
        )
    # Asked this way round, because NaN is on neither side of anything.
    wrong = np.flatnonzero(~(np.abs(percept.situation) <= MOST).all(axis=1))
    if len(wrong):
        raise ValueError(
            f"{name}: the situation of robot {wrong[0]} holds NaN or more than {MOST:g}; give 1 where nothing is sensed"
        )
