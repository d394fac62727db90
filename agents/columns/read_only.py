"""Read-only rows of arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


class Place(np.ndarray[Any, np.dtype[np.float64]]):
    """A read-only row of an array. ``agent.position += step`` makes a new row, which is then assigned."""

    def __iadd__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) + other

    def __isub__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) - other


def unwritable(row: npt.NDArray[Any]) -> Any:
    """Return a row of an array as a `Place`."""
    place = row.view(Place)
    place.flags.writeable = False
    return place
