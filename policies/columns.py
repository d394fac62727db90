"""Columns in percepts: properties of the agents of a world, by identity."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined

#: One element for each identity in the world.
ByIdentity = Annotated[npt.NDArray[np.float64], "identities"]


def unknown_column(columns: Any, name: str) -> Any:
    """Raise the error for a column that a percept does not have."""
    have = ", ".join(columns._fields) or "none"
    raise AttributeError(
        f"percept.columns.{name}: the percept has no such column; it has {have}; declare it in the policy, as in "
        f"columns = ({name!r},)"
    )


if TYPE_CHECKING:

    class PerceivedColumns(tuple[npt.NDArray[np.float64], ...]):
        """The columns that a policy reads, as attributes of their names."""

        def __getattr__(self, name: str) -> npt.NDArray[np.float64]: ...
else:

    class PerceivedColumns(NamedTuple):
        """The columns that a policy reads, as attributes of their names; none here."""

        def __getattr__(self, name):
            return unknown_column(self, name)


NO_COLUMNS: Any = PerceivedColumns()


@cache
def columns_type(names: tuple[str, ...]) -> Any:
    """Return the NamedTuple with one array for each of these columns."""
    if not names:
        return PerceivedColumns
    made = NamedTuple("PerceivedColumns", [(name, ByIdentity) for name in names])  # type: ignore[misc]
    setattr(made, "__getattr__", unknown_column)  # noqa: B010
    return made


def columns_of(names: tuple[str, ...], arrays: Any) -> Any:
    """Return the columns with these names and arrays."""
    return columns_type(names)._make(arrays) if names else NO_COLUMNS


def selected_columns(columns: Any, names: tuple[str, ...], reader: str) -> Any:
    """Return only the columns that a policy reads.

    Raises
    ------
    ValueError
        If the percept lacks one of them.
    """
    have = columns._fields
    if have == names:
        return columns
    for name in names:
        if name not in have:
            raise ValueError(
                f"{reader}: reads the column {name!r}, and the percept has {', '.join(have) or 'none'}; add it to a "
                f"group of the world: group.add_column({name!r})"
            )
    return columns_of(names, (getattr(columns, name) for name in names))


@inlined
def column_of(column: Any, identity: int) -> float:
    """Return what a column holds of an agent; NaN if the agent does not have it, or its identity is hidden.

    Parameters
    ----------
    column : ndarray, shape (identities,), float64
        A column of a percept, ``percept.columns.NAME``.
    identity : int
        The agent: ``percept.identity[i]`` for the robot itself, ``percept.teammates.identity[k]`` for a teammate.
    """
    if identity < 0 or identity >= column.shape[0]:
        return math.nan
    return column[identity]  # type: ignore[no-any-return]
