"""The utility of the pairs of a lazy memory: what each is worth in the long run, for one reward function."""

from __future__ import annotations

from collections.abc import Callable
from weakref import WeakKeyDictionary

import numpy as np

from teamsight.core import checks
from teamsight.policies.interface import Floats, Integers
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import Reward, rewards_of

#: The largest k: kernels keep the matches of a situation on the stack.
MOST_MATCHES = 128

_BLOCK = 4096
# By memory and number of components; rewards and constants differ, but the places that pairs lead to do not.
_MATCHES: WeakKeyDictionary[LazyMemory, dict[int, Integers]] = WeakKeyDictionary()


def utility(
    memory: LazyMemory,
    reward: Reward,
    *,
    inputs: int | None = None,
    k: int = 10,
    discount: float = 0.7,
    sweeps: int = 10,
) -> Floats:
    """Return Q of every pair: its reward, and what the best of the pairs is worth that match where it leads.

    ``Q_i ← r_i + γ · max Q_j`` over the `k` pairs j whose situations are nearest to the next situation of i; all pairs
    at once, `sweeps` times, from Q = r. With γ = 0 or no sweeps nothing has to be searched.

    Parameters
    ----------
    memory : LazyMemory
        The pairs; nothing is stored in it.
    reward : callable
        See `teamsight.policies.rewards`.
    inputs : int, optional
        How many components of the situations are compared: all, or the robot's own alone.
    k : int
        How many pairs match a situation: 1 to 128, and no more than there are.
    discount : float
        Discount factor γ, in [0, 1].
    sweeps : int
        How many steps ahead are looked.

    Returns
    -------
    ndarray, shape (pairs,), float64

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, the memory has fewer than `k` pairs, or the reward function returns
        something else than a finite number for each pair.

    Notes
    -----
    *Source:* §8.1. *Departs:* the paper computes a Q when somebody asks for it; all of them at once, when the reward is
    known, are the same numbers. The search is the cost: pairs² × inputs subtractions; see `next_matches`.
    """
    width = components(memory, inputs)
    check_constants(memory, k, discount, sweeps)
    own = rewards_of(memory, reward)
    if discount == 0 or sweeps == 0:
        return own
    follow = next_matches(memory, k, width)
    values = own.copy()
    for _ in range(sweeps):
        values = own + discount * values[follow].max(axis=1)
    return values


def next_matches(
    memory: LazyMemory,
    k: int,
    inputs: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Integers:
    """Return which pairs match the situation that each pair leads to; they are kept as long as the memory is.

    Learners call this when they are made. For a large memory call it yourself before, with a progress bar: it takes
    pairs² × inputs subtractions, which is a second for some 30 000 pairs of 32 inputs and twenty minutes for a
    million. Less is `LazyMemory.sample`, or γ = 0.

    Parameters
    ----------
    memory : LazyMemory
        The pairs.
    k : int
        How many match.
    inputs : int, optional
        How many components are compared.
    progress : callable
        Called with the pairs done and the pairs in all.

    Returns
    -------
    ndarray, shape (pairs, k), int64
        In the order of nearness.
    """
    width = components(memory, inputs)
    kept = _MATCHES.setdefault(memory, {})
    if width not in kept or kept[width].shape[1] < k:
        found = np.empty((len(memory), k), np.int64)
        for first in range(0, len(memory), _BLOCK):
            asked = np.ascontiguousarray(memory.next_situation[first : first + _BLOCK, :width])
            found[first : first + _BLOCK] = memory.nearest(asked, k, width)[0]
            progress(min(first + _BLOCK, len(memory)), len(memory))
        kept[width] = found
    return kept[width][:, :k]


def components(memory: LazyMemory, inputs: int | None) -> int:
    """Return how many components of the memory's situations are compared.

    Raises
    ------
    TypeError, ValueError
        If `inputs` is neither all of them nor the robot's own.
    """
    if not isinstance(memory, LazyMemory):
        raise TypeError(f"memory={memory!r}: must be a LazyMemory; load one with LazyMemory.load(path)")
    if inputs is None:
        return memory.inputs
    width = checks.count("inputs", inputs)
    if width not in (memory.own, memory.inputs):
        raise ValueError(
            f"inputs={width}: the memory has {memory.own} components for targets and {memory.added} for teammates; "
            f"compare {memory.own} (collective) or all {memory.inputs} (cooperative)"
        )
    return width


def degree_of(memory: LazyMemory, inputs: int | None) -> str | None:
    """Return the name of the degree of awareness that shows a memory's situations; None if the memory does not tell."""
    if inputs == memory.own:
        return "none"
    found: str | None = memory.settings.get("degree")
    return found


def remedy(memory: LazyMemory, inputs: int, degree: str, width: int) -> str:
    """Return how a learner of this memory fits situations of a degree and width: by all inputs, or not at all."""
    fits = memory.inputs == width != inputs and memory.settings.get("degree", degree) == degree
    return f", or leave out inputs={inputs}" if fits else ""


def check_constants(memory: LazyMemory, k: int, discount: float, sweeps: int) -> None:
    """Refuse constants outside their limits, and a memory that is smaller than `k`.

    Raises
    ------
    TypeError, ValueError
        Naming the value, the limit and the cure.
    """
    checks.count("k", k)
    if k > MOST_MATCHES:
        raise ValueError(
            f"k={k}: must be at most {MOST_MATCHES}, for which a robot that decides has room, and at most the "
            f"{len(memory)} pairs of the memory; use a smaller k"
        )
    checks.number("discount", discount, least=0, most=1)
    checks.count("sweeps", sweeps, least=0)
    if len(memory) < k:
        cure = "explore first" if len(memory) == 0 else "use a smaller k, or explore longer"
        raise ValueError(f"k={k}: the memory has only {len(memory)} pairs; {cure}")
