"""Groups and agents in a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import Channel, note_of_inactive
from teamsight.core.card import card, table
from teamsight.core.checks import shown

if TYPE_CHECKING:
    from teamsight.agents.group import Group

Floats = npt.NDArray[np.float64]

#: The header of `group_row`.
HEADER = ("group", "agents", "class", "team", "policy", "awareness", "speed", "range", "senses")


def group_row(group: Group) -> tuple[str, ...]:
    """Return a line about a group, for a table with `HEADER`."""
    policy, awareness = group.rules
    size = f"{len(group.agents):,}{note_of_inactive(group.bodies.active)}"
    return (
        group.name, size, group.agent_class.__name__, group.team or "–", _named(policy),
        shown(awareness, 40), span(group.bodies.speed), span(group.bodies.sensing_range),
        ", ".join(_sensed(name, channel) for name, channel in group.channels.items()),
    )  # fmt: skip


def group_html(group: Group) -> str:
    """Return a card of a group, with its columns."""
    rows = [(f"column {name}", shown(column)) for name, column in group.columns.items()]
    return card(f"Group {group.name}", rows, table(HEADER, [group_row(group)]))


def agent_html(agent: object, group: Group, row: int) -> str:
    """Return a card of an agent.

    Parameters
    ----------
    agent : Body
        The agent.
    group : Group
        Its group.
    row : int
        Its row; below 0 once it has been removed.
    """
    if row < 0:
        return card(repr(agent), [("state", "removed from the world")])
    bodies = group.bodies
    rows: list[tuple[str, object]] = [
        ("position", _pair(bodies.position[row])), ("heading", _pair(bodies.heading[row])),
        ("speed", f"{bodies.speed[row]:.4g}"), ("sensing range", f"{bodies.sensing_range[row]:.4g}"),
        ("policy", _named(group.policy_of(row))), ("awareness", group.rules[1]),
    ]  # fmt: skip
    if not bodies.active[row]:
        rows.insert(0, ("state", "inactive"))
    broken = ", ".join(name for name, channel in group.channels.items() if not channel.works[row])
    if broken:
        rows.append(("sensors out of order", broken))
    rows += [(name, shown(column[row])) for name, column in group.columns.items()]
    return card(repr(agent), rows)


def column_html(name: str, values: npt.NDArray[Any]) -> str:
    """Return a card of a column: its type, its least and largest element, and the first ones."""
    rows = [("elements", f"{values.dtype} {values.shape}")]
    if values.dtype.kind in "biuf":
        rows.append(("values", span(values)))
    rows.append(("first", ", ".join(shown(value, 20) for value in values[:5].tolist())))
    return card(f"Column {name}", rows)


def span(values: npt.NDArray[np.generic]) -> str:
    """Return the least and the largest of some numbers, or the one that all are."""
    if not values.size:
        return "–"
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return low if low == high else f"{low} to {high}"


def _pair(vector: Floats) -> str:
    """Return a position or a direction."""
    return f"({vector[0]:.3f}, {vector[1]:.3f})"


def _named(policy: object) -> str:
    """Return the name of a policy's class, or of a function."""
    name = getattr(policy, "__name__", None)
    return str(name or type(policy).__name__)


def _sensed(name: str, channel: Channel) -> str:
    groups = " + ".join(group.name for group in channel.observed)
    sensor = f" by {shown(channel.sensor)}" if channel.sensor is not None else ""
    return f"{name}: {groups}{sensor}" if groups and groups != name else f"{name}{sensor}"
