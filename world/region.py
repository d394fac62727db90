"""Where bodies may be, for kernels."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import kernel


@kernel
def is_in_region(box: Any, place: Any) -> bool:
    """Whether a place is inside the box around an arena; NaN is not."""
    return bool(box[0, 0] <= place[0] <= box[1, 0] and box[0, 1] <= place[1] <= box[1, 1])
