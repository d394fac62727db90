"""The public members of mesa's base classes for mypy; nothing imports this file at run time.

``Any`` stands for mesa's own classes, which have no types for mypy, and for models of the user's.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np


class Agent:
    """The public members of `mesa.Agent`."""

    model: Any
    unique_id: int

    def __init__(self, model: Any) -> None: ...
    def remove(self) -> None: ...
    def step(self) -> None: ...
    def advance(self) -> None: ...
    @property
    def random(self) -> random.Random:
        raise NotImplementedError

    @property
    def rng(self) -> np.random.Generator:
        raise NotImplementedError


class Model:
    """The public members of `mesa.Model`."""

    running: bool
    steps: int
    # mesa 3.5 only.
    time: float
    random: random.Random

    def __init__(self, *, rng: Any = None, seed: Any = None) -> None: ...
    @property
    def agents(self) -> Any: ...
    @property
    def agent_types(self) -> list[type]:
        raise NotImplementedError

    @property
    def agents_by_type(self) -> dict[type, Any]:
        raise NotImplementedError

    def register_agent(self, agent: Agent) -> None: ...
    def deregister_agent(self, agent: Agent) -> None: ...
    def run_model(self) -> None: ...
    def step(self) -> None: ...
    def reset_randomizer(self, seed: int | None = None) -> None: ...
    def reset_rng(self, rng: Any = None) -> None: ...
    def remove_all_agents(self) -> None: ...
