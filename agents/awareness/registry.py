"""The degrees of awareness that have a name; each is imported when it is first used."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.awareness.interface import Awareness

# By name, in the order of figures and tables: the module and the class.
_HOMES = {
    "none": "teamsight.agents.awareness.none:NoAwareness",
    "ring": "teamsight.agents.awareness.ring:RingAwareness",
    "pairwise": "teamsight.agents.awareness.pairwise:PairwiseAwareness",
    "shared": "teamsight.agents.awareness.shared:SharedAwareness",
}


class _Degrees(Mapping[str, "type[Awareness]"]):
    """The classes by name, each imported on access."""

    def __getitem__(self, name: str) -> type[Awareness]:
        degree: type[Awareness] = resolve_name(_HOMES[name])
        return degree

    def __iter__(self) -> Iterator[str]:
        return iter(_HOMES)

    def __len__(self) -> int:
        return len(_HOMES)

    def __contains__(self, name: object) -> bool:
        return name in _HOMES


#: The degrees of awareness by name.
AWARENESS: Mapping[str, type[Awareness]] = _Degrees()


def awareness_named(name: str, options: Mapping[str, Any] | None = None) -> Awareness:
    """Return the degree of awareness of a name.

    Parameters
    ----------
    name : str
        A key of `AWARENESS`.
    options : mapping of str to object, optional
        Options of degrees; those that this degree does not have, and those that are None, are ignored.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, or an option has a wrong value.
    """
    degree = AWARENESS[checks.choice("awareness", name, AWARENESS)]
    given = {option: value for option, value in (options or {}).items() if value is not None}
    return degree(**{option: given[option] for option in degree.options() if option in given})


def with_option(option: str) -> tuple[str, ...]:
    """Return the names of the degrees that have an option."""
    return tuple(name for name, degree in AWARENESS.items() if option in degree.options())
