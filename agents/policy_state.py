"""The state of a policy: before its first decision, with rows taken out and put in, and for agents that join."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.policies.compiled import CompiledPolicy, check_state
from teamsight.policies.interface import Policy, PolicyState
from teamsight.policies.registry import label


class IN_TABLE:  # noqa: N801 (a mark, which pickles as itself)
    """In place of the state of a policy that is in the table of its group: one that is a `PolicyState`."""


@cache
def columns_of_state(index: int) -> tuple[str, str]:
    """Return the columns that hold the floats and the ints of the state of a policy, by its index in its group."""
    return f"floats of policy {index}", f"ints of policy {index}"


def has_rows(state: Any, size: int) -> bool:
    """Whether a state is two arrays with a row for each of `size` robots, which a table can hold."""
    return isinstance(state, PolicyState) and all(
        isinstance(array, np.ndarray) and array.ndim == 3 and len(array) == size and array.dtype == dtype
        for array, dtype in zip(state, (np.float64, np.int64), strict=True)
    )


def take_rows(state: Any, rows: npt.NDArray[Any], size: int) -> Any:
    """Return the state of some of the `size` robots; what is not an array with a row for each is returned unchanged."""
    if isinstance(state, np.ndarray):
        return np.ascontiguousarray(state[rows]) if state.shape[:1] == (size,) else state
    if isinstance(state, dict):
        return {name: take_rows(part, rows, size) for name, part in state.items()}
    if isinstance(state, (tuple, list)):
        return _rebuilt(state, [take_rows(part, rows, size) for part in state])
    return state


def put_rows(state: Any, rows: npt.NDArray[Any], part: Any, size: int) -> Any:
    """Return a copy of the state with the rows of some robots replaced by `part`, which is as from `take_rows`.

    Values without rows are replaced for all robots.
    """
    if isinstance(state, np.ndarray) and state.shape[:1] == (size,):
        changed = state.copy()
        changed[rows] = part
        return changed
    if isinstance(state, dict) and isinstance(part, dict) and state.keys() == part.keys():
        return {name: put_rows(state[name], rows, part[name], size) for name in state}
    if isinstance(state, (tuple, list)) and type(state) is type(part) and len(state) == len(part):
        pairs = zip(state, part, strict=True)
        return _rebuilt(state, [put_rows(before, rows, after, size) for before, after in pairs])
    return part


def with_more_rows(state: Any, fresh: Any, size: int, total: int, name: str) -> Any:
    """Return the state of `size` robots with the rows of more, from the `fresh` state of `total` robots.

    Values without rows stay. `name` says in errors where the fresh state comes from.

    Raises
    ------
    TypeError
        If the fresh state is arranged in another way.
    """
    if isinstance(state, np.ndarray) and isinstance(fresh, np.ndarray) and state.shape[1:] == fresh.shape[1:]:
        if state.shape[:1] == (size,) and fresh.shape[:1] == (total,):
            return np.concatenate([state, fresh[size:].astype(state.dtype)])
        if state.shape == fresh.shape:
            return state
    elif isinstance(state, dict) and isinstance(fresh, dict) and state.keys() == fresh.keys():
        return {key: with_more_rows(state[key], fresh[key], size, total, name) for key in state}
    elif isinstance(state, (tuple, list)) and type(state) is type(fresh) and len(state) == len(fresh):
        pairs = zip(state, fresh, strict=True)
        return _rebuilt(state, [with_more_rows(before, new, size, total, name) for before, new in pairs])
    elif not isinstance(state, (np.ndarray, dict, tuple, list)):
        return state
    raise TypeError(
        f"{name} returns {layout(fresh)}, and the state of {size} is {layout(state)}; return arrays with a row for "
        "each robot from start, so that robots can join"
    )


def layout(state: Any) -> str:
    """Return a description of the types and shapes in a state; a policy can continue only from a state with its own."""
    if isinstance(state, np.ndarray):
        return f"{state.dtype}{list(state.shape)}"
    if isinstance(state, dict):
        return "{" + ", ".join(f"{name}: {layout(part)}" for name, part in state.items()) + "}"
    if isinstance(state, (tuple, list)) and any(isinstance(part, (np.ndarray, dict, tuple, list)) for part in state):
        return f"{type(state).__name__}({', '.join(layout(part) for part in state)})"
    return type(state).__name__


def _rebuilt(state: Any, parts: list[Any]) -> Any:
    return type(state)(*parts) if hasattr(state, "_fields") else type(state)(parts)


Integers = npt.NDArray[np.int64]


def first_state(policy: Any, size: int) -> Any:
    """Return the state of a policy for `size` agents before their first decision.

    Raises
    ------
    TypeError, ValueError
        If the policy has a kernel that cannot read the state.
    """
    state = policy.start(size) if isinstance(policy, Policy) else None
    if isinstance(policy, CompiledPolicy):
        check_state(policy, state, size)
    return state


def first_state_of_members(policy: Any, members: Integers, members_so_far: int) -> Any:
    """Return the state before their first decision of those that are in a group, of all that have been.

    A policy may have a state for each: with tables per robot, those that stay keep their own.

    Raises
    ------
    TypeError, ValueError
        As `first_state`.
    """
    if len(members) == members_so_far:
        return first_state(policy, members_so_far)
    state = take_rows(first_state(policy, members_so_far), members, members_so_far)
    if isinstance(policy, CompiledPolicy):
        check_state(policy, state, len(members))
    return state


def state_of_more(policy: Any, state: Any, present: Integers, new: Integers, *, is_in_table: bool) -> Any:
    """Return the state of the robots that are `present` with first states for `new` ones, all given by member.

    Of a state that a table holds, only that of the new ones.

    Raises
    ------
    TypeError, ValueError
        If the policy's ``start`` returns none that fit.
    """
    so_far, size = int(new[-1]) + 1, len(present)
    total = size + len(new)
    if is_in_table or has_rows(state, size):
        fresh = first_state(policy, so_far)
        if has_rows(fresh, so_far) and all(a.shape[1:] == b.shape[1:] for a, b in zip(fresh, state, strict=True)):
            return PolicyState(*(array[so_far - len(new) :] for array in fresh))
    else:
        fresh = first_state_of_members(policy, np.append(present, new), so_far)
    return with_more_rows(state, fresh, size, total, f"policy={label(policy)}: start({so_far})")
