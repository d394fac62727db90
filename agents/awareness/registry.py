"""The degrees of awareness that have a name; each is imported when it is first used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.core import checks
from teamsight.core.component import Allowed
from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.agents.awareness.interface import Awareness

#: The degrees of awareness by name, in the order of figures and tables.
AWARENESS: Registry[type[Awareness]] = Registry(
    {
        "none": "teamsight.agents.awareness.degrees:NoAwareness",
        "ring": "teamsight.agents.awareness.degrees:RingAwareness",
        "nearest": "teamsight.agents.awareness.degrees:NearestAwareness",
        "pairwise": "teamsight.agents.awareness.degrees:PairwiseAwareness",
        "shared": "teamsight.agents.awareness.degrees:SharedAwareness",
        "relayed": "teamsight.agents.awareness.relayed:RelayedAwareness",
    },
    group="teamsight.awareness",
    by_reference="awareness",
)

#: δ, the number of sectors of a ring or of listed teammates; more than can be would fill memory with empty ones.
Delta = Annotated[
    int,
    Allowed(
        least=1, most=10_000,
        cure="it is a number of sectors or teammates, of which 360 are enough for most uses; for no awareness use "
        "NoAwareness(), for all teammates PairwiseAwareness()",
    ),
]  # fmt: skip


def awareness_named(name: str, options: Mapping[str, Any] | None = None) -> Awareness:
    """Return the degree of awareness of a name.

    Parameters
    ----------
    name : str
        A key of `AWARENESS`, or the name of a plug-in.
    options : mapping of str to object, optional
        Options of degrees; those that this degree does not have, and those that are None, are ignored.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, or an option has a wrong value.
    """
    degree = degree_named(name)
    given = {option: value for option, value in (options or {}).items() if value is not None}
    return degree(**{option: given[option] for option in degree.options() if option in given})


def degree_named(name: str) -> type[Awareness]:
    """Return the class of the degree of awareness of a name.

    Raises
    ------
    ValueError
        If the name is unknown, or that of a plug-in that does not load.
    TypeError
        If the plug-in of this name is no degree of awareness.
    """
    degree = AWARENESS[checks.choice("awareness", name, AWARENESS)]
    if not AWARENESS.is_built_in(name):
        from teamsight.agents.awareness.interface import Awareness

        if not (isinstance(degree, type) and issubclass(degree, Awareness)):
            base = f"{Awareness.__module__.rpartition('.')[0]}.{Awareness.__name__}"
            raise TypeError(f"awareness={name!r}: this plug-in is no class derived from {base}")
    return degree


def with_option(option: str) -> tuple[str, ...]:
    """Return the names of the degrees that have an option."""
    return tuple(name for name, degree in AWARENESS.items() if option in degree.options())
