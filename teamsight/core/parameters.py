"""The constants of a component that its kernel reads, by default."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from teamsight.core import checks


def parameters_of(component: Any, base: type) -> tuple[float, ...]:
    """Return the fields of a component that is a dataclass, in order; none for a class without attributes of its own.

    Parameters
    ----------
    component : object
        A policy, a degree of awareness or the like.
    base : type
        The base class of such components; fields with the names of its attributes are declarations, not constants.

    Raises
    ------
    TypeError
        If a field is not a number, or the component keeps attributes and is not a dataclass.
    """
    kind = type(component).__name__
    if not is_dataclass(component):
        own = [name for name in getattr(component, "__dict__", ()) if not hasattr(base, name)]
        if own:
            raise TypeError(
                f"{kind}: has the attribute {own[0]!r}, and no constants for its kernel; make {kind} a dataclass, "
                "whose fields are the constants, or define the property parameters"
            )
        return ()
    names = [field.name for field in fields(component) if not hasattr(base, field.name)]
    values = {name: getattr(component, name) for name in names}
    for name, value in values.items():
        if not isinstance(value, (int, float, np.number, np.bool_)):
            raise TypeError(
                f"{kind}.{name}={checks.shown(value)}: is not a number, which a kernel could read; define the property "
                f"parameters of {kind}, a tuple of floats"
            )
    return tuple(map(float, values.values()))
