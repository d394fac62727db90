"""The degrees of awareness that have a name; each is imported when it is first used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from teamsight.core import checks
from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.agents.awareness.interface import Awareness

#: The degrees of awareness by name, in the order of figures and tables.
AWARENESS: Mapping[str, type[Awareness]] = Registry(
    {
        "none": "teamsight.agents.awareness.none:NoAwareness",
        "ring": "teamsight.agents.awareness.ring:RingAwareness",
        "pairwise": "teamsight.agents.awareness.pairwise:PairwiseAwareness",
        "shared": "teamsight.agents.awareness.shared:SharedAwareness",
    }
)


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
