"""Robots and targets, what they perceive, and the model that steps them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if __name__ != "teamsight.agents":
    raise ImportError(
        "import teamsight.agents: the folder agents/ is a part of the package teamsight, not a package of its own"
    )

if TYPE_CHECKING:
    from teamsight.agents.awareness.check import check_awareness
    from teamsight.agents.mesa.visualisation import draw_arena, make_world_component, portrayal
    from teamsight.agents.world_data import AgentLeftError

_HOMES = {
    "AgentLeftError": "teamsight.agents.world_data",
    "check_awareness": "teamsight.agents.awareness.check",
    "draw_arena": "teamsight.agents.mesa.visualisation",
    "make_world_component": "teamsight.agents.mesa.visualisation",
    "portrayal": "teamsight.agents.mesa.visualisation",
}

__all__ = ["AgentLeftError", "check_awareness", "draw_arena", "make_world_component", "portrayal"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
