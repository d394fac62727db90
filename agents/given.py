"""Types of what users give: policies and degrees of awareness as objects or by name, and other names.

The names are for completion in editors; a test compares them with the registries. Any other name of a policy or a
degree of awareness is a ``str``, so that it may come from a variable; a wrong one raises an error at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Awareness
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import Rule

PolicyName: TypeAlias = Literal[
    "a-cmommt", "b-cmommt", "centroid", "evasive", "evolved", "lattice-walk", "lazy-collective", "lazy-cooperative",
    "p-cmommt", "random-walk", "stationary",
]
AwarenessName: TypeAlias = Literal["none", "ring", "nearest", "pairwise", "shared"]
PlacementName: TypeAlias = Literal["uniform", "spread", "cells"]
RangeShape: TypeAlias = Literal["disc", "square"]
PresetName: TypeAlias = Literal["touzet2000"]

PolicyLike: TypeAlias = Policy | Rule | PolicyName | str
AwarenessLike: TypeAlias = Awareness | AwarenessName | str


class Arrayed(Protocol):
    """An array, or what NumPy turns into one: a `Column`, or a column of a table."""

    def __array__(self) -> npt.NDArray[Any]:
        """Return the array."""
        ...


# As npt.ArrayLike, but without strings, so that type checkers refuse those.
Numbers: TypeAlias = float | Sequence[float] | Sequence[Arrayed] | Arrayed
Points: TypeAlias = Sequence[float] | Sequence[Sequence[float]] | Sequence[Arrayed] | Arrayed
Rows: TypeAlias = Sequence[int] | Arrayed

# What `numpy.random.default_rng` takes, as SPEC 7 of Scientific Python wants it of every `rng`.
SeedLike: TypeAlias = (
    int | Sequence[int] | npt.NDArray[np.integer[Any]] | np.random.SeedSequence | np.random.BitGenerator
    | np.random.Generator | np.random.RandomState | None
)  # fmt: skip
