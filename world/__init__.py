"""Physics without minds: arenas, placement, bodies, motion, who is near whom, noise, and the clock."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if __name__ != "teamsight.world":
    raise ImportError(
        "import teamsight.world: the folder world/ is a part of the package teamsight, not a package of its own"
    )

if TYPE_CHECKING:
    from teamsight.world.arena import Arena, Box, Disc, Torus
    from teamsight.world.check import check_arena

_HOME = {
    "Arena": "teamsight.world.arena",
    "Box": "teamsight.world.arena",
    "Disc": "teamsight.world.arena",
    "Torus": "teamsight.world.arena",
    "check_arena": "teamsight.world.check",
}

__all__ = ["Arena", "Box", "Disc", "Torus", "check_arena"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value
