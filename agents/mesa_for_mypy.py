"""The public members of mesa's base classes for mypy; nothing imports this file at run time.

``Any`` stands for mesa's own classes, which have no types for mypy, and for models of the user's.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, MutableSet, Sequence
from typing import Any

import numpy as np


class AgentSet(MutableSet[Any], Sequence[Any]):
    """The public members of `mesa.agent.AgentSet`."""

    random: random.Random

    def __contains__(self, agent: object) -> bool:
        raise NotImplementedError

    def __iter__(self) -> Iterator[Any]:
        raise NotImplementedError

    def __len__(self) -> int:
        raise NotImplementedError

    def __getitem__(self, item: Any) -> Any:
        raise NotImplementedError

    def add(self, agent: Any) -> None: ...
    def discard(self, agent: Any) -> None: ...
    def select(
        self, filter_func: Any = None, at_most: float = ..., inplace: bool = False, agent_type: type | None = None
    ) -> AgentSet:
        raise NotImplementedError

    def shuffle(self, inplace: bool = False) -> AgentSet:
        raise NotImplementedError

    def sort(self, key: Any, ascending: bool = False, inplace: bool = False) -> AgentSet:
        raise NotImplementedError

    def do(self, method: str | Callable[..., Any], *args: Any, **kwargs: Any) -> AgentSet:
        raise NotImplementedError

    def shuffle_do(self, method: str | Callable[..., Any], *args: Any, **kwargs: Any) -> AgentSet:
        raise NotImplementedError

    def map(self, method: str | Callable[..., Any], *args: Any, **kwargs: Any) -> list[Any]:
        raise NotImplementedError

    def agg(self, attribute: str, func: Any) -> Any:
        raise NotImplementedError

    def get(self, attr_names: Any, handle_missing: str = "error", default_value: Any = None) -> list[Any]:
        raise NotImplementedError

    def set(self, attr_name: str, value: Any) -> AgentSet:
        raise NotImplementedError

    def groupby(self, by: Any, result_type: str = "agentset") -> Any:
        raise NotImplementedError

    def to_list(self) -> list[Any]:
        raise NotImplementedError


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
    def agents(self) -> AgentSet:
        raise NotImplementedError

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
