"""Places: rows of arrays that agents hand out, which cannot be written to."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


class Place(np.ndarray[Any, np.dtype[np.float64]]):
    """A row of an array that cannot be written to; ``agent.position += step`` makes a new one, which is then set."""

    def __iadd__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) + other

    def __isub__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) - other


def unwritable(row: npt.NDArray[Any]) -> Any:
    """Return a row of an array as a `Place`."""
    place = row.view(Place)
    place.flags.writeable = False
    return place
