"""Worlds in a notebook."""

from __future__ import annotations

import math

from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.needed import kernels_needed
from teamsight.agents.group_card import HEADER, group_row
from teamsight.agents.picture import MOST_DRAWN, svg
from teamsight.agents.world_data import WorldData
from teamsight.core.card import card, table
from teamsight.core.checks import shown


def world_html(name: str, data: WorldData, engine: Engine) -> str:
    """Return a card of a world: its groups, what its team observes, and a picture. Nothing is compiled.

    Parameters
    ----------
    name : str
        The name of its class.
    data, engine : WorldData, Engine
        Its parts.
    """
    rows: list[tuple[str, object]] = [("arena", shown(data.arena)), ("tick", data.timeline.tick), ("seed", data.seed)]
    observed = data.history.observed_fraction
    if not math.isnan(observed):
        rows.append(("observed fraction so far", f"{observed:.1%}"))
    knows = _knows_neighbours(data, engine)
    picture = svg(data, lambda agent: knows and agent.is_observed)
    total = sum(map(len, data.groups))
    notes = []
    if total > MOST_DRAWN:
        notes.append(f"a part of the {total:,} agents is drawn")
    if any(group.team is None for group in data.groups):
        notes.append("filled: observed" if knows else "which are observed is known after the first step")
    caption = f"<small>{'; '.join(notes)}</small>"
    return card(name, rows, table(HEADER, map(group_row, data.groups)), picture, caption)


def _knows_neighbours(data: WorldData, engine: Engine) -> bool:
    """Whether the neighbour lists of the present positions are there, or can be made without compiling."""
    if engine.is_bound and engine.is_seen:
        return True
    if data.timeline.inside or any(kernel.is_missing() for kernel in kernels_needed(data)()):
        return False
    engine.prepare()
    return True
