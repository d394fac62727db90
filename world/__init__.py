"""Physics: arenas, placement, bodies, motion, the neighbour search, noise and the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if __name__ != "teamsight.world":
    raise ImportError(
        "import teamsight.world: the folder world/ is a part of the package teamsight, not a package of its own"
    )

if TYPE_CHECKING:
    from teamsight.world.arena import Arena, Box, Disc, Obstacle, Obstructed, Outline, Torus
    from teamsight.world.check import check_arena, check_contact, check_interaction
    from teamsight.world.contact import Contact, Pass, Slide, Stop
    from teamsight.world.interaction import InteractingBodies, Interaction, InteractionState
    from teamsight.world.shapes import Circle, Polygon
    from teamsight.world.walls import Sight, Walls

_HOMES = {
    "Arena": "teamsight.world.arena",
    "Box": "teamsight.world.arena",
    "Circle": "teamsight.world.shapes",
    "Contact": "teamsight.world.contact",
    "Disc": "teamsight.world.arena",
    "InteractingBodies": "teamsight.world.interaction",
    "Interaction": "teamsight.world.interaction",
    "InteractionState": "teamsight.world.interaction",
    "Obstacle": "teamsight.world.arena",
    "Obstructed": "teamsight.world.arena",
    "Outline": "teamsight.world.arena",
    "Pass": "teamsight.world.contact",
    "Polygon": "teamsight.world.shapes",
    "Sight": "teamsight.world.walls",
    "Slide": "teamsight.world.contact",
    "Stop": "teamsight.world.contact",
    "Torus": "teamsight.world.arena",
    "Walls": "teamsight.world.walls",
    "check_arena": "teamsight.world.check",
    "check_contact": "teamsight.world.check",
    "check_interaction": "teamsight.world.check",
}

__all__ = [
    "Arena", "Box", "Circle", "Contact", "Disc", "InteractingBodies", "Interaction", "InteractionState", "Obstacle",
    "Obstructed", "Outline", "Pass", "Polygon", "Sight", "Slide", "Stop", "Torus", "Walls", "check_arena",
    "check_contact", "check_interaction",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
