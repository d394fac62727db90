"""Sound kernels: those whose actions are right whatever is perceived, so that no step needs to check them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.handmade.stationary import Stationary

#: They copy headings and speeds or make headings from noise. All others compute with what they perceive and remember.
SOUND: frozenset[Callable[..., Any]] = frozenset({RandomWalk.kernel, Stationary.kernel})
