"""teamsight: teams of mobile robots, and how much each robot must know of its teammates.

The public names live in the rooms ``teamsight.agents``, ``teamsight.world``, ``teamsight.policies`` and
``teamsight.analysis``; those that most scripts need can be imported from here. They are looked up on first use, so that
``import teamsight`` (and ``teamsight --help``) stays fast.
"""

from __future__ import annotations

import os

# Only what Python has loaded before is imported: until the command line can handle Ctrl-C, each millisecond counts.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from teamsight.agents.cmommt import CMOMMT
    from teamsight.agents.model import World
    from teamsight.agents.robot import Robot
    from teamsight.agents.target import Target
    from teamsight.world.arena import Box, Disc, Torus

__version__ = "0.1.0"

_HOME = {
    "CMOMMT": "teamsight.agents.cmommt",
    "World": "teamsight.agents.model",
    "Robot": "teamsight.agents.robot",
    "Target": "teamsight.agents.target",
    "Disc": "teamsight.world.arena",
    "Box": "teamsight.world.arena",
    "Torus": "teamsight.world.arena",
}

__all__ = ["CMOMMT", "Box", "Disc", "Robot", "Target", "Torus", "World", "__version__"]

# In a checkout the four rooms stand beside this folder, at the top of the repository.
_ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
if os.path.isfile(os.path.join(_ROOT, "pyproject.toml")) and os.path.isfile(os.path.join(_ROOT, "agents", "model.py")):
    __path__.insert(0, _ROOT)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'teamsight' has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")
    import importlib

    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
