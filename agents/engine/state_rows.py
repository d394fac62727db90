"""Rows of a policy's state: one for each robot, in arrays nested in tuples, lists and dicts."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


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
