"""What robots and targets have in common: a mesa agent that is a view of one row of its group's arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.policies.interface import PerceptOfOne, percept_of_one

if TYPE_CHECKING:
    from teamsight.agents.group import Group
    from teamsight.agents.model import World

Floats = npt.NDArray[np.float64]


class Body(mesa.Agent):  # type: ignore[misc]
    """An agent with a body in the world. Groups make their agents; scripts read and move them.

    Attributes
    ----------
    group : Group
        The group that it belongs to.
    row : int
        Its row in the group's arrays.
    """

    team: ClassVar[str | None] = None

    model: World

    def __init__(self, model: World, group: Group, row: int) -> None:
        super().__init__(model)
        self.group, self.row = group, row

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.unique_id} of {self.group.name!r}>"

    @property
    def position(self) -> Floats:
        """Where it is, shape (2,) [length]. What is set must lie in the arena."""
        row: Floats = self.group.position[self.row]
        return row

    @position.setter
    def position(self, value: npt.ArrayLike) -> None:
        self.model.place(self, value)

    @property
    def heading(self) -> Floats:
        """Which way it faces, shape (2,): a unit vector. What is set is given this length."""
        row: Floats = self.group.heading[self.row]
        return row

    @heading.setter
    def heading(self, value: npt.ArrayLike) -> None:
        vector = np.asarray(value, float)
        length = math.hypot(*vector) if vector.shape == (2,) else math.nan
        if not (math.isfinite(length) and length > 0):
            raise ValueError(f"heading={value!r}: must be two finite numbers that are not both 0")
        self.group.bodies.heading[self.row] = vector / length
        self.model.refresh()

    @property
    def percept(self) -> PerceptOfOne:
        """What it knows now."""
        self.model.perceive(self.group)
        return percept_of_one(self.group.percept, self.row)

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn [rad], distance [length]) for one step; what its group's policy decides unless overridden.

        Parameters
        ----------
        percept : PerceptOfOne
            What it knows.
        rng : numpy.random.Generator
            Its own random numbers for this tick.
        """
        action = self.model.policy_decision(self.group)
        x, y = action.heading[self.row]
        ahead, left = percept.heading
        turn = math.atan2(y * ahead - x * left, x * ahead + y * left) if x or y else 0.0
        return turn, float(action.distance[self.row])

    def remove(self) -> None:
        """Leave the world."""
        group = self.group
        super().remove()
        self.model.forget(group, self)

    def _within(self, kind: str) -> list[Any]:
        self.model.look()
        relation = self.group.relations.get(kind)
        if relation is None:
            return []
        graph = relation.graph
        found = []
        for index in graph.index[graph.start[self.row] : graph.start[self.row + 1]]:
            for group in reversed(relation.observed):
                if index >= relation.first[group.number]:
                    found.append(group.agents[index - relation.first[group.number]])
                    break
        return found
