"""``teamsight plugins``: list what other distributions add, and whether it loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from teamsight.cli.options import Options

if TYPE_CHECKING:
    from collections.abc import Sequence

    from teamsight.core.plugins import PlugIn

# For each group with names of our own: the registry that has them, or the names.
_REGISTRIES = {
    "teamsight.policies": ("teamsight.policies.registry", "POLICIES"),
    "teamsight.awareness": ("teamsight.agents.awareness.registry", "AWARENESS"),
    "teamsight.rewards": ("teamsight.analysis.learning.registry", "REWARDS"),
    "teamsight.tasks": ("teamsight.tasks.registry", "TASKS"),
}
_OWN = {"teamsight.models": ("cmommt",), "teamsight.measures": ("summary", "evenness")}


@dataclass(frozen=True, kw_only=True)
class PluginsSettings(Options):
    """``teamsight plugins`` has no options."""


def plugins(settings: PluginsSettings) -> int:
    """List the plug-ins that are installed, and whether each loads.

    A plug-in is a policy, model, sensor, reward, measure, degree of awareness or task of another distribution, which
    names it as an entry point; see docs/studies.md. The exit status is 1 if one of them does not load.
    """
    from teamsight.cli.show import plural, say
    from teamsight.core.plugins import GROUPS, plug_ins

    found = plug_ins()
    if not found:
        say(f"no plug-ins are installed; their groups of entry points are {', '.join(GROUPS)}")
        return 0
    states = [_state(one, found) for one in found]
    _print(found, states)
    wrong = sum(bool(state) for state in states)
    say(f"{plural(len(found), 'plug-in')}, of which {wrong or 'none'} cannot be used" if wrong else "all load")
    return 1 if wrong else 0


def _print(found: Sequence[PlugIn], states: Sequence[str]) -> None:
    from rich.table import Table
    from rich.text import Text

    from teamsight.cli.errors import printable
    from teamsight.cli.show import wide_console

    table = Table(box=None, pad_edge=False)
    for heading in ("group", "name", "object", "distribution", "state"):
        table.add_column(heading, overflow="fold")
    for one, state in zip(found, states, strict=True):
        table.add_row(*(Text(printable(text)) for text in (*one, state or "loads")))
    wide_console().print(table, highlight=False)


def _state(one: PlugIn, others: Sequence[PlugIn]) -> str:
    """Return why a plug-in cannot be used; empty if it can."""
    if one.name in _built_in(one.group):
        return f"is never used: {one.name!r} is a name of teamsight; rename the entry point"
    rivals = [other for other in others if other[:2] == one[:2] and other.reference != one.reference]
    if rivals:
        return f"{rivals[0].distribution} has one of this name too; uninstall one of them"
    try:
        one.load()
    except ValueError as error:
        return str(error).partition(" does not load: ")[2] or str(error)
    return ""


def _built_in(group: str) -> tuple[str, ...]:
    from importlib import import_module

    if group not in _REGISTRIES:
        return _OWN.get(group, ())
    module, name = _REGISTRIES[group]
    return tuple(getattr(import_module(module), name))
