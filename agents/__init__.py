"""Where mind meets world: robots and targets, what they perceive, and the model that steps them."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if __name__ != "teamsight.agents":
    raise ImportError(
        "import teamsight.agents: the folder agents/ is a part of the package teamsight, not a package of its own"
    )

if TYPE_CHECKING:
    from teamsight.agents.awareness.check import check_awareness

_HOME = {"check_awareness": "teamsight.agents.awareness.check"}

__all__ = ["check_awareness"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value
