"""Things that have a name, each imported when it is first used."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pkgutil import resolve_name
from typing import TypeVar, cast

from teamsight.core import references

T = TypeVar("T")


class Registry(Mapping[str, T]):
    """Classes or functions by name; to list the names imports none of them.

    Parameters
    ----------
    homes : mapping of str to str
        For each name, the module and the class or function in it: "module:attribute".
    group : str, optional
        The entry points under which other distributions add plug-ins; see `teamsight.core.plugins`.
    by_reference : str, optional
        What one of them is called, where "package.module:Name" stands for the object in any module, too.

    Notes
    -----
    Plug-ins are found by name and listed by `plug_ins`, but not by iteration: what is installed is looked up only for a
    name that is not in `homes`. A plug-in cannot replace what is.
    """

    def __init__(self, homes: Mapping[str, str], group: str | None = None, by_reference: str = "") -> None:
        self._homes = homes
        self._loaded: dict[str, T] = {}
        self._group = group
        self._by_reference = by_reference

    def __getitem__(self, name: str) -> T:
        if name in self._homes:
            home = self._homes[name]
            if home not in self._loaded:
                self._loaded[home] = resolve_name(home)
            return self._loaded[home]
        if self._is_reference(name):
            return cast(T, references.load(name, self._by_reference, place="run this in the folder of its file"))
        if not self._is_plug_in(name):
            raise KeyError(name)
        from teamsight.core import plugins

        return cast(T, plugins.find(str(self._group), name))  # users of the registry check what it is

    # It stands for itself: to compare two would import all that is in them, and annotations must be hashed.
    __eq__, __hash__ = object.__eq__, object.__hash__

    def __iter__(self) -> Iterator[str]:
        return iter(self._homes)

    def __len__(self) -> int:
        return len(self._homes)

    def __contains__(self, name: object) -> bool:
        return name in self._homes or (isinstance(name, str) and (self._is_reference(name) or self._is_plug_in(name)))

    def is_built_in(self, name: str) -> bool:
        """Return whether a name is one of this package, not that of a plug-in."""
        return name in self._homes

    def _is_reference(self, name: str) -> bool:
        return bool(self._by_reference) and references.is_reference(name)

    def _is_plug_in(self, name: str) -> bool:
        if self._group is None:
            return False
        from teamsight.core import plugins

        return plugins.has(self._group, name)

    def plug_ins(self) -> tuple[str, ...]:
        """Return the names of the plug-ins that are installed, in alphabetical order."""
        if self._group is None:
            return ()
        from teamsight.core import plugins

        return plugins.names(self._group)
