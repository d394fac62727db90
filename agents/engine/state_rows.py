"""Rows of a policy's memory: one for each robot, however the policy has put its arrays together."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def take_rows(memory: Any, rows: npt.NDArray[Any], size: int) -> Any:
    """Return the memory of some of the robots.

    Parameters
    ----------
    memory : object
        Arrays with a row for each robot, alone or in tuples, lists and dicts; all else is returned as it is.
    rows : ndarray of int or bool
        Which robots.
    size : int
        How many robots the memory is of.
    """
    if isinstance(memory, np.ndarray):
        return np.ascontiguousarray(memory[rows]) if memory.shape[:1] == (size,) else memory
    if isinstance(memory, dict):
        return {name: take_rows(part, rows, size) for name, part in memory.items()}
    if isinstance(memory, (tuple, list)):
        return _rebuilt(memory, [take_rows(part, rows, size) for part in memory])
    return memory


def put_rows(memory: Any, rows: npt.NDArray[Any], part: Any, size: int) -> Any:
    """Return the memory with the rows of some robots replaced; the memory given stays as it is.

    Parameters
    ----------
    memory : object
        As for `take_rows`.
    rows : ndarray of int or bool
        Which robots.
    part : object
        Their memory, as `take_rows` returns it. What has no row for each robot replaces that of all.
    size : int
        How many robots `memory` is of.
    """
    if isinstance(memory, np.ndarray) and memory.shape[:1] == (size,):
        changed = memory.copy()
        changed[rows] = part
        return changed
    if isinstance(memory, dict) and isinstance(part, dict) and memory.keys() == part.keys():
        return {name: put_rows(memory[name], rows, part[name], size) for name in memory}
    if isinstance(memory, (tuple, list)) and type(memory) is type(part) and len(memory) == len(part):
        pairs = zip(memory, part, strict=True)
        return _rebuilt(memory, [put_rows(before, rows, after, size) for before, after in pairs])
    return part


def layout(memory: Any) -> str:
    """Return what kind of arrays a memory is made of; a policy that remembers otherwise could not go on from it."""
    if isinstance(memory, np.ndarray):
        return f"{memory.dtype}{list(memory.shape)}"
    if isinstance(memory, dict):
        return "{" + ", ".join(f"{name}: {layout(part)}" for name, part in memory.items()) + "}"
    if isinstance(memory, (tuple, list)) and any(isinstance(part, (np.ndarray, dict, tuple, list)) for part in memory):
        return f"{type(memory).__name__}({', '.join(layout(part) for part in memory)})"
    return type(memory).__name__


def _rebuilt(memory: Any, parts: list[Any]) -> Any:
    return type(memory)(*parts) if hasattr(memory, "_fields") else type(memory)(parts)
