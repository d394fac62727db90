"""Plug-ins: what other distributions contribute by name, through entry points.

A distribution lists its plug-ins in its ``pyproject.toml``::

    [project.entry-points."teamsight.policies"]
    flee = "my_package.policies:Flee"
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator
from functools import lru_cache
from typing import NamedTuple

from teamsight.core import checks, references

#: The groups of entry points, and what a plug-in of each is called.
GROUPS = {
    "teamsight.policies": "policy",
    "teamsight.models": "model",
    "teamsight.sensors": "sensor",
    "teamsight.rewards": "reward",
    "teamsight.measures": "measure",
    "teamsight.awareness": "degree of awareness",
    "teamsight.tasks": "task",
    "teamsight.contacts": "contact",
    "teamsight.drives": "drive",
}


class PlugIn(NamedTuple):
    """One entry point of an installed distribution.

    Attributes
    ----------
    group : str
        A key of `GROUPS`.
    name : str
        The name by which users choose it.
    reference : str
        "package.module:Name".
    distribution : str
        The name and version of the distribution.
    """

    group: str
    name: str
    reference: str
    distribution: str

    def load(self, what: str = "plug-in") -> object:
        """Return the class, function or other object.

        Parameters
        ----------
        what : str
            The parameter that holds the name, for error messages.

        Raises
        ------
        ValueError
            If it does not load; the message names the distribution and the error.
        """
        given = f"{what}={checks.shown(self.name)}"
        try:
            return references.load(self.reference, "it")
        except (TypeError, ValueError) as error:
            why = str(error).removeprefix(f"it={checks.shown(self.reference)}: ")
            raise ValueError(
                f"{given}: the plug-in {self.reference!r} of {self.distribution} does not load: {why}"
            ) from error


def plug_ins() -> tuple[PlugIn, ...]:
    """Return all plug-ins that are installed, by group and name. None of them is imported."""
    return tuple(sorted(_installed(), key=lambda one: (list(GROUPS).index(one.group), one)))


def names(group: str) -> tuple[str, ...]:
    """Return the names of the plug-ins of a group, in alphabetical order."""
    return tuple(sorted({one.name for one in _of(group)}))


def references_of(known: Collection[str]) -> set[str]:
    """Return what the plug-ins of these names refer to, without looking for new ones."""
    return {one.reference for one in _listed(tuple(sys.path)) if one.name in known}


def has(group: str, name: str) -> bool:
    """Return whether a plug-in of this name is installed, even if it does not load."""
    return any(one.name == name for one in _of(group, name))


def find(group: str, name: str, what: str | None = None) -> object:
    """Return the plug-in of a name; its module is imported.

    Parameters
    ----------
    group : str
        A key of `GROUPS`.
    name : str
        The name of an entry point.
    what : str, optional
        The parameter that holds the name, for error messages; by default what the group holds.

    Raises
    ------
    ValueError
        If there is none, several distributions have one of this name, or it does not load.
    """
    called = what or GROUPS[checks.choice("group", group, GROUPS)].partition(" ")[0]
    found = [one for one in _of(group, name) if one.name == name]
    if not found:
        known = names(group)
        listed = f"plug-ins are {', '.join(known)}" if known else "no plug-in is installed"
        raise ValueError(f"{called}={checks.shown(name)}: unknown; {checks.suggestion(name, known)}{listed}")
    if len({one.reference for one in found}) > 1:
        several = " and ".join(f"{one.distribution} ({one.reference})" for one in sorted(found))
        raise ValueError(f"{called}={checks.shown(name)}: is a plug-in of {several}; uninstall one of them")
    return found[0].load(called)


def _of(group: str, name: str | None = None) -> list[PlugIn]:
    """Return the plug-ins of a group; look again if there is none of this name, which may just have been installed."""
    checks.choice("group", group, GROUPS)
    path = tuple(sys.path)
    found = [one for one in _listed(path) if one.group == group]
    if name is not None and name not in {one.name for one in found}:
        _listed.cache_clear()
        found = [one for one in _listed(path) if one.group == group]
    return found


@lru_cache(maxsize=1)
def _listed(path: tuple[str, ...]) -> tuple[PlugIn, ...]:
    """Return the plug-ins that are found on a path, which is that of Python."""
    return tuple(_installed())


def _installed() -> Iterator[PlugIn]:
    """Yield the plug-ins of all distributions on Python's path; of several versions, the first is the one imported."""
    from importlib import metadata

    seen = set()
    for distribution in metadata.distributions():
        # Most distributions are passed over here, unread: what is wrong with them is no concern of ours.
        text = distribution.read_text("entry_points.txt")
        if text is None or "teamsight." not in text:
            continue
        name = distribution.metadata["Name"] or "a distribution without a name"
        if name.lower() not in seen:
            seen.add(name.lower())
            yield from _listed_in(text, f"{name} {distribution.metadata['Version'] or ''}".strip())


def _listed_in(text: str, distribution: str) -> Iterator[PlugIn]:
    """Yield the plug-ins that the file ``entry_points.txt`` of a distribution lists."""
    group = ""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("[") and line.endswith("]"):
            group = line[1:-1].strip()
        elif group in GROUPS and line and not line.startswith(("#", ";")):
            name, _, value = line.partition("=")
            # An entry point may end with extras: "module:Name [extra]".
            yield PlugIn(group, name.strip(), value.partition("[")[0].strip(), distribution)
