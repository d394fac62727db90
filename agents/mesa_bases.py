"""mesa's base classes, as type checkers should see them.

mesa has no type information for mypy, which would let every attribute of a subclass pass, and so hide typos. It reads
stand-ins instead; other checkers read mesa's source. This file only passes the names on: pyright takes the last.
"""

from __future__ import annotations

# True for mypy, and for nobody else.
MYPY = False
if MYPY:
    from teamsight.agents.mesa_for_mypy import Agent as Agent
    from teamsight.agents.mesa_for_mypy import Model as Model
else:
    from mesa import Agent as Agent
    from mesa import Model as Model
