"""Where identities are among others."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Integers = npt.NDArray[np.int64]


def places(known: Integers, wanted: Integers) -> Integers:
    """Return the index of each wanted number among the known ones; −1 for those that are not there."""
    order = np.argsort(known, kind="stable")
    at = np.searchsorted(known[order], wanted)
    found: Integers = order[np.minimum(at, len(known) - 1)] if len(known) else np.full(len(wanted), -1)
    return np.where(known[found] == wanted, found, -1) if len(known) else found
