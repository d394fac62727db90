"""Physics: arenas, placement, bodies, motion, the neighbour search, noise and the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if __name__ != "teamsight.world":
    raise ImportError(
        "import teamsight.world: the folder world/ is a part of the package teamsight, not a package of its own"
    )

if TYPE_CHECKING:
    from teamsight.world.arena import Arena, Box, Disc, Torus
    from teamsight.world.check import check_arena

_HOMES = {
    "Arena": "teamsight.world.arena",
    "Box": "teamsight.world.arena",
    "Disc": "teamsight.world.arena",
    "Torus": "teamsight.world.arena",
    "check_arena": "teamsight.world.check",
}

__all__ = ["Arena", "Box", "Disc", "Torus", "check_arena"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
